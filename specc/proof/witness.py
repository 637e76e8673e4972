"""The smallest situation that shows a fault: facts that do not matter are left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from specc.expr import show
from specc.model.expr import Among, Call, Expr
from specc.model.types import Bool
from specc.proof.formula import Atom
from specc.proof.table import Column, Table
from specc.proof.variables import Arrival, EnumItem, Flag
from specc.proof.verdict import Answers, Facts


def describe(
    table: Table, faults: int, allowed: int, asked: frozenset[Atom]
) -> tuple[Facts, Answers]:
    """Facts that, within the combinations `allowed`, always lead to one of `faults`.

    `faults` must have a combination. Facts about atoms that are not `asked` are left out first.
    """
    combination = (faults & -faults).bit_length() - 1
    chosen = dict(zip(table.columns, table.answers_at(combination), strict=True))
    for column in sorted(table.columns, key=lambda c: not asked.isdisjoint(c.atoms)):
        rest = {c: answer for c, answer in chosen.items() if c is not column}
        if not _common(table, rest) & allowed & ~faults:
            chosen = rest
    found = chosen.items()
    facts = tuple(fact for column, answer in found for fact in _facts(column, answer, asked))
    return facts, tuple(said for column, answer in found for said in _answers(column, answer))


def _common(table: Table, chosen: Mapping[Column, int]) -> int:
    bits = table.full
    for column, answer in chosen.items():
        bits &= table.where(column, answer)
    return bits


def _facts(column: Column, answer: int, asked: frozenset[Atom]) -> Iterator[tuple[str, str]]:
    """One answer of a column in words; atoms that are not asked only where none of it is."""
    answered = list(zip(column.atoms, column.answers[answer], strict=True))
    variable = column.variable
    if isinstance(variable, EnumItem):
        yield variable.text, " or ".join(_members(variable, answered))
        return
    if isinstance(variable, Arrival):
        fresh = [item for item in answered if item[0].test == "fresh" and item[1]]
        answered = fresh or answered
    if isinstance(variable, Flag) and variable.of < 0:
        yield from (_number(atom, yes) for atom, yes in answered)
        return
    told = [(atom, yes) for atom, yes in answered if atom in asked] or answered
    for atom, yes in told:
        yield atom.text, "true" if yes == atom.text_holds else "false"


def _number(atom: Atom, yes: bool) -> tuple[str, str]:
    """Whether something is a number, in words."""
    of = atom.expr.args[0] if isinstance(atom.expr, Call) else None
    return show(of) if of is not None else atom.text, "a number" if yes else "NaN"


def _answers(column: Column, answer: int) -> Iterator[tuple[Expr, bool]]:
    """One answer of a column as expressions with their truth values."""
    answered = list(zip(column.atoms, column.answers[answer], strict=True))
    variable = column.variable
    if isinstance(variable, EnumItem) and variable.expr is not None:
        members = frozenset(_members(variable, answered))
        yield Among(variable.expr, members, type=Bool()), True
        return
    for atom, yes in answered:
        if atom.expr is not None:
            yield atom.expr, yes == atom.text_holds


def _members(item: EnumItem, answered: list[tuple[Atom, bool]]) -> list[str]:
    return [m for m in item.members if all((m in atom.test) == yes for atom, yes in answered)]
