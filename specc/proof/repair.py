"""Conditions that close a gap or end an overlap, in the words that the conditions use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from specc.model.expr import Among, Compare, Expr, Logic, Member, Unary
from specc.model.types import Bool
from specc.proof.cases import Cases
from specc.proof.formula import Atom
from specc.proof.table import Column, Table
from specc.proof.variables import Arrival, EnumItem

MOST_CASES = 4
"""Alternatives of a condition, beyond which the negation of the others is easier to read."""
_OPPOSITES = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
_BOOL = Bool()


@dataclass(frozen=True, slots=True)
class _Literal:
    """An answer as an expression, with the combinations in which it is given."""

    expr: Expr
    bits: int
    asked: bool


def condition_for(table: Table, cases: Cases, target: int, asked: frozenset[Atom]) -> Expr | None:
    """A condition that, in the cases that can be, holds in those of `target` and in no other.

    None if there is no such case or it takes more than `MOST_CASES` alternatives.

    Raises:
        UnsureError: it is not known which cases can be.
    """
    found: list[Expr] = []
    left = target
    while left := cases.some(left):
        if len(found) == MOST_CASES:
            return None
        case = _smallest(_literals(table, left, asked), table.full, cases.allowed & ~target)
        bits = table.full
        for literal in case:
            bits &= literal.bits
        left &= ~bits
        found.append(_joined("and", [literal.expr for literal in case]))
    return _joined("or", found) if found else None


def none_of(conditions: Sequence[Expr]) -> Expr:
    """The condition that none of some holds."""
    return _joined("and", [opposite(condition) for condition in conditions])


def only(condition: Expr, other: Expr) -> Expr:
    """The condition without what another one has in common with it."""
    return _joined("and", [condition, opposite(other)])


def opposite(condition: Expr) -> Expr:
    """The negation of a condition as one would write it."""
    match condition:
        case Unary(op="not", operand=operand):
            return operand
        case Compare(op=op, left=left, right=right):
            other = _OPPOSITES[op]
            return Compare(other, left, right, type=_BOOL)  # type: ignore[arg-type]  # one of six
    return Unary("not", condition, type=_BOOL)


def _smallest(literals: Sequence[_Literal], full: int, forbidden: int) -> list[_Literal]:
    """As few of the literals as keep all forbidden combinations out; those not asked go first."""
    kept = list(literals)
    for literal in sorted(literals, key=lambda item: item.asked):
        rest = [other for other in kept if other is not literal]
        bits = full
        for other in rest:
            bits &= other.bits
        if rest and not bits & forbidden:
            kept = rest
    return kept


def _literals(table: Table, left: int, asked: frozenset[Atom]) -> list[_Literal]:
    """What is answered in the first combination of `left`; whether something came goes first."""
    combination = (left & -left).bit_length() - 1
    answers = zip(table.columns, table.answers_at(combination), strict=True)
    found = sorted(answers, key=lambda item: not isinstance(item[0].variable, Arrival))
    return [literal for item in found for literal in _of(table, *item, asked)]


def _of(table: Table, column: Column, answer: int, asked: frozenset[Atom]) -> Iterator[_Literal]:
    answered = list(zip(column.atoms, column.answers[answer], strict=True))
    if isinstance(column.variable, EnumItem):
        expr = _among(column.variable, answered)
        is_asked = not asked.isdisjoint(column.atoms)
        yield _Literal(expr, table.where(column, answer), is_asked)
        return
    for atom, yes in answered:
        assert atom.expr is not None  # only atoms about members have none
        expr = atom.expr if yes == atom.text_holds else opposite(atom.expr)
        bits = table.bits_of(atom)
        yield _Literal(expr, bits if yes else table.full ^ bits, atom in asked)


def _among(item: EnumItem, answered: Sequence[tuple[Atom, bool]]) -> Expr:
    assert item.expr is not None  # the translator gives it
    members = [m for m in item.members if all((m in atom.test) == yes for atom, yes in answered)]
    if len(members) == 1:
        member = Member(members[0], type=item.expr.type)
        return Compare("==", item.expr, member, type=_BOOL)
    return Among(item.expr, frozenset(members), type=_BOOL)


def _joined(op: str, parts: Sequence[Expr]) -> Expr:
    if len(parts) == 1:
        return parts[0]
    return Logic(op, tuple(parts), type=_BOOL)  # type: ignore[arg-type]  # and, or
