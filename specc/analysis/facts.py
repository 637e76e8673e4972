"""The shared queries about one system."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property, partial, wraps
from typing import TYPE_CHECKING, TypeVar

from specc.analysis.connections import Connections, Rates
from specc.analysis.graph import CAUSES, Step, find_steps, reached_from
from specc.analysis.lasting import Lasting
from specc.analysis.misfits import Misfits
from specc.analysis.plant import BoundElement, bound_elements, plant_model
from specc.analysis.presence import Presence, Readings, find_presence, names_any
from specc.analysis.vague import Views, is_vague
from specc.analysis.valueless import valueless
from specc.frozen import frozen
from specc.mjcf import Model, ModelError
from specc.model.expr import Truth, has_unknown
from specc.model.fsm import Cause, Condition, State, Transition
from specc.model.system import Subsystem, System
from specc.proof import InputName, Prover, RowVerdict, Witness

if TYPE_CHECKING:
    from specc.analysis.ages import Ages


T = TypeVar("T")

# The shared queries about one system.


@frozen
class Decided:
    """The verdict about the rows of one state and cause."""

    subsystem: Subsystem
    state: State
    cause: Cause
    verdict: RowVerdict


def _named_twice(system: System) -> frozenset[str]:
    """All parts of agents that have two subsystems of the same name: their peers are not known."""
    found: set[str] = set()
    for agent in system.agents:
        names = [s.qualified_name for s in agent.subsystems]
        if len(set(names)) < len(names):
            found |= {*names, *(device.qualified_name for device in agent.devices)}
    return frozenset(found)


def kept(query: Callable[[Facts, Subsystem], T]) -> Callable[[Facts, Subsystem], T]:
    """A query about a subsystem that is answered once."""
    answers = f"_{query.__name__}"

    @wraps(query)
    def found(facts: Facts, subsystem: Subsystem) -> T:
        known: dict[str, T] = facts.__dict__.setdefault(answers, {})
        name = subsystem.qualified_name
        if name not in known:
            known[name] = query(facts, subsystem)
        return known[name]

    return found


class Facts:
    """Answers about a system.

    A subsystem that is `broken` is not asked about. One that is `faulty` has unknowns in it; what
    is said of it holds whatever they are.
    """

    def __init__(
        self,
        system: System,
        broken: frozenset[str] = frozenset(),
        faulty: frozenset[str] = frozenset(),
    ) -> None:
        self.system = system
        self.broken = broken | _named_twice(system)
        self.faulty = faulty
        self.connections = Connections(system)
        self.subsystems = tuple(s for s in system.subsystems if s.qualified_name not in self.broken)
        every = (*system.constants, *(c for s in self.subsystems for c in s.constants))
        self.valueless = tuple(valueless(every))
        """Constants without a value, with the reason."""
        none = {constant.name for constant, _ in self.valueless}
        self._constants = {c.name: c.value for c in system.constants if c.name not in none}
        self._verdicts: dict[tuple[str, str, Cause, int | None], RowVerdict] = {}
        self._misfits: dict[str, Misfits] = {}
        self._views = Views(self._new_prover)

    @kept
    def prover(self, subsystem: Subsystem) -> Prover:
        """The prover of a subsystem."""
        return self._new_prover(subsystem)

    def _new_prover(self, subsystem: Subsystem) -> Prover:
        always = self.connections.always_present(subsystem)
        return Prover(subsystem, self._constants, always)

    def misfits(self, owner: Subsystem | System) -> Misfits:
        """What cannot be meant in the expressions of a subsystem, or in the constants."""
        name = owner.qualified_name if isinstance(owner, Subsystem) else ""
        if name not in self._misfits:
            self._misfits[name] = Misfits(owner, {c.name: c for c in self.system.constants})
        return self._misfits[name]

    @cached_property
    def ages(self) -> Ages:
        """How old values are where they are read."""
        from specc.analysis.ages import Ages

        return Ages(self)

    def rows(self, subsystem: Subsystem, state: str) -> tuple[Transition, ...]:
        """The rows of a state, of both causes."""
        verdicts = (self.verdict(subsystem, state, cause) for cause in CAUSES)
        return tuple(row for verdict in verdicts for row in verdict.rows)

    @cached_property
    def consistent_subsystems(self) -> tuple[Subsystem, ...]:
        """The subsystems whose axioms do not contradict each other."""
        return tuple(s for s in self.subsystems if not self.prover(s).contradiction())

    def decided(self) -> Iterator[Decided]:
        """The verdicts about every state and cause of every subsystem.

        Where conditions are unknown, what they say holds whatever these are.
        """
        for subsystem in self.consistent_subsystems:
            yield from self._decided(subsystem)

    @kept
    def _decided(self, subsystem: Subsystem) -> tuple[Decided, ...]:
        return tuple(
            Decided(subsystem, state, cause, verdict)
            for state in subsystem.states
            for cause in CAUSES
            if (verdict := self._certain(subsystem, state, cause)) is not None
        )

    def _certain(self, subsystem: Subsystem, state: State, cause: Cause) -> RowVerdict | None:
        """The verdict that does not depend on anything unknown; None if there is none."""
        if not self._is_vague(subsystem, state, cause):
            return self.verdict(subsystem, state.name, cause)
        present = self.presence(subsystem).in_conditions(state.name)
        return self._views.verdict(subsystem, state.name, cause, present)

    def overlap(self, decided: Decided, pair: tuple[int, int]) -> Witness | None:
        """Where two rows of a verdict surely apply together, by their indices."""
        subsystem, state = decided.subsystem, decided.state.name
        present = self.presence(subsystem).in_conditions(state)
        return self._views.overlap(subsystem, state, decided.cause, pair, present)

    def is_vague(self, decided: Decided) -> bool:
        """Whether something about the rows of a verdict is unknown."""
        return self._is_vague(decided.subsystem, decided.state, decided.cause)

    def _is_vague(self, subsystem: Subsystem, state: State, cause: Cause) -> bool:
        return subsystem.qualified_name in self.faulty and is_vague(subsystem, state, cause)

    @cached_property
    def finished_subsystems(self) -> tuple[Subsystem, ...]:
        """The consistent subsystems with rows for all states that end."""
        return tuple(s for s in self.consistent_subsystems if not self.dead_ends(s))

    @cached_property
    def whole_subsystems(self) -> tuple[Subsystem, ...]:
        """The consistent subsystems that have no unknowns, and rows for all states that end."""
        return tuple(
            s
            for s in self.consistent_subsystems
            if s.qualified_name not in self.faulty and not self.dead_ends(s)
        )

    @kept
    def dead_ends(self, subsystem: Subsystem) -> tuple[State, ...]:
        """States that may end although the table has no row at all for them."""
        sources = {row.source for row in subsystem.transitions}
        return tuple(
            state
            for state in subsystem.states
            if state.name not in sources
            and any(
                self.prover(subsystem).prove_rows(state.name, cause).decision.possible
                for cause in CAUSES
            )
        )

    @kept
    def lasting(self, subsystem: Subsystem) -> Lasting:
        """How long the states of a subsystem without unknowns can last."""
        return Lasting(subsystem, self)

    def lacks_rows(self, decided: Decided) -> bool:
        """Whether a cause that can occur before its state is over has no row."""
        subsystem, verdict = decided.subsystem, decided.verdict
        if verdict.rows or not verdict.decision.possible:
            return False
        known = subsystem.qualified_name not in self.faulty and not self.dead_ends(subsystem)
        return not (known and self.lasting(subsystem).never_ends(decided.state, decided.cause))

    def settled(self, subsystem: Subsystem, condition: Condition) -> bool | None:
        """The constant truth value of a condition that should change; None if it can change.

        A literal `True` or `False` is intended, and a parameter may well decide a condition.
        """
        parameters = {constant.name for constant in subsystem.constants}
        if isinstance(condition.when, Truth) or names_any(condition.when, parameters):
            return None
        return self.prover(subsystem).constant(condition.when)

    def verdict(
        self, subsystem: Subsystem, state: str, cause: Cause, *, without: int | None = None
    ) -> RowVerdict:
        """The verdict about rows, with what is known of presence; `without` one axiom, if given.

        What peers always send makes rows complete, but none superfluous.
        """
        key = subsystem.qualified_name, state, cause, without
        if key not in self._verdicts:
            present = self.presence(subsystem).in_conditions(state)
            prove = partial(self.prover(subsystem).prove_rows, state, cause, without=without)
            verdict = prove(present=present)
            fresh = () if verdict.proved or self.rates.clash else self._always_fresh(subsystem)
            if fresh:
                now = prove(present=present, fresh=fresh).decision
                verdict = verdict.where_fresh(now, fresh)
            self._verdicts[key] = verdict
        return self._verdicts[key]

    @kept
    def _always_fresh(self, subsystem: Subsystem) -> frozenset[InputName]:
        """Inputs that are fresh whenever conditions are asked, whatever state the sender is in."""
        return self.connections.always_fresh(subsystem, self.broken)

    @kept
    def ways_are_known(self, subsystem: Subsystem) -> bool:
        """Whether no row is missing and no condition has one value by mistake.

        If the table needs a repair anyway, it is not known yet which states can be reached.
        """
        return self.conditions_vary(subsystem) and not any(
            decided.verdict.decision.gap or self.lacks_rows(decided)
            for decided in self._decided(subsystem)
        )

    def conditions_vary(self, subsystem: Subsystem) -> bool:
        """Whether no condition has one value by mistake."""
        return all(self.settled(subsystem, condition) is None for condition in _used(subsystem))

    @cached_property
    def known_machines(self) -> tuple[Subsystem, ...]:
        """The consistent subsystems with nothing unknown in what leads from state to state."""
        return tuple(
            s
            for s in self.consistent_subsystems
            if not any(has_unknown(let.value) for let in s.lets)
            and not any(self._is_vague(s, state, cause) for state in s.states for cause in CAUSES)
        )

    @kept
    def steps(self, subsystem: Subsystem) -> tuple[Step, ...]:
        """The rows of a subsystem that may be taken, in the order of the file.

        Presence follows from them, so they are found without it.
        """
        return find_steps(subsystem, self.prover(subsystem).prove_rows)

    def _sure_steps(self, subsystem: Subsystem) -> tuple[Step, ...]:
        """The rows that may be taken whatever is unknown."""
        states = subsystem.states
        if any(self._is_vague(subsystem, s, cause) for s in states for cause in CAUSES):
            return self._views.steps(subsystem)
        return self.steps(subsystem)

    def reached(self, subsystem: Subsystem) -> frozenset[str]:
        """The states of a subsystem that it can enter; all of them where that is not known."""
        if not subsystem.begun or not self.ways_are_known(subsystem):
            return frozenset(state.name for state in subsystem.states)
        return reached_from(subsystem.initial_state, self.steps(subsystem))

    @kept
    def presence(self, subsystem: Subsystem) -> Presence:
        """Where the inputs of a subsystem surely have values."""
        arrivals = self.connections.arrivals(subsystem, self.broken, timed=not self.rates.clash)
        return find_presence(subsystem, self._sure_steps(subsystem), arrivals)

    @kept
    def readings(self, subsystem: Subsystem) -> Readings:
        """What the expressions of a subsystem read."""
        close = self.presence(subsystem).arrivals.close
        return Readings(subsystem, close)

    @cached_property
    def bindings(self) -> tuple[BoundElement, ...]:
        """The bindings of the plant whose device and element exist."""
        return tuple(bound_elements(self.system))

    @cached_property
    def rates(self) -> Rates:
        """Which rates fit together."""
        known = {s.qualified_name for s in self.system.subsystems} | self.connections.devices.keys()
        return Rates(self.system, self.subsystems, self.bindings, whole=self.broken <= known)

    @cached_property
    def model(self) -> Model | ModelError | None:
        """What the plant's model file declares, or why it cannot be read; None without one."""
        return plant_model(self.system)


def _used(subsystem: Subsystem) -> Iterable[Condition]:
    """The conditions that lead from state to state, each once."""
    behaviours = [state.behaviour for state in subsystem.states]
    every = [condition for b in behaviours for condition in (b.terminal, b.error)]
    every += [row.condition for row in subsystem.transitions]
    return {(condition.kind, condition.name): condition for condition in every}.values()


# What later passes may rely on.


class Proofs:
    """What the checks have established about a system without errors."""

    def __init__(self, facts: Facts) -> None:
        """`facts` are what it was established from."""
        self.facts = facts
        self._subsystems = {s.qualified_name: s for s in facts.subsystems}

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """Whether exactly one row of a state and cause applies whenever that cause occurs.

        `subsystem` is a qualified name; one with errors has nothing proved.
        """
        found = self._subsystems.get(subsystem)
        return found is not None and self.facts.verdict(found, state, cause).proved

    def present(self, subsystem: str, state: str) -> frozenset[InputName]:
        """Inputs that surely have a value in the conditions and the functions of a state."""
        found = self._subsystems.get(subsystem)
        return self.facts.presence(found).in_functions[state] if found else frozenset()
