"""The work cycle of a state as a tree, and what it evaluates in any case."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

from specc.lower.terms import NONE, Term, Terms, TermTable, Visits, in_order
from specc.model import expr as e
from specc.model.expr import Logic, Truth
from specc.model.fsm import Assignment, Behaviour, Cause, Condition, Function, Transition
from specc.model.system import Subsystem
from specc.model.types import Type, Vector

# What is evaluated in any case: what may be computed early, because it will be needed anyway.
#
# A term behind a guard (a later operand of `and` and `or`, a branch of a choice, the body of a
# quantifier over a list) is not, unless all paths come to it.


class Certain:
    """Answers for terms worth keeping. The values of the terms `known` are there already."""

    def __init__(self, known: Terms = NONE) -> None:
        self._known = known
        self._found: dict[Term, Terms] = {}
        self._tested: dict[tuple[Term, Terms, Terms], Terms] = {}
        self._visits = Visits()

    def of(self, *terms: Term) -> Terms:
        """Terms that an evaluation of all `terms` evaluates in any case, themselves among them."""
        for term in in_order(self._missing(terms)):
            itself = frozenset({term}) if term.is_kept else NONE
            self._found[term] = itself | self._operands(term)
        return NONE.union(*map(self._get, terms))

    def before(self, term: Term, if_true: Terms, if_false: Terms) -> Terms:
        """Terms evaluated in any case when `term` is tested and one of two things follows.

        `if_true` and `if_false` are evaluated in any case after the test came out that way.
        """
        self.of(term)
        return self._before(term, if_true, if_false)

    def _missing(self, terms: tuple[Term, ...]) -> set[Term]:
        missing: set[Term] = set()
        pending = list(terms)
        while pending:
            term = pending.pop()
            if term not in self._known and term not in self._found and term not in missing:
                missing.add(term)
                pending.extend(term.args)
        return missing

    def _get(self, term: Term) -> Terms:
        return NONE if term in self._known else self._found[term]

    def _before(self, term: Term, if_true: Terms, if_false: Terms) -> Terms:
        if term in self._known:
            return if_true & if_false
        case = (term, if_true, if_false)
        if case not in self._tested:
            self._visits.add()
            self._tested[case] = self._before_test(*case)
        return self._tested[case]

    def _before_test(self, term: Term, if_true: Terms, if_false: Terms) -> Terms:
        itself = frozenset({term}) if term.is_kept else NONE
        match term.node:
            case e.Truth(value=value):
                return if_true if value else if_false
            case e.Unary(op="not"):
                return itself | self._before(term.args[0], if_false, if_true)
            case e.Logic(op=op):
                for operand in reversed(term.args):
                    outcome = self._before(operand, if_true, if_false)
                    if_true, if_false = (outcome, if_false) if op == "and" else (if_true, outcome)
                return itself | outcome
            case e.Choice():
                test, then, otherwise = term.args
                after_then = self._before(then, if_true, if_false)
                after_else = self._before(otherwise, if_true, if_false)
                return itself | self._before(test, after_then, after_else)
        return self._get(term) | (if_true & if_false)

    def _operands(self, term: Term) -> Terms:
        match term.node:
            case e.Logic(op=op):
                after = NONE
                for operand in reversed(term.args):
                    outcomes = (after, NONE) if op == "and" else (NONE, after)
                    after = self._before(operand, *outcomes)
                return after
            case e.Choice():
                test, then, otherwise = term.args
                return self._before(test, self._get(then), self._get(otherwise))
            case e.Quantifier():
                over, body = term.args
                never_empty = isinstance(over.type, Vector) and over.type.size > 0
                inside = (t for t in self._get(body) if not t.bound)
                return self._get(over) | (frozenset(inside) if never_empty else NONE)
        return NONE.union(*map(self._get, term.args))


# The work cycle of a state as a tree: error condition, terminal condition, rows, behaviour.


class Proofs(Protocol):
    """What the checks found out about transition tables."""

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """Whether exactly one row of `state` and `cause` holds whenever that cause occurs."""


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """A value that a behaviour computes, and the function that asks for it."""

    function: Function
    assignment: Assignment
    value: Term


@dataclass(frozen=True, slots=True, eq=False)
class Activity:
    """What a behaviour computes: `works` in order of execution, outputs before memory."""

    behaviour: Behaviour
    works: tuple[Work, ...]

    surely: Terms
    """Terms that it evaluates in any case."""


@dataclass(slots=True, eq=False)
class Enter:
    """The behaviour of `target` runs once. `row` is the transition taken, -1 if the state stays."""

    activity: Activity
    target: str
    row: int = -1
    is_entry: bool = False
    """Whether the state is entered now, so that its clock starts."""
    is_same_state: bool = False
    """Whether it was already the state of the period before."""
    taken: tuple[Term, ...] = ()
    """Terms that the behaviour takes as arguments."""

    @property
    def needed(self) -> tuple[Term, ...]:
        """Arguments that the behaviour needs in any case and that have their value already."""
        fixed = (t for t in self.taken if not (self.is_entry and t.reads_clock))
        return tuple(t for t in fixed if t in self.activity.surely)

    def surely(self, certain: Certain) -> Terms:
        """Terms that are evaluated in any case before the behaviour runs."""
        return certain.of(*self.needed)


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """A row of the transition table, and what follows if its condition holds."""

    test: Term
    transition: Transition
    enter: Enter


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The rows of one cause. Proved: the first that holds is taken. Otherwise all are tested, and
    it is a fault unless exactly one holds."""

    cause: Cause
    rows: tuple[Row, ...]
    is_proved: bool

    @property
    def tested(self) -> tuple[Row, ...]:
        """Proved rows that are tested: the last one only if some row compares rounded numbers."""
        *most, last = self.rows
        certain = isinstance(last.test.node, Truth)
        rounded = any(row.test.rests_on_rounding for row in self.rows)
        return self.rows if rounded and not certain else tuple(most)

    def surely(self, certain: Certain) -> Terms:
        """Terms that are evaluated in any case from here on; a fault evaluates nothing more."""
        if not self.is_proved:
            return certain.of(*(row.test for row in self.rows))
        return self.surely_from(certain)[0]

    def surely_from(self, certain: Certain) -> list[Terms]:
        """For every row of a proved cause, what is evaluated in any case once it is its turn."""
        last = self.rows[-1]
        after = last.enter.surely(certain)
        if last in self.tested:
            after = certain.before(last.test, after, after)
        found = [after]
        for row in reversed(self.rows[:-1]):
            after = certain.before(row.test, row.enter.surely(certain), after)
            found.append(after)
        return found[::-1]

    @property
    def enters(self) -> Iterable[Enter]:
        """All ways in which the period can end."""
        return (row.enter for row in self.rows)


@dataclass(frozen=True, slots=True, eq=False)
class Check:
    """If `condition` holds, the rows of `cause` decide; otherwise the cycle goes on."""

    condition: Condition
    test: Term
    rows: Rows
    otherwise: Flow

    def surely(self, certain: Certain) -> Terms:
        """Terms that are evaluated in any case from here on."""
        otherwise = self.otherwise.surely(certain)
        return certain.before(self.test, self.rows.surely(certain), otherwise)

    @property
    def enters(self) -> Iterable[Enter]:
        """All ways in which the period can end."""
        return (*self.rows.enters, *self.otherwise.enters)


@dataclass(frozen=True, slots=True, eq=False)
class Stay:
    """No condition ends the behaviour."""

    enter: Enter

    def surely(self, certain: Certain) -> Terms:
        """Terms that are evaluated in any case from here on."""
        return self.enter.surely(certain)

    @property
    def enters(self) -> Iterable[Enter]:
        """All ways in which the period can end."""
        return (self.enter,)


Flow = Check | Rows | Stay


class Flows:
    """Builds the work cycles of a subsystem."""

    def __init__(self, subsystem: Subsystem, table: TermTable, proofs: Proofs) -> None:
        self._subsystem = subsystem
        self._table = table
        self._proofs = proofs
        types = _target_types(subsystem)
        self.activities = {b.name: _activity(b, table, types) for b in subsystem.behaviours}

    def first(self) -> Enter:
        """The first period: the behaviour of the initial state, no conditions."""
        return self._enter(self._subsystem.initial_state, is_entry=True)

    def of_state(self, state: str) -> Flow:
        """The work cycle of a state: error has priority over the terminal condition (2.4)."""
        behaviour = self._subsystem.state(state).behaviour
        return self._check(state, _conditions(behaviour))

    def _check(self, state: str, conditions: tuple[tuple[Cause, Condition], ...]) -> Flow:
        if not conditions:
            return Stay(self._enter(state, is_same_state=True))
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
            rows.append(Row(test, transition, enter))
        is_proved = is_proved or (len(rows) == 1 and rows[0].test is self._table.truth(True))
        if is_proved and rows and _is_rest(self._table, rows):
            rows[-1] = replace(rows[-1], test=self._table.truth(True))
        if is_proved:
            rows = _possible(rows)
        return Rows(cause, tuple(rows), is_proved and bool(rows))

    def _enter(
        self, state: str, row: int = -1, *, is_entry: bool = False, is_same_state: bool = False
    ) -> Enter:
        behaviour = self._subsystem.state(state).behaviour
        return Enter(self.activities[behaviour.name], state, row, is_entry, is_same_state)


def _is_rest(table: TermTable, rows: list[Row]) -> bool:
    """Whether the last row, by its form, says that none of the others holds."""
    *others, last = (row.test for row in rows)
    parts = (part for test in others for part in (test, *_operands(test, "or")))
    return set(map(table.negation, parts)).issuperset(_operands(last, "and"))


def _operands(term: Term, op: str) -> tuple[Term, ...]:
    return term.args if isinstance(term.node, Logic) and term.node.op == op else (term,)


def _possible(rows: list[Row]) -> list[Row]:
    """Proved rows without those that cannot hold here, up to the one that must."""
    kept: list[Row] = []
    for row in rows:
        if not isinstance(row.test.node, Truth):
            kept.append(row)
        elif row.test.node.value:
            return [*kept, row]
    return kept


def _conditions(behaviour: Behaviour) -> tuple[tuple[Cause, Condition], ...]:
    return ("error", behaviour.error), ("terminal", behaviour.terminal)


def _target_types(subsystem: Subsystem) -> dict[tuple[str, str], Type]:
    """The type of every output element and, with the peer "", of every memory element."""
    types = {("", item.name): item.type for item in subsystem.memory}
    for port in subsystem.ports:
        if port.direction == "y":
            types |= {(port.peer, element.name): element.type for element in port.elements}
    return types


def _activity(
    behaviour: Behaviour, table: TermTable, types: dict[tuple[str, str], Type]
) -> Activity:
    works = [
        Work(function, item, table.of(item.value, types.get((item.peer, item.name))))
        for function in behaviour.functions
        for item in function.assignments
    ]
    surely = Certain().of(*(work.value for work in works))
    in_sequence = tuple(sorted(works, key=lambda work: not work.assignment.peer))
    return Activity(behaviour, in_sequence, surely)
