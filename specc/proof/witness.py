"""The smallest situation that shows a fault: facts that do not matter are left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from specc.proof.formula import Atom
from specc.proof.table import Column, Table
from specc.proof.variables import Arrival, EnumItem
from specc.proof.verdict import Facts


def describe(table: Table, faults: int, allowed: int, asked: frozenset[Atom]) -> Facts:
    """Facts that, within the combinations `allowed`, always lead to one of `faults`.

    `faults` must have a combination. Facts about atoms that are not `asked` are left out first.
    """
    combination = (faults & -faults).bit_length() - 1
    chosen = dict(zip(table.columns, table.answers_at(combination), strict=True))
    for column in sorted(table.columns, key=lambda c: not asked.isdisjoint(c.atoms)):
        rest = {c: answer for c, answer in chosen.items() if c is not column}
        if not _common(table, rest) & allowed & ~faults:
            chosen = rest
    return tuple(f for column, answer in chosen.items() for f in _facts(column, answer, asked))


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
        possible = [m for m in variable.members if all((m in a.test) == y for a, y in answered)]
        yield variable.text, " or ".join(possible)
        return
    if isinstance(variable, Arrival):
        fresh = [item for item in answered if item[0].test == "fresh" and item[1]]
        answered = fresh or answered
    told = [(atom, yes) for atom, yes in answered if atom in asked] or answered
    for atom, yes in told:
        yield atom.text, "true" if yes == atom.text_holds else "false"
