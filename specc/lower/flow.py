"""The work cycle of a state as a tree, and what it evaluates in any case."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

from specc.lower.terms import NONE, Term, TermSet, TermTable, by_order, unevaluated
from specc.model.expr import Choice, Logic, MemoryRef, Quantifier, Truth
from specc.model.fsm import (
    Assignment,
    Behaviour,
    Cause,
    Condition,
    Function,
    Transition,
)
from specc.model.system import Subsystem
from specc.model.types import Type, Vector
from specc.reachable import grouped

# What must be evaluated in any case, and may therefore be computed early.
#
# A term behind a guard (a later operand of `and` and `or`, a branch of a choice, the body of a
# quantifier over a list) is not, unless both branches of a choice come to it. Neither is, in a
# condition, a term of the behaviour behind it: if it fails, the fault is one of the state entered.


def must_evaluate(terms: Iterable[Term], known: Collection[Term]) -> TermSet:
    """Terms worth keeping that an evaluation of all `terms` evaluates in any case.

    The values of the terms `known` are there already.
    """
    terms = tuple(terms)
    found = dict.fromkeys(known, NONE)
    for term in by_order(unevaluated(terms, known)):
        itself = frozenset({term}) if term.is_worth_local else NONE
        found[term] = itself | _must_evaluate_in(term, [found[arg] for arg in term.args])
    return NONE.union(*(found[term] for term in terms))


def _must_evaluate_in(term: Term, found: list[TermSet]) -> TermSet:
    match term.node:
        case Logic():
            return found[0]
        case Choice():
            return found[0] | (found[1] & found[2])
        case Quantifier():
            over = term.args[0].type
            never_empty = isinstance(over, Vector) and over.size > 0
            return found[0] | frozenset(t for t in found[1] if never_empty and not t.bound)
    return NONE.union(*found)


# The work cycle of a state as a tree: error condition, terminal condition, rows, behaviour.


class Proofs(Protocol):
    """What the checks found out about transition tables."""

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """Whether exactly one row of `state` and `cause` holds whenever that cause occurs."""


class _NothingProved:
    """Leaves every check in the code."""

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """See `Proofs`."""
        return False


NOTHING_PROVED: Proofs = _NothingProved()


@dataclass(frozen=True, eq=False, slots=True)
class Computation:
    """A value that a behaviour computes, and the function that asks for it."""

    function: Function
    assignment: Assignment
    value: Term


@dataclass(frozen=True, eq=False, slots=True)
class Activity:
    """What a behaviour computes: `computations` in their order, outputs before memory.

    All calls of a behaviour with parameters have one activity, that of the behaviour as declared.
    """

    behaviour: Behaviour
    computations: tuple[Computation, ...]

    must_evaluate: TermSet
    """Terms that it evaluates in any case."""
    parameters: tuple[Term, ...] = ()
    deferred: TermSet = NONE
    """Parameters that it may not need, and whose arguments may fail: it gets functions for them."""


@dataclass(eq=False, slots=True)
class BehaviourRun:
    """The behaviour of `target` runs once. `row` is the transition taken, -1 if the state stays."""

    activity: Activity
    target: str
    row: int = -1
    is_entry: bool = False
    """Whether the state is entered now, so that its clock starts."""
    is_same_state: bool = False
    """Whether it was already the state of the period before."""
    given: tuple[Term, ...] = ()
    """The values of the parameters that the behaviour declares."""
    arguments: tuple[Term, ...] = ()
    """Terms that the behaviour takes as further arguments."""
    sets: tuple[tuple[str, Term], ...] = ()
    """Memory of modes and the values that it gets before the behaviour runs."""
    updates: tuple[Computation, ...] = ()
    """What the state does for its modes after the behaviour has run."""

    @property
    def always_needed(self) -> tuple[Term, ...]:
        """Arguments that the behaviour needs in any case."""
        return tuple(term for term in self.arguments if term in self.activity.must_evaluate)

    def must_evaluate(self, _: Collection[Term]) -> TermSet:
        """No terms: nothing is evaluated before the state is entered."""
        return NONE

    def entries(self, before: TermSet = NONE) -> Iterator[tuple[BehaviourRun, TermSet]]:
        """All ways in which the period can end, and what may be evaluated on them."""
        yield self, before

    @property
    def evaluated_terms(self) -> tuple[Term, ...]:
        """What is evaluated, as often as it stands somewhere."""
        return *self.given, *self.arguments


@dataclass(frozen=True, eq=False, slots=True)
class FlowRow:
    """A row of the transition table, and what follows if its condition holds."""

    test: Term
    transition: Transition
    enter: BehaviourRun


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """The rows of one cause. Proved: the first that holds is taken. Otherwise all are tested, and
    it is a fault unless exactly one holds."""

    cause: Cause
    rows: tuple[FlowRow, ...]
    is_proved: bool

    @property
    def tested(self) -> tuple[FlowRow, ...]:
        """Rows that are tested: the last proved one only if some row compares rounded numbers."""
        if not self.is_proved:
            return self.rows
        *most, last = self.rows
        certain = isinstance(last.test.node, Truth)
        rounded = any(row.test.depends_on_rounding for row in self.rows)
        return self.rows if rounded and not certain else tuple(most)

    def must_evaluate(self, known: Collection[Term]) -> TermSet:
        """Terms that are evaluated in any case before a state is entered."""
        tested = self.tested[:1] if self.is_proved else self.rows
        return must_evaluate((row.test for row in tested), known)

    def entries(self, before: TermSet = NONE) -> Iterator[tuple[BehaviourRun, TermSet]]:
        """All ways in which the period can end, and what may be evaluated on them."""
        tests = [row.test.maybe_evaluated for row in self.tested]
        for index, row in enumerate(self.rows):
            tests_before = tests[: index + 1] if self.is_proved else tests
            yield row.enter, before.union(*tests_before)

    @property
    def evaluated_terms(self) -> tuple[Term, ...]:
        """What is evaluated, as often as it stands somewhere."""
        arguments = (term for row in self.rows for term in row.enter.evaluated_terms)
        return (*(row.test for row in self.tested), *arguments)


@dataclass(frozen=True, eq=False, slots=True)
class Check:
    """If `condition` holds, `rows` decide; otherwise the cycle goes on."""

    condition: Condition
    test: Term
    rows: Rows
    otherwise: Flow

    def must_evaluate(self, known: Collection[Term]) -> TermSet:
        """Terms that are evaluated in any case from here on, before a state is entered."""
        both = self.rows.must_evaluate(known) & self.otherwise.must_evaluate(known)
        return must_evaluate((self.test,), known) | both

    def entries(self, before: TermSet = NONE) -> Iterator[tuple[BehaviourRun, TermSet]]:
        """All ways in which the period can end, and what may be evaluated on them."""
        before |= self.test.maybe_evaluated
        yield from self.rows.entries(before)
        yield from self.otherwise.entries(before)

    @property
    def evaluated_terms(self) -> tuple[Term, ...]:
        """What is evaluated, as often as it stands somewhere."""
        return (self.test, *self.rows.evaluated_terms, *self.otherwise.evaluated_terms)


Flow = Check | Rows | BehaviourRun


class Flows:
    """Builds the work cycles of a subsystem."""

    def __init__(self, subsystem: Subsystem, table: TermTable, proofs: Proofs) -> None:
        self._subsystem = subsystem
        self._table = table
        self._proofs = proofs
        types = {("", item.name): item.type for item in subsystem.memory}
        types |= {key: element.type for key, element in subsystem.outputs.items()}
        self.activities: dict[str, Activity] = {}
        """By the names of behaviours; calls of one with parameters share one."""
        calls = grouped(
            ((b.generic.part if b.generic else b).name, b) for b in subsystem.behaviours
        )
        for same in calls.values():
            activity = _activity(same, table, types)
            self.activities |= {behaviour.name: activity for behaviour in same}

    def first_period(self) -> BehaviourRun:
        """Build the first period: the behaviour of the initial state, no conditions."""
        return self._enter(self._subsystem.initial_state, is_entry=True)

    def state_flow(self, state: str) -> Flow:
        """Build the work cycle of a state: error has priority over the terminal condition (2.4)."""
        behaviour = self._subsystem.state(state).behaviour
        return self._check(state, behaviour.endings)

    def _check(self, state: str, conditions: tuple[tuple[Cause, Condition], ...]) -> Flow:
        if not conditions:
            return self._enter(state, is_same_state=True)  # nothing ends the behaviour
        (cause, condition), *later = conditions
        test = self._table.of(condition.when)
        if not isinstance(test.node, Truth):
            otherwise = self._check(state, tuple(later))
            return Check(condition, test, self._rows(state, cause), otherwise)
        return self._rows(state, cause) if test.node.value else self._check(state, tuple(later))

    def _rows(self, state: str, cause: Cause) -> Rows:
        is_proved = self._proofs.is_proved(self._subsystem.qualified_name, state, cause)
        rows = []
        for index, transition in self._subsystem.rows(state, cause):
            test = self._table.of(transition.condition.when)
            same = transition.target == state
            enter = self._enter(transition.target, index, is_entry=True, is_same_state=same)
            rows.append(FlowRow(test, transition, enter))
        is_proved = is_proved or (len(rows) == 1 and rows[0].test is self._table.truth(True))
        if is_proved and rows and _is_complement(self._table, rows):
            rows[-1] = replace(rows[-1], test=self._table.truth(True))
        if is_proved:
            rows = _feasible_rows(rows)
        return Rows(cause, tuple(rows), is_proved and bool(rows))

    def _enter(
        self, state: str, row: int = -1, *, is_entry: bool = False, is_same_state: bool = False
    ) -> BehaviourRun:
        target = self._subsystem.state(state)
        sets = self._subsystem.transitions[row].sets if row >= 0 else ()
        own = target.for_modes
        return BehaviourRun(
            self.activities[target.behaviour.name],
            state,
            row,
            is_entry,
            is_same_state,
            self._table.arguments_of(target.behaviour),
            sets=tuple((name, self._table.of(value)) for name, value in sets),
            updates=tuple(
                Computation(own, item, self._table.of(item.value)) for item in own.assignments
            )
            if own
            else (),
        )


def _is_complement(table: TermTable, rows: list[FlowRow]) -> bool:
    """Whether the last row, by its form, says that none of the others holds."""
    *others, last = (row.test for row in rows)
    parts = (part for test in others for part in (test, *_operands(test, "or")))
    return set(map(table.negation, parts)).issuperset(_operands(last, "and"))


def _operands(term: Term, op: str) -> tuple[Term, ...]:
    return term.args if isinstance(term.node, Logic) and term.node.op == op else (term,)


def _feasible_rows(rows: list[FlowRow]) -> list[FlowRow]:
    """Proved rows without those that cannot hold here, up to the one that must."""
    feasible: list[FlowRow] = []
    for row in rows:
        if not isinstance(row.test.node, Truth):
            feasible.append(row)
        elif row.test.node.value:
            return [*feasible, row]
    return feasible


def _activity(
    calls: list[Behaviour], table: TermTable, types: dict[tuple[str, str], Type]
) -> Activity:
    """What one behaviour computes, or what all `calls` of one with parameters do."""
    behaviour, parameters = calls[0], table.parameters_of(calls[0])
    if behaviour.generic and isinstance(behaviour.generic.part, Behaviour):
        behaviour = behaviour.generic.part
    works = [
        Computation(function, item, table.of(item.value, types.get((item.peer, item.name))))
        for function in behaviour.functions
        for item in function.assignments
    ]
    needed = must_evaluate((work.value for work in works), ())
    in_sequence = tuple(sorted(works, key=lambda work: not work.assignment.peer))
    deferred = set[Term]()
    for parameter, *given in zip(parameters, *map(table.arguments_of, calls), strict=True):
        if parameter not in needed and not all(map(_cannot_fail, given)):
            deferred.add(parameter)
            # It is evaluated where the behaviour asks for it.
            parameter.memory = parameter.memory.union(*(argument.memory for argument in given))
    return Activity(behaviour, in_sequence, needed, parameters, frozenset(deferred))


def _cannot_fail(term: Term) -> bool:
    return term.is_invariant or isinstance(term.node, MemoryRef)
