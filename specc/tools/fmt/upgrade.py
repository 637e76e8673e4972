"""What a specification of version 1 says in the forms of version 1.3: the same, in fewer rows."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from specc.lang import ExprError, parse
from specc.model.fsm import OTHERWISE
from specc.reachable import grouped
from specc.schema.files import VERSIONS
from specc.tools.fmt.tree import Collection, Entry, Scalar, YamlValue


def upgrade(root: Collection) -> None:
    """Change a tree in place. What carries a comment, a title or a trace stays as it is."""
    for entry in root.entries:
        if entry.name == "specc" and isinstance(entry.value, Scalar):
            entry.value = _replaced(entry.value, str(VERSIONS[-1]))
    for machine in _machines(root):
        rows = machine["transitions"]
        if isinstance(rows, Collection) and not rows.has_links:
            _write_remainders(rows, _initial_conditions(machine))
            _join_rows(rows)


def _machines(value: YamlValue) -> Iterator[dict[str, YamlValue]]:
    """The mappings that have a transition table."""
    if not isinstance(value, Collection):
        return
    parts = {entry.name: entry.value for entry in value.entries}
    if "transitions" in parts:
        yield parts
    for entry in value.entries:
        yield from _machines(entry.value)


def _initial_conditions(machine: dict[str, YamlValue]) -> Collection | None:
    value: YamlValue | None = machine.get("conditions")
    for entry in value.entries if isinstance(value, Collection) else ():
        if entry.name == "initial" and isinstance(entry.value, Collection):
            return None if entry.value.has_links else entry.value
    return None


# The condition that is the negation of the only other one.


def _write_remainders(rows: Collection, conditions: Collection | None) -> None:
    """`otherwise` for a condition that is `not` the other one, if nothing else uses it."""
    if conditions is None or any(entry.name == OTHERWISE for entry in conditions.entries):
        return
    trees = {e.name: tree for e in conditions.entries if (tree := _tree(e)) is not None}
    names = {ast.dump(tree): name for name, tree in trees.items()}
    for name, tree in trees.items():
        if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not):
            other = names.get(ast.dump(tree.operand))
            if other is not None and _is_replaced(rows, name, other):
                conditions.entries = [e for e in conditions.entries if e.name != name]


def _tree(entry: Entry) -> ast.expr | None:
    """The expression of a condition; None if it has a comment, a title or a trace."""
    value = entry.value
    if isinstance(value, Collection) and [e.name for e in value.entries] == ["when"]:
        value = value.entries[0].value
    if entry.above or entry.beside or not isinstance(value, Scalar):
        return None
    with suppress(ExprError):
        return parse(" ".join(value.text.split()))
    return None


def _is_replaced(rows: Collection, name: str, other: str) -> bool:
    """Whether all rows with a condition became remainders: each beside one row with the other."""
    cells = [row for entry in rows.entries if (row := _cells(entry)) is not None]
    if len(cells) < len(rows.entries):
        return False
    groups = grouped(((state.text, cause.text), when.text) for state, cause, when, _ in cells)
    if any(sorted(group) != sorted((name, other)) for group in groups.values() if name in group):
        return False
    for entry, (state, cause, when, target) in zip(rows.entries, cells, strict=True):
        if when.text == name:
            entry.value = _row(entry.value, [state, cause, _replaced(when, OTHERWISE), target])
    return True


# Rows that differ in their state only.


def _join_rows(rows: Collection) -> None:
    bare = (entry for entry in rows.entries if not entry.above and not entry.beside)
    cells = ((entry, row) for entry in bare if (row := _cells(entry)) is not None)
    groups = grouped((tuple(cell.text for cell in row[1:]), (entry, row)) for entry, row in cells)
    for group in groups.values():
        (first, row), *others = group
        states = {row[0].text: row[0] for _, row in group}
        if 1 < len(states) == len(group):
            sources = _row(first.value, list(states.values()))
            first.value = _row(first.value, [sources, *row[1:]])
            rows.entries = [e for e in rows.entries if all(e is not other for other, _ in others)]


def _cells(entry: Entry) -> tuple[Scalar, Scalar, Scalar, Scalar] | None:
    """The cells of a row in its short form, of one state."""
    value = entry.value
    if not isinstance(value, Collection) or value.is_mapping or value.broken:
        return None
    cells = [each.value for each in value.entries if isinstance(each.value, Scalar)]
    return (
        (cells[0], cells[1], cells[2], cells[3]) if len(cells) == 4 == len(value.entries) else None
    )


def _row(like: YamlValue, cells: list[YamlValue]) -> Collection:
    return Collection(
        False, True, like.begin, like.start, like.start, entries=[Entry(None, c) for c in cells]
    )


def _replaced(like: Scalar, text: str) -> Scalar:
    return replace(like, text=text, raw=text, style="")
