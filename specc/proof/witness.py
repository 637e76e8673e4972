"""Describes situations that refute a table, and the condition that resolves an overlap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from specc.model.expr import Compare, Expr, IsOneOf, Member, junction, opposite
from specc.model.types import Bool
from specc.proof.formula import Arrival, Atom, EnumItem, Formula, Quantity, atoms_of
from specc.proof.table import Column, Table
from specc.proof.verdict import FactTexts, TruthAssignment, Witness

# Conditions that say where a fault is, or end an overlap, in the words that the conditions use.


MOST_CASES = 4
"""Alternatives of a condition, beyond which the negation of the others is easier to read."""
_BOOL = Bool()


@dataclass(frozen=True, slots=True)
class _Literal:
    """An answer as an expression, with the combinations in which it is given."""

    expr: Expr
    bits: int
    is_relevant: bool


def condition_for(
    table: Table, allowed: int, target: int, relevant_atoms: frozenset[Atom]
) -> Expr | None:
    """A condition that, in the cases `allowed`, holds in those of `target` and in no other.

    None if there is no such case or it takes more than `MOST_CASES` alternatives.
    """
    found: list[Expr] = []
    left = target
    while left := left & allowed:
        if len(found) == MOST_CASES:
            return None
        case = _minimise(
            list(_literals(table, left, relevant_atoms)), table.full, allowed & ~target
        )
        bits = table.full
        for literal in case:
            bits &= literal.bits
        left &= ~bits
        found.append(junction("and", [literal.expr for literal in case]))
    return junction("or", found) if found else None


def _minimise(literals: Sequence[_Literal], full: int, forbidden: int) -> list[_Literal]:
    """A minimal subset of the literals that excludes all forbidden combinations."""
    minimal = list(literals)
    for literal in sorted(literals, key=lambda item: item.is_relevant):
        rest = [other for other in minimal if other is not literal]
        bits = full
        for other in rest:
            bits &= other.bits
        if rest and not bits & forbidden:
            minimal = rest
    return minimal


def _literals(table: Table, left: int, relevant_atoms: frozenset[Atom]) -> Iterator[_Literal]:
    """What is answered in the first combination of `left`; whether something came goes first."""
    combination = (left & -left).bit_length() - 1
    answers = zip(table.columns, table.answers_at(combination), strict=True)
    for column, answer in sorted(answers, key=lambda i: not isinstance(i[0].variable, Arrival)):
        answered = list(zip(column.atoms, column.answers[answer], strict=True))
        if isinstance(item := column.variable, EnumItem):
            assert item.expr is not None  # the translator gives it
            members = _members(item, answered)
            expr: Expr = IsOneOf(item.expr, frozenset(members), type=_BOOL)
            if len(members) == 1:
                member = Member(members[0], type=item.expr.type)
                expr = Compare("==", item.expr, member, type=_BOOL)
            is_relevant = not relevant_atoms.isdisjoint(column.atoms)
            yield _Literal(expr, table.where(column, answer), is_relevant)
            continue
        for atom, yes in answered:
            assert atom.expr is not None  # only atoms about members have none
            expr = atom.expr if yes == atom.holds_if else opposite(atom.expr)
            yield _Literal(expr, table.where_answered([(atom, yes)]), atom in relevant_atoms)


# What is said about a fault: a situation that shows it, all that do, the repair of an overlap.


def gap_witness(
    table: Table,
    allowed: int,
    faults: int,
    conditions: Sequence[Formula],
    context: Sequence[Formula],
) -> Witness:
    """That none of the conditions holds in the combinations `faults`."""
    relevant_atoms = frozenset(atoms_of(conditions))
    return _witness(table, allowed, faults, faults, relevant_atoms, context)


def overlap_witness(
    table: Table,
    allowed: int,
    faults: int,
    conditions: Sequence[Formula],
    context: Sequence[Formula],
) -> Witness:
    """That several conditions hold in the combinations `faults`.

    The condition to narrow keeps the combinations in which no other one holds, so it stays
    distinct. If there are none, narrowing could only make two conditions equal. Of several it is
    the one that is left with the fewest faults, or the last of them.
    """
    rows = [table.bits(condition) & allowed for condition in conditions]
    relevant_atoms = frozenset(atoms_of(conditions))
    holding = [index for index, row in enumerate(rows) if row & faults]
    able = [index for index in holding if rows[index] & ~faults]
    first = max(able or holding, key=lambda index: ((rows[index] & faults).bit_count(), index))
    second = next(i for i, row in enumerate(rows) if i != first and row & rows[first])
    both = rows[first] & rows[second]
    found = _witness(table, allowed, both, faults, relevant_atoms, context)
    found = replace(found, holding=(min(first, second), max(first, second)))
    if not able:
        return found
    repair = condition_for(table, allowed, rows[first] & ~faults, relevant_atoms)
    return replace(found, repair=repair, repaired=first)


def _witness(
    table: Table,
    allowed: int,
    shown: int,
    faults: int,
    relevant_atoms: frozenset[Atom],
    context: Sequence[Formula],
) -> Witness:
    """A situation of `shown`, and what all `faults` have in common."""
    facts, answers, combinations = describe(table, shown, allowed, relevant_atoms)
    causes = _causes(table, combinations, context) if facts else {}
    facts += tuple(fact for item in causes.items() for fact in fact_texts(*item, relevant_atoms))
    answers += tuple(
        truth_value for item in causes.items() for truth_value in truth_assignment(*item)
    )
    found = Witness(facts, answers=answers)
    if not faults & ~combinations:
        return found
    everywhere = condition_for(table, allowed, faults, relevant_atoms)
    return replace(found, everywhere=everywhere, is_partial=everywhere is None)


def _causes(table: Table, combinations: int, context: Sequence[Formula]) -> dict[Column, int]:
    """What must have ended a state where `combinations` hold, of all that may end it.

    A proof does not need it, but a reader looks for the cause; that time passes is not one.
    """
    ended = combinations & table.all_of(context)
    context_atoms = frozenset(atoms_of(context))
    found: dict[Column, int] = {}
    for column in table.columns if ended else ():
        if isinstance(column.variable, Quantity) and column.variable.kind == "periods":
            continue
        answers = range(len(column.answers))
        possible = [i for i in answers if ended & table.where(column, i)]
        free = [i for i in answers if combinations & table.where(column, i)]
        if not context_atoms.isdisjoint(column.atoms) and len(possible) == 1 < len(free):
            found[column] = possible[0]
    return found


def describe(
    table: Table, faults: int, allowed: int, relevant_atoms: frozenset[Atom]
) -> tuple[FactTexts, TruthAssignment, int]:
    """Facts that, within the combinations `allowed`, always lead to one of `faults`.

    `faults` must have a combination. Facts about other than the relevant atoms are left out first,
    and of several about one thing wherever the others lead to a fault without them.
    The last of the result are the combinations in which the facts hold.
    """
    combination = (faults & -faults).bit_length() - 1
    chosen = dict(zip(table.columns, table.answers_at(combination), strict=True))
    for column in sorted(table.columns, key=lambda c: not relevant_atoms.isdisjoint(c.atoms)):
        rest = {c: answer for c, answer in chosen.items() if c is not column}
        if not _combinations(table, rest) & allowed & ~faults:
            chosen = rest
    found = chosen.items()
    for column in chosen:
        stated = (item for each in found for item in _stated_answers(*each, relevant_atoms))
        if not table.where_answered(stated) & allowed & ~faults:
            break
        relevant_atoms |= frozenset(column.atoms)
    facts = tuple(
        fact for column, answer in found for fact in fact_texts(column, answer, relevant_atoms)
    )
    answers = tuple(
        truth_value for column, answer in found for truth_value in truth_assignment(column, answer)
    )
    return facts, answers, _combinations(table, chosen)


def _combinations(table: Table, chosen: Mapping[Column, int]) -> int:
    bits = table.full
    for column, answer in chosen.items():
        bits &= table.where(column, answer)
    return bits


def _stated_answers(
    column: Column, answer: int, relevant_atoms: frozenset[Atom]
) -> list[tuple[Atom, bool]]:
    """The atoms of one answer to report: the relevant ones, or all if none is."""
    answered = list(zip(column.atoms, column.answers[answer], strict=True))
    if isinstance(column.variable, EnumItem):
        return answered
    if isinstance(column.variable, Arrival):
        fresh = [item for item in answered if item[0].test == "fresh" and item[1]]
        answered = fresh or answered
    return [(atom, yes) for atom, yes in answered if atom in relevant_atoms] or answered


def fact_texts(
    column: Column, answer: int, relevant_atoms: frozenset[Atom]
) -> Iterator[tuple[str, str]]:
    """One answer of a column in words."""
    stated = _stated_answers(column, answer, relevant_atoms)
    if isinstance(column.variable, EnumItem):
        yield column.variable.text, " or ".join(_members(column.variable, stated))
        return
    for atom, yes in stated:
        yield atom.text, "true" if yes == atom.holds_if else "false"


def truth_assignment(column: Column, answer: int) -> Iterator[tuple[Expr, bool]]:
    """One answer of a column as expressions with their truth values."""
    answered = list(zip(column.atoms, column.answers[answer], strict=True))
    variable = column.variable
    if isinstance(variable, EnumItem) and variable.expr is not None:
        members = frozenset(_members(variable, answered))
        yield IsOneOf(variable.expr, members, type=Bool()), True
        return
    for atom, yes in answered:
        if atom.expr is not None:
            yield atom.expr, yes == atom.holds_if


def _members(item: EnumItem, answered: list[tuple[Atom, bool]]) -> list[str]:
    return [m for m in item.members if all((m in atom.test) == yes for atom, yes in answered)]
