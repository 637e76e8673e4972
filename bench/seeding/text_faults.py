"""Faults in the YAML itself and in the keys of a specification."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from bench.seeding.fault import Seed, fault, seed
from bench.seeding.sheet import Edit, Sheet, misspelt
from specc.source import Route

_CLAIM: Route = ("specc",)
# A mapping lacks its meaning without these; the part that each must stand in, "" for any.
_REQUIRED = {
    "signature": "operators",
    "type": "memory",
    "that": "assume",
    "because": "assume",
    "model": "",
    "cycle": "",
    "of": "",
}
# Without these a specification is not complete yet.
_OPEN = {
    "python": "operators",
    "init": "memory",
    "behaviour": "states",
    "terminal": "behaviours",
    "initial_state": "",
}
# The keys below these are names that the designer chose.
_NAMED = frozenset(
    (
        "frames",
        "types",
        "constants",
        "files",
        "operators",
        "parameters",
        "fields",
        "agents",
        "real_effectors",
        "real_receptors",
        "virtual_effectors",
        "virtual_receptors",
        "with",
        "x",
        "y",
        "memory",
        "let",
        "functions",
        "behaviours",
        "states",
        "bind",
        "initial",
        "error",
        "interfaces",
    )
)


def _tabs(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        if len(route) > 1 and isinstance(route[-1], str) and _starts_line(sheet, route):
            start = sheet.key(route).start
            line = sheet.text.rfind("\n", 0, start) + 1
            yield seed(Edit(line, start, "\t" * ((start - line) // 2)))


def _doubled(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        if route and isinstance(route[-1], str) and sheet.one_line(route):
            yield seed(sheet.beside(route, sheet.entry(route)), sheet.key(route).end)


def _unclosed(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        node = sheet.at(route)
        if sheet.text[node.start] in "{[" and sheet.text[node.end - 1] in "}]":
            # The parser can tell only by what comes next.
            following = re.compile(r"[^\n]*\n\s*").match(sheet.text, node.end)
            next_line = following.end() if following else node.end
            yield seed(Edit(node.end - 1, node.end, ""), node.start, node.end - 1, next_line)


def _misspelt_keys(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        index = "for" in route[:-1]  # a name of the author's, not a key
        if route and _is_key(route) and route != _CLAIM and not index:
            key = sheet.key(route)
            yield seed(sheet.replaced(key, misspelt(str(route[-1]))))


def _unclaimed(sheet: Sheet) -> Iterator[Seed]:
    """Without the key that says that it is a specification, nothing looks into a file."""
    key = sheet.key(_CLAIM)
    yield seed(sheet.replaced(key, misspelt(str(key.scalar))), elsewhere=[0])
    yield seed(sheet.removed(_CLAIM), elsewhere=[0])


def _missing_keys(sheet: Sheet) -> Iterator[Seed]:
    yield from _removed(sheet, _REQUIRED)


def _open_keys(sheet: Sheet) -> Iterator[Seed]:
    yield from _removed(sheet, _OPEN)


def _removed(sheet: Sheet, keys: Mapping[str, str]) -> Iterator[Seed]:
    for route in sheet.walk():
        if len(route) < 2 or (owner := keys.get(str(route[-1]))) is None:
            continue
        parent = route[:-1]
        if (owner and route[-3:-2] != (owner,)) or not _is_key(route) or "types" in route:
            continue
        if len(sheet.entries(parent)) > 1 and isinstance(sheet.get(parent), dict):
            named = sheet.at(parent) if isinstance(parent[-1], int) else sheet.key(parent)
            yield seed(sheet.removed(route), named.start)


def _wrong_kinds(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        if not route or not _is_key(route):
            continue
        node, data = sheet.at(route), sheet.get(route)
        if isinstance(data, list) and sheet.one_line(route) and route[-1] not in ("eq", "fig"):
            yield seed(sheet.replaced(node, "3"))
        elif route[-1] in ("states", "memory", "conditions", "behaviours", "plant", "task"):
            yield seed(Edit(sheet.key(route).start, node.end, f"{route[-1]}: [3]"))
        elif route[-1] in ("eq", "table"):
            yield seed(sheet.replaced(node, "fourteen"))


def _no_files(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        used = isinstance(sheet.get(route), str) and (
            route[-1] in ("use", "model") or route[0] == "files" or route[:1] == ("use",)
        )
        if used:
            yield seed(sheet.replaced(sheet.at(route), "lib/nowhere.yaml"))


def _is_key(route: Route) -> bool:
    """Whether a value is named by a key of the language rather than by the designer."""
    if not isinstance(route[-1], str) or "." in route[-1]:
        return False
    parent = route[-2] if len(route) > 1 else ""
    if parent in _NAMED or (parent == "terminal" and "conditions" in route):
        return False
    return route[-3:-2] not in (
        ("x",),
        ("y",),
        ("functions",),
        ("real_effectors",),
        ("interfaces",),
    )


def _starts_line(sheet: Sheet, route: Route) -> bool:
    start = sheet.key(route).start
    line = sheet.text.rfind("\n", 0, start) + 1
    return start - line > 1 and not sheet.text[line:start].strip()


FAULTS = (
    fault("tab in the indentation", "E0009", _tabs),
    fault("duplicate key", "E0011", _doubled),
    fault("bracket not closed", "E0009", _unclosed),
    fault("misspelt key", "E0101", _misspelt_keys),
    fault("file that does not say what it is", "E0022", _unclaimed, abroad=True),
    fault("missing key", "E0102", _missing_keys),
    fault("part that is not there yet", "O0201 O0202 O0602 O0606 O0607", _open_keys),
    fault("wrong kind of value", "E0103", _wrong_kinds),
    fault("missing file", "E0001 E0208 E0501", _no_files),
)
