"""What is known of one subsystem: each question about it is answered once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

from specc.analysis.definite_assignment import Availability, DefiniteAssignment, PresentValues
from specc.analysis.graph import RowEdge, find_edges, reachable_from
from specc.analysis.must_may import MustMayAnalysis, is_incomplete
from specc.analysis.reads import Dependences
from specc.analysis.state_timing import StateTiming
from specc.analysis.suspicious_expressions import SuspiciousExpressions
from specc.analysis.value_ranges import ValueRanges
from specc.model.expr import (
    Compare,
    Expr,
    Input,
    LetRef,
    MemoryRef,
    Number,
    Truth,
    children,
    has_unknown,
    negation,
)
from specc.model.fsm import Cause, Condition, State, mode_name
from specc.model.system import Constant, Subsystem
from specc.model.types import Bool, Enum
from specc.proof import InputName, Prover, RowVerdict, Witness
from specc.reachable import grouped


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
    def is_incomplete(self) -> bool:
        """Whether something about the rows is unknown."""
        return self.machine.is_incomplete(self.state, self.cause)

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
        return self.machine.must_may.overlap(state, self.cause, pair, present)


class Machine:
    """Facts about one subsystem: its states, conditions and expressions.

    They follow from the subsystem, the constants that it names and the availability of its inputs.
    """

    def __init__(
        self,
        subsystem: Subsystem,
        constants: Mapping[str, Constant],
        arrivals: Availability,
        *,
        faulty: bool = False,
    ) -> None:
        """`constants` that the subsystem names have values; they are in order of dependence.

        A `faulty` subsystem has unknowns in it; its facts hold whatever they are.
        """
        self.subsystem = subsystem
        self.availability = arrivals
        self.faulty = faulty
        self._constants = constants
        self._constant_values: dict[int, bool | None] = {}

    # What it is made of.

    @cached_property
    def prover(self) -> Prover:
        """Proofs about conditions."""
        return self._new_prover(self.subsystem)

    @cached_property
    def generic_prover(self) -> Prover:
        """Proofs that hold for all parameters of the subsystem."""
        if not self.subsystem.constants:
            return self.prover
        return self._new_prover(replace(self.subsystem, constants=()))

    @cached_property
    def value_ranges(self) -> ValueRanges:
        """The ranges of memory, for all parameters of the subsystem."""
        return ValueRanges(self.subsystem, self.generic_prover.numbering)

    @cached_property
    def invariants(self) -> tuple[Expr, ...]:
        """Invariants of memory, with the parameters that the subsystem is given."""
        if not self.subsystem.constants:
            return self.value_ranges.invariants
        return ValueRanges(self.subsystem, self.prover.numbering).invariants

    def _times_of_modes(self, state: str) -> Iterator[Expr]:
        """What conditions of a state know of modes.

        A period has passed in those around it, and none is in the first period after its entry.
        """
        lets = {let.name: let.value.type for let in self.subsystem.lets}
        for name in (mode_name("elapsed", mode) for mode in self.subsystem.state(state).modes):
            if name in lets:
                period = Number(float(1 / self.subsystem.rate_hz), type=lets[name])
                yield Compare(">=", LetRef(name, type=lets[name]), period, type=Bool())
        memory = {item.name for item in self.subsystem.memory}
        for name in (mode_name("entered", mode.name) for mode in self.subsystem.modes):
            if name in memory:
                yield negation(MemoryRef(name, type=Bool()))

    def _new_prover(self, subsystem: Subsystem) -> Prover:
        given = {constant.name for constant in self.subsystem.constants}
        known = {name: c for name, c in self._constants.items() if name not in given}
        values = {name: constant.value for name, constant in known.items()}
        return Prover(subsystem, values, self.availability.declared)

    @cached_property
    def must_may(self) -> MustMayAnalysis:
        """Verdicts that hold whatever is unknown."""
        return MustMayAnalysis(self.subsystem, self._new_prover)

    @cached_property
    def suspicious(self) -> SuspiciousExpressions:
        """The search for expressions that are well typed and probably not meant."""
        numbering = self.prover.numbering
        return SuspiciousExpressions(self.subsystem, self._constants, self.dependences, numbering)

    @cached_property
    def dependences(self) -> Dependences:
        """The dependences of expressions."""
        return Dependences({let.name: let.value for let in self.subsystem.lets})

    def reactions(self, exprs: Iterable[Expr], key: InputName) -> frozenset[str]:
        """The members of an input's enum to which some expressions react.

        They react if the member may change the value of one of them. An expression that reads the
        input other than in a condition reacts to all members.
        """
        type_ = self.subsystem.inputs[key].type
        if not isinstance(type_, Enum):
            return frozenset()
        parts = [part for expr in exprs for part in self._conditions_on(expr, key)]
        if not all(isinstance(part.type, Bool) for part in parts):
            return frozenset(type_.members)
        element, reacts = Input(*key, type=type_), self.prover.reacts
        return frozenset(m for m in type_.members if any(reacts(p, element, m) for p in parts))

    def _conditions_on(self, expr: Expr, key: InputName) -> Iterator[Expr]:
        """The conditions in an expression that depend on an input, and the input outside of any."""
        if key not in self.dependences.of(expr).inputs:
            return
        if isinstance(expr.type, Bool) or isinstance(expr, Input):
            yield expr
        else:
            value = self.prover.numbering.resolve(expr)
            for part in children(expr) if value is expr else (value,):
                yield from self._conditions_on(part, key)

    @cached_property
    def dwell_times(self) -> StateTiming:
        """The timing of states, if there are no unknowns."""
        return StateTiming(self.subsystem, self.prover, self.dependences, self.verdict)

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
    def is_complete(self) -> bool:
        """Whether it is finished and has no unknowns."""
        return not self.faulty and self.is_finished

    @cached_property
    def has_known_conditions(self) -> bool:
        """Whether it is consistent, without unknowns in its conditions and lets."""
        unknown = self._has_unknown_rows or any(
            has_unknown(let.value) for let in self.subsystem.lets
        )
        return self.is_consistent and not unknown

    def is_incomplete(self, state: State, cause: Cause) -> bool:
        """Whether something about the rows of a state and cause is unknown."""
        return self.faulty and is_incomplete(self.subsystem, state, cause)

    @cached_property
    def _has_unknown_rows(self) -> bool:
        return any(
            self.is_incomplete(s, cause)
            for s in self.subsystem.states
            for cause in s.behaviour.causes
        )

    # What is decided about its rows.

    @cached_property
    def row_verdicts(self) -> tuple[RowVerdictAt, ...]:
        """The verdicts about every state and cause.

        Where conditions are unknown, the verdicts hold whatever these are.
        """
        found = []
        for state in self.subsystem.states:
            for cause in state.behaviour.causes:
                if self.is_incomplete(state, cause):
                    present = self.presence.in_conditions(state.name)
                    verdict = self.must_may.verdict(state.name, cause, present)
                else:
                    verdict = self.verdict(state.name, cause)
                if verdict is not None:
                    found.append(RowVerdictAt(self, state, cause, verdict))
        return tuple(found)

    def verdict(self, state: str, cause: Cause) -> RowVerdict:
        """The verdict about the rows of a state and cause, with what is known of presence.

        What peers always send, and invariants of memory, make rows complete, but none superfluous.
        """
        verdict, fresh = self._verdicts_without_presence[state, cause], self.availability.fresh
        prove = partial(self.prover.prove_rows, state, cause)
        if verdict.arrivals:
            prove = partial(prove, present=self.presence.in_conditions(state))
            verdict = prove()
            if fresh and not verdict.proved:
                verdict = verdict.where_fresh(prove(fresh=fresh).decision, fresh)
        if not verdict.proved:
            facts = (*self.invariants, *self._times_of_modes(state))
            invariants = self.prover.related_facts(state, cause, facts)
            if invariants:
                known = prove(fresh=fresh, invariants=invariants)
                verdict = verdict.refuted_by(known.decision)
        return verdict

    @cached_property
    def _verdicts_without_presence(self) -> dict[tuple[str, Cause], RowVerdict]:
        """The verdicts without presence, which follows from them."""
        states = self.subsystem.states
        every = ((state.name, cause) for state in states for cause in state.behaviour.causes)
        return {each: self.prover.prove_rows(*each) for each in every}

    @cached_property
    def dead_ends(self) -> tuple[State, ...]:
        """States that may end although the table has no row at all for them."""
        sources = {row.source for row in self.subsystem.transitions}
        return tuple(
            state
            for state in self.subsystem.states
            if state.name not in sources
            and any(
                self._verdicts_without_presence[state.name, cause].decision.possible
                for cause in state.behaviour.causes
            )
        )

    # Where it gets to.

    @cached_property
    def edges(self) -> tuple[RowEdge, ...]:
        """The rows that may be taken, in the order of the file."""
        return find_edges(self.subsystem, self._verdicts_without_presence.values())

    @cached_property
    def successors(self) -> dict[str, list[RowEdge]]:
        """The edges by the state that they leave."""
        return grouped((step.row.source, step) for step in self.edges)

    @cached_property
    def reachable_states(self) -> frozenset[str]:
        """The states that it can enter; all of them if the edges are unknown."""
        if not self.subsystem.has_initial_state or not self.has_known_edges:
            return frozenset(state.name for state in self.subsystem.states)
        # The first row that enters a state is none that goes back to it.
        leaving = grouped((s.row.source, s) for s in self.edges if not s.row.is_return)
        return reachable_from(self.subsystem.initial_state, leaving)

    def is_on_cycle(self, state: str) -> bool:
        """Whether a path leads from a state back to it."""
        targets = (edge.row.target for edge in self.successors.get(state, ()))
        return any(state in reachable_from(target, self.successors) for target in targets)

    @cached_property
    def has_known_edges(self) -> bool:
        """Whether no row is missing and no condition has one value by mistake.

        In a table that has to be repaired, reachability is unknown.
        """
        return self.conditions_vary and not any(
            decided.verdict.decision.gap or decided.lacks_rows for decided in self.row_verdicts
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

        A literal `True` or `False` is intended, and so is what the values of parameters decide.
        """
        key = id(condition.when)
        if key not in self._constant_values:
            named = self.dependences.of(condition.when).constants
            is_given = any(constant.name in named for constant in self.subsystem.constants)
            prover = self.generic_prover if is_given else self.prover
            is_intended = isinstance(condition.when, Truth)
            value = None if is_intended else prover.constant(condition.when, assuming=not is_given)
            self._constant_values[key] = value
        return self._constant_values[key]

    # What must hold in its states.

    @cached_property
    def presence(self) -> DefiniteAssignment:
        """The inputs that surely have a value, by state."""
        steps = self.must_may.edges() if self._has_unknown_rows else self.edges
        return DefiniteAssignment(self.subsystem, steps, self.availability)

    @cached_property
    def present_values(self) -> PresentValues:
        """Optional values and lists that surely have a value or item, if conditions are known."""
        rows = [step.row for step in self.edges]
        return PresentValues(self.subsystem, rows, self.prover, self.dependences)
