"""The outline of a file: what it defines, the one inside the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from specc.lsp.describe import title_of
from specc.lsp.index import Index
from specc.lsp.structure import Kind
from specc.lsp.symbols import node_at
from specc.source import Place, Route

_INSIDE: frozenset[Kind] = frozenset(("field", "variable"))


@dataclass(slots=True)
class Entry:
    """A definition: the stretch of all of it and, `name_start` to `name_end`, of its name."""

    kind: Kind
    name: str
    title: str
    start: int
    end: int
    name_start: int
    name_end: int
    inside: list[Entry] = field(default_factory=list)


def contents(index: Index, path: str, moved: Callable[[int], int | None]) -> list[Entry]:
    """The definitions of a file, in its order; `moved` gives offsets in the present text."""
    file = index.files.get(path)
    source = index.sources.get(path)
    top: list[Entry] = []
    known: dict[Route, Entry] = {}
    for route, symbol in file.by_route.items() if file and source else ():
        node = node_at(source, route)
        if node is None:
            continue
        name = index.offsets(Place(path, route, "key"))
        offsets = [moved(at) for at in (name[0], max(name[1], node.end), *name)]
        if None in offsets:
            continue
        shown = "control" if route[-1] == "control" else symbol.qualified or symbol.name
        shown = symbol.name if symbol.kind in _INSIDE else shown
        start, end, name_start, name_end = (at or 0 for at in offsets)
        title = title_of(symbol, node)
        entry = Entry(symbol.kind, shown, title, start, end, name_start, name_end)
        around = next(
            (known[route[:n]] for n in range(len(route) - 1, 0, -1) if route[:n] in known), None
        )
        (around.inside if around else top).append(entry)
        known[route] = entry
    return top
