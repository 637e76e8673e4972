"""What a specification says in the newest forms: the same, in fewer rows."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import count

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
        rows = _part(machine, "transitions")
        if rows is not None and not rows.has_links:
            _write_remainders(rows, _initial_conditions(machine))
            _join_rows(rows)
            _propose_modes(machine, rows)
            _join_rows(rows)


def _machines(value: YamlValue) -> Iterator[Collection]:
    """The mappings that have a transition table."""
    if not isinstance(value, Collection):
        return
    if _part(value, "transitions") is not None:
        yield value
    for entry in value.entries:
        yield from _machines(entry.value)


def _part(mapping: Collection | None, name: str) -> Collection | None:
    """The collection below a key."""
    values = (e.value for e in (mapping.entries if mapping else ()) if e.name == name)
    value = next(values, None)
    return value if isinstance(value, Collection) else None


def _initial_conditions(machine: Collection) -> Collection | None:
    value = _part(_part(machine, "conditions"), "initial")
    return None if value is None or value.has_links else value


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


# Lists of states that repeat.


_StateList = tuple[frozenset[str], list[Entry]]
"""The states of a list, and the cells of rows that have it."""


def _propose_modes(machine: Collection, rows: Collection) -> None:
    """A mode for each list of at least three states that at least two rows have.

    Lists inside others are modes inside modes. Of lists that overlap, the one in most rows becomes
    a mode, and the others stay.
    """
    states = _part(machine, "states")
    if states is None or states.has_links or any(e.name == "modes" for e in machine.entries):
        return
    known = {entry.name for entry in states.entries}
    lists = [(names, cell) for cell in _sources(rows) if (names := _names(cell)) and names <= known]
    groups = [*grouped(lists).items()]
    found: list[_StateList] = []
    for names, cells in sorted(groups, key=lambda group: (-len(group[1]), -len(group[0]))):
        fits = all(names < other or other < names or not names & other for other, _ in found)
        if len(names) > 2 and len(cells) > 1 and fits:
            found.append((names, cells))
    free = (name for n in count(1) if (name := f"mode_{n}") not in known)
    modes = dict(zip(free, (group for group in groups if group in found), strict=False))
    written = [_mode(name, modes) for name in modes]
    for name, (_, cells) in modes.items():
        for cell in cells:
            cell.value = _replaced(_scalars(cell)[0], name)
    if written:
        key = next(entry for entry in machine.entries if entry.name == "states")
        assert key.key is not None
        block = replace(states, flow=False, entries=written, below=[], broken=False)
        entry = Entry(_replaced(key.key, "modes"), block)
        machine.entries.insert(machine.entries.index(key) + 1, entry)


def _sources(rows: Collection) -> Iterator[Entry]:
    """The first cell of each row, in its short form or as a mapping."""
    for row in (entry.value for entry in rows.entries):
        if isinstance(row, Collection) and not row.is_mapping:
            yield from row.entries[:1]
        elif isinstance(row, Collection):
            yield from (entry for entry in row.entries if entry.name == "from")


def _scalars(cell: Entry) -> list[Scalar]:
    """The items of a list without comments."""
    value = cell.value
    if not isinstance(value, Collection) or value.is_mapping or value.broken or value.below:
        return []
    items = [entry.value for entry in value.entries if not entry.above and not entry.beside]
    return [item for item in items if isinstance(item, Scalar)]


def _names(cell: Entry) -> frozenset[str]:
    """The states that a row lists; none if it does not name each of a list once."""
    names = frozenset(item.text for item in _scalars(cell))
    is_list = isinstance(cell.value, Collection) and len(names) == len(cell.value.entries)
    return names if is_list else frozenset()


def _mode(name: str, modes: Mapping[str, _StateList]) -> Entry:
    """The definition of a mode: its states, in the order of its first row, and modes inside."""
    names, (first, *_) = modes[name]
    inside = {n: own for n, (own, _) in modes.items() if own < names}
    inner = [n for n, own in inside.items() if not any(own < other for other in inside.values())]
    of = {state: mode for mode in inner for state in inside[mode]}
    members = {of.get(item.text, item.text): item for item in _scalars(first)}
    like = first.value
    items: list[YamlValue] = [_replaced(item, text) for text, item in members.items()]
    states = Entry(_replaced(_scalars(first)[0], "states"), _row(like, items))
    mapping = Collection(True, True, like.begin, like.start, like.start, entries=[states])
    return Entry(_replaced(_scalars(first)[0], name), mapping)


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
