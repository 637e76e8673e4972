"""Decides on truth tables whether exactly one of several conditions holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from specc.proof.formula import Formula, atoms_of
from specc.proof.relevance import components, conjuncts, has_related_sums, related, variables_of
from specc.proof.repair import condition_for
from specc.proof.table import Table, TooLargeError
from specc.proof.variables import Arrival
from specc.proof.verdict import Decision, InputName, Witness
from specc.proof.witness import describe

Solve = Callable[[Sequence[Formula], Sequence[Formula]], Decision | None]
"""Decides about conditions where formulas are assumed; None if it cannot."""


class Question:
    """Whether exactly one of `conditions` holds whenever the context and the axioms do."""

    def __init__(
        self,
        conditions: Sequence[Formula],
        context: Sequence[Formula],
        axioms: Sequence[Formula],
        solve: Solve,
    ) -> None:
        """`solve` is asked what the tables do not settle."""
        self._solve = solve
        self._conditions = conditions
        given = conjuncts(context)
        self._assumed = given + related(conjuncts(axioms), [*conditions, *given])
        self.arrivals = frozenset(
            (variable.peer, variable.element)
            for variable in variables_of([*conditions, *self._assumed])
            if isinstance(variable, Arrival) and not variable.always_present
        )
        """Inputs about whose arrival something is asked."""

    def decide(self, facts: Sequence[Formula]) -> Decision:
        """The answer where the facts hold as well."""
        assumed = [*self._assumed, *facts]
        try:
            decision = _decision(self._conditions, assumed)
            if decision.proved or not has_related_sums([*self._conditions, *assumed]):
                return decision
            return self._solve(self._conditions, assumed) or decision
        except TooLargeError as error:
            reason = str(error)
        # What the context says of other things cannot help a proof, but makes the table larger.
        try:
            smaller = _decision(self._conditions, related(assumed, self._conditions))
        except TooLargeError:
            smaller = None
        if smaller is not None and smaller.proved:
            return smaller
        solved = self._solve(self._conditions, assumed)
        if solved is not None:
            return solved
        return Decision(
            unknown=reason,
            satisfiable=(True,) * len(self._conditions),
            ensures=(frozenset(),) * len(self._conditions),
        )


def can_hold(formulas: Sequence[Formula]) -> bool | None:
    """Whether all formulas can hold together; None if the question is too large."""
    answer: bool | None = True
    for group in components(conjuncts(formulas)):
        try:
            table = Table(group)
        except TooLargeError:
            answer = None
            continue
        if not _all(table, group):
            return False
    return answer


def _decision(conditions: Sequence[Formula], assumed: Sequence[Formula]) -> Decision:
    table = Table([*conditions, *assumed])
    context = _all(table, assumed)
    holding = [table.bits(condition) & context for condition in conditions]
    return Decision(
        possible=bool(context),
        gap=_gap(table, context, holding, conditions),
        overlap=_overlap(table, context, holding, conditions),
        satisfiable=tuple(map(bool, holding)),
        ensures=_ensured(table, holding),
    )


def _all(table: Table, formulas: Sequence[Formula]) -> int:
    bits = table.full
    for formula in formulas:
        bits &= table.bits(formula)
    return bits


def _gap(
    table: Table, context: int, holding: Sequence[int], conditions: Sequence[Formula]
) -> Witness | None:
    left = context
    for bits in holding:
        left &= ~bits
    if not left:
        return None
    asked = frozenset(atoms_of(conditions))
    repair = condition_for(table, left, context, asked)
    facts, answers = describe(table, left, context, asked)
    return Witness(facts, repair=repair, answers=answers)


def _overlap(
    table: Table, context: int, holding: Sequence[int], conditions: Sequence[Formula]
) -> Witness | None:
    """The first two conditions that can hold together."""
    seen = 0
    for index, bits in enumerate(holding):
        if bits & seen:
            first = next(i for i in range(index) if holding[i] & bits)
            asked = frozenset(atoms_of((conditions[first], conditions[index])))
            facts, answers = describe(table, bits & holding[first], context, asked)
            for one, other in ((index, first), (first, index)):
                if rest := holding[one] & ~holding[other]:
                    repair = condition_for(table, rest, context, asked)
                    return Witness(facts, (first, index), repair, one, answers)
            return Witness(facts, (first, index), answers=answers)
        seen |= bits
    return None


def _ensured(table: Table, holding: Sequence[int]) -> tuple[frozenset[InputName], ...]:
    """The inputs that cannot be absent where each condition holds."""
    absent: list[tuple[InputName, int]] = []
    for column in table.columns:
        if isinstance(column.variable, Arrival):
            without = [i for i, answers in enumerate(column.answers) if not any(answers)]
            name = column.variable.peer, column.variable.element
            absent.append((name, sum(table.where(column, i) for i in without)))
    return tuple(frozenset(name for name, bits in absent if not bits & holds) for holds in holding)
