"""What is known of one subsystem: each question about it is answered once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, TypeVar

from specc.analysis.arrivals import Arrivals
from specc.analysis.durations import Durations
from specc.analysis.graph import CAUSES, RowEdge, find_steps, reached_from
from specc.analysis.memory import ValueRanges
from specc.analysis.presence import DefiniteAssignment, PresentValues
from specc.analysis.reactions import Reactions
from specc.analysis.reads import Dependences
from specc.analysis.suspicious_expressions import SuspiciousExpressions
from specc.analysis.unknown_parts import MustMayAnalysis, is_vague
from specc.model.expr import Expr, Truth, has_unknown
from specc.model.fsm import Cause, Condition, State
from specc.model.system import Constant, Subsystem
from specc.proof import Prover, RowVerdict, Witness
from specc.reachable import grouped

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class RowVerdictAt:
    """The verdict about the rows of one state and cause."""

    machine: Machine
    state: State
    cause: Cause
    verdict: RowVerdict

    @property
    def subsystem(self) -> Subsystem:
        """The subsystem of the state."""
        return self.machine.subsystem

    @property
    def is_vague(self) -> bool:
        """Whether something about the rows is unknown."""
        return self.machine.is_vague(self.state, self.cause)

    @property
    def lacks_rows(self) -> bool:
        """Whether the cause can occur before the state is over, and has no row."""
        if self.verdict.rows or not self.verdict.decision.possible:
            return False
        known = not self.machine.faulty and not self.machine.dead_ends
        return not (known and self.machine.dwell_times.never_ends(self.state, self.cause))

    def overlap(self, pair: tuple[int, int]) -> Witness | None:
        """Where two of the rows surely apply together, by their indices."""
        state = self.state.name
        present = self.machine.presence.in_conditions(state)
        return self.machine.views.overlap(state, self.cause, pair, present)


class Machine:
    """Answers about a subsystem, in terms of its states, conditions and expressions.

    They follow from the subsystem, the constants that it names and what its connections say of its
    inputs. As long as these are equal the answers stay, whatever else changes in the system.
    """

    def __init__(
        self,
        subsystem: Subsystem,
        constants: Mapping[str, Constant],
        arrivals: Arrivals,
        *,
        faulty: bool = False,
    ) -> None:
        """`constants` that the subsystem names have values; they are in order of dependence.

        A `faulty` subsystem has unknowns in it; what is said of it holds whatever they are.
        """
        self.subsystem = subsystem
        self.arrivals = arrivals
        self.faulty = faulty
        self._constants = constants
        self._settled: dict[int, bool | None] = {}
        self._told: dict[Callable[[Machine], Iterable[Any]], tuple[Any, ...]] = {}

    def results_of(self, check: Callable[[Machine], Iterable[T]]) -> tuple[T, ...]:
        """What a check finds that asks nothing but this machine."""
        if check not in self._told:
            self._told[check] = tuple(check(self))
        return self._told[check]

    # What it is made of.

    @cached_property
    def prover(self) -> Prover:
        """Answers about conditions."""
        return self._new_prover(self.subsystem)

    @cached_property
    def any_prover(self) -> Prover:
        """Answers that hold whatever the parameters of the subsystem are."""
        if not self.subsystem.constants:
            return self.prover
        return self._new_prover(replace(self.subsystem, constants=()))

    @cached_property
    def memory_facts(self) -> ValueRanges:
        """What is known of memory, whatever the parameters of the subsystem are."""
        return ValueRanges(self.subsystem, self.any_prover.numbering)

    @cached_property
    def invariants(self) -> tuple[Expr, ...]:
        """What always holds of memory, with the parameters that the subsystem is given."""
        if not self.subsystem.constants:
            return self.memory_facts.invariants
        return ValueRanges(self.subsystem, self.prover.numbering).invariants

    def _new_prover(self, subsystem: Subsystem) -> Prover:
        given = {constant.name for constant in self.subsystem.constants}
        known = {name: c for name, c in self._constants.items() if name not in given}
        values = {name: constant.value for name, constant in known.items()}
        return Prover(subsystem, values, self.arrivals.declared)

    @cached_property
    def views(self) -> MustMayAnalysis:
        """What is certain where something is unknown."""
        return MustMayAnalysis(self.subsystem, self._new_prover)

    @cached_property
    def suspicious(self) -> SuspiciousExpressions:
        """What cannot be meant in expressions."""
        numbering = self.prover.numbering
        return SuspiciousExpressions(self.subsystem, self._constants, self.dependences, numbering)

    @cached_property
    def dependences(self) -> Dependences:
        """What expressions depend on."""
        return Dependences({let.name: let.value for let in self.subsystem.lets})

    @cached_property
    def reactions(self) -> Reactions:
        """To which members of the enums of inputs it reacts."""
        return Reactions(self.subsystem, self.prover, self.dependences)

    @cached_property
    def dwell_times(self) -> Durations:
        """How long states can last, if there are no unknowns."""
        return Durations(self.subsystem, self.prover, self.dependences, self.verdict)

    # How much can be asked of it.

    @cached_property
    def is_consistent(self) -> bool:
        """Whether its axioms do not contradict each other."""
        return not self.prover.contradiction()

    @cached_property
    def is_finished(self) -> bool:
        """Whether it is consistent, with rows for all states that end."""
        return self.is_consistent and not self.dead_ends

    @property
    def is_whole(self) -> bool:
        """Whether it is finished and has no unknowns."""
        return not self.faulty and self.is_finished

    @cached_property
    def is_legible(self) -> bool:
        """Whether it is consistent, with nothing unknown in what leads from state to state."""
        unknown = self._is_vague or any(has_unknown(let.value) for let in self.subsystem.lets)
        return self.is_consistent and not unknown

    def is_vague(self, state: State, cause: Cause) -> bool:
        """Whether something about the rows of a state and cause is unknown."""
        return self.faulty and is_vague(self.subsystem, state, cause)

    @cached_property
    def _is_vague(self) -> bool:
        return any(self.is_vague(s, cause) for s in self.subsystem.states for cause in CAUSES)

    # What is decided about its rows.

    @cached_property
    def decided(self) -> tuple[RowVerdictAt, ...]:
        """The verdicts about every state and cause.

        Where conditions are unknown, what they say holds whatever these are.
        """
        every = ((state, cause) for state in self.subsystem.states for cause in CAUSES)
        found = ((state, cause, self._certain(state, cause)) for state, cause in every)
        return tuple([RowVerdictAt(self, s, cause, v) for s, cause, v in found if v is not None])

    def _certain(self, state: State, cause: Cause) -> RowVerdict | None:
        """The verdict that does not depend on anything unknown; None if there is none."""
        if not self.is_vague(state, cause):
            return self.verdict(state.name, cause)
        present = self.presence.in_conditions(state.name)
        return self.views.verdict(state.name, cause, present)

    def verdict(self, state: str, cause: Cause) -> RowVerdict:
        """The verdict about the rows of a state and cause, with what is known of presence.

        What peers always send, and what always holds of memory, makes rows complete, but none
        superfluous.
        """
        verdict, fresh = self._alone[state, cause], self.arrivals.fresh
        prove = partial(self.prover.prove_rows, state, cause)
        if verdict.arrivals:
            prove = partial(prove, present=self.presence.in_conditions(state))
            verdict = prove()
            if fresh and not verdict.proved:
                verdict = verdict.where_fresh(prove(fresh=fresh).decision, fresh)
        if not verdict.proved:
            invariants = self.prover.related_facts(state, cause, self.invariants)
            if invariants:
                known = prove(fresh=fresh, invariants=invariants)
                verdict = verdict.refuted_by(known.decision)
        return verdict

    @cached_property
    def _alone(self) -> dict[tuple[str, Cause], RowVerdict]:
        """The verdicts without presence, which follows from them."""
        every = ((state.name, cause) for state in self.subsystem.states for cause in CAUSES)
        return {each: self.prover.prove_rows(*each) for each in every}

    @cached_property
    def dead_ends(self) -> tuple[State, ...]:
        """States that may end although the table has no row at all for them."""
        sources = {row.source for row in self.subsystem.transitions}
        return tuple(
            state
            for state in self.subsystem.states
            if state.name not in sources
            and any(self._alone[state.name, cause].decision.possible for cause in CAUSES)
        )

    # Where it gets to.

    @cached_property
    def steps(self) -> tuple[RowEdge, ...]:
        """The rows that may be taken, in the order of the file."""
        return find_steps(self.subsystem, self._alone.values())

    @cached_property
    def leaving(self) -> dict[str, list[RowEdge]]:
        """The steps by the state that they leave."""
        return grouped((step.row.source, step) for step in self.steps)

    @cached_property
    def reached(self) -> frozenset[str]:
        """The states that it can enter; all of them where that is not known."""
        if not self.subsystem.begun or not self.ways_are_known:
            return frozenset(state.name for state in self.subsystem.states)
        return reached_from(self.subsystem.initial_state, self.leaving)

    @cached_property
    def ways_are_known(self) -> bool:
        """Whether no row is missing and no condition has one value by mistake.

        If the table needs a repair anyway, it is not known yet which states can be reached.
        """
        return self.conditions_vary and not any(
            decided.verdict.decision.gap or decided.lacks_rows for decided in self.decided
        )

    @cached_property
    def conditions_vary(self) -> bool:
        """Whether no condition has one value by mistake."""
        named = {
            (condition.kind, condition.name): condition
            for condition in self.subsystem.exit_conditions
        }
        return all(self.constant_value(condition) is None for condition in named.values())

    def constant_value(self, condition: Condition) -> bool | None:
        """The constant truth value of a condition that should change; None if it can change.

        A literal `True` or `False` is intended, and what is given to parameters may well decide it.
        """
        key = id(condition.when)
        if key not in self._settled:
            named = self.dependences.of(condition.when).constants
            is_given = any(constant.name in named for constant in self.subsystem.constants)
            prover = self.any_prover if is_given else self.prover
            meant = isinstance(condition.when, Truth)
            value = None if meant else prover.constant(condition.when, assuming=not is_given)
            self._settled[key] = value
        return self._settled[key]

    # What must hold in its states.

    @cached_property
    def presence(self) -> DefiniteAssignment:
        """Where inputs surely have values."""
        steps = self.views.steps() if self._is_vague else self.steps
        return DefiniteAssignment(self.subsystem, steps, self.arrivals)

    @cached_property
    def values(self) -> PresentValues:
        """Where optional values and lists surely have something in them, if it is legible."""
        rows = [step.row for step in self.steps]
        return PresentValues(self.subsystem, rows, self.prover, self.dependences)
