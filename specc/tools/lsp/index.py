"""The index of symbols of a specification: where each is defined and where it is named.

It is made from the texts, and from what the compiler took their expressions for, as far as it got.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from specc.model.expr import Expr, walk
from specc.model.system import System
from specc.reachable import grouped
from specc.resolve.context import Findings, Meaning, Use
from specc.resolve.uses import uses_in, uses_in_type
from specc.source import Place, Route, SourceFile, Sources, TextNode
from specc.tools.lsp.formulas import Paths, paths_of
from specc.tools.lsp.references import Links, Occurrence, linked, references_of
from specc.tools.lsp.symbols import (
    FileSymbols,
    Symbol,
    SymbolKey,
    collect,
    in_force,
)

_DEVICES = {"virtual_effectors": "real_effectors", "virtual_receptors": "real_receptors"}


@dataclass(frozen=True)
class Index:
    """The files and all that is known of them. `meanings` are by file and route."""

    sources: Sources
    system: System | None
    meanings: Mapping[SymbolKey, Meaning]
    files: Mapping[str, FileSymbols]
    links: Links
    found: Findings
    _occurrences: dict[str, tuple[Occurrence, ...]] = field(default_factory=dict)

    def text(self, path: str) -> str:
        """The text of a file as it was indexed; empty for a file that was not."""
        source = self.sources.get(path)
        return source.text if source else ""

    def offsets(self, place: Place) -> tuple[int, int]:
        """Where a place is in the text of its file."""
        source = self.sources.get(place.file)
        return source.offsets(place) if source else (0, 0)

    def node(self, path: str, route: Route) -> TextNode | None:
        """The value at a route of a file."""
        source = self.sources.get(path)
        return source.node(route) if source else None

    def occurrences(self, path: str) -> tuple[Occurrence, ...]:
        """All names of symbols in a file, in no particular order."""
        source = self.sources.get(path)
        if source is None:
            return ()
        if path not in self._occurrences:
            uses = dict.fromkeys(self._uses(source))
            found = references_of(source, self.files, self.links, uses)
            self._occurrences[path] = tuple(found)
        return self._occurrences[path]

    def _uses(self, source: SourceFile) -> Iterator[Use]:
        """What resolving knows of the names in a file.

        The texts of many have a `{i}` for their index, before which alone names stand in place.
        """
        yield from (use for use in self.found.uses if use.place.file == source.path)
        texts = [(m.where, m.text, uses_in(m)) for m in self._by_file.get(source.path, ())]
        types = (t for t in self.found.types if t.where.file == source.path)
        texts += [(t.where, t.text, uses_in_type(t)) for t in types]
        for where, text, uses in texts:
            written = source.scalar(where.place) or ""
            for use in uses:
                here = slice(use.place.start, use.place.end)
                if text[here] == written[here]:
                    yield use

    def at(self, path: str, offset: int) -> Occurrence | None:
        """The name at a place; the place behind its last character counts too."""
        found = [o for o in self.occurrences(path) if o.start <= offset <= o.end]
        return min(found, key=lambda o: (o.end - o.start, o.end == offset), default=None)

    def references(self, symbol: Symbol) -> Iterator[tuple[str, Occurrence]]:
        """Every place, in any file, that defines or names a symbol or another end of it."""
        yield from self.naming(symbol.declarations)

    def naming(self, symbols: Iterable[Symbol]) -> Iterator[tuple[str, Occurrence]]:
        """Every place, in any file, that defines or names one of some symbols."""
        wanted = set(symbols)
        for source in self.sources:
            for occurrence in self.occurrences(source.path):
                if occurrence.symbol in wanted:
                    yield source.path, occurrence

    def twin(self, symbol: Symbol) -> Symbol | None:
        """The symbol that is defined here where one of another index is defined there."""
        file = self.files.get(symbol.place.file)
        found = file.by_route.get(symbol.place.route) if file else None
        if found is None and file is not None:
            found = file.top.get((symbol.kind, symbol.qualified))
        return found if found is not None and found.kind == symbol.kind else None

    def visible(self, path: str, owner: Route) -> Iterator[Symbol]:
        """The symbols that a text in a subsystem of a file may name."""
        yield from in_force(self.files, path, owner)

    def part_at(self, path: str, offset: int) -> tuple[Meaning, Expr] | None:
        """The smallest part of a typed expression at a place, with the whole of it."""
        source = self.sources.get(path)
        if source is None:
            return None
        for meaning in self._by_file.get(path, ()):
            start, end = source.offsets(meaning.where.place)
            if start <= offset <= end and meaning.expr is not None:
                return meaning, _smallest(self, meaning, meaning.expr, offset)
        return None

    def value_at(self, path: str, offset: int) -> tuple[Route, TextNode, bool] | None:
        """The key or the text at a place: its route, where it stands, and whether it is the key."""
        source = self.sources.get(path)
        for route, key, node in source.nodes if source else ():
            if key is not None and key.start <= offset <= key.end:
                return route, key, True
            if node.scalar is not None and node.start <= offset <= node.end:
                return route, node, False
        return None

    @cached_property
    def paths(self) -> Paths:
        """What requirements may name."""
        return paths_of(self.system) if self.system else Paths()

    @cached_property
    def _by_file(self) -> dict[str, list[Meaning]]:
        return grouped((path, meaning) for (path, _), meaning in self.meanings.items())


def build_index(sources: Sources, system: System | None, found: Findings) -> Index:
    """The index of some files, as far as they could be understood."""
    files = {source.path: collect(source) for source in sources}
    links = linked(files, system)
    for source in sources:
        _tie(files[source.path], source)
    return Index(sources, system, _by_place(found.meanings), files, links, found)


def _by_place(meanings: Iterable[Meaning]) -> dict[SymbolKey, Meaning]:
    """One meaning a text: of a reused description the first that has no error."""
    found: dict[SymbolKey, Meaning] = {}
    for meaning in meanings:
        key = meaning.where.file, meaning.where.route
        if key not in found or found[key].expr is None:
            found[key] = meaning
    return found


def _tie(file: FileSymbols, source: SourceFile) -> None:
    """A virtual effector or receptor without `uses` works with the device of its own name."""
    for route, symbol in file.by_route.items():
        group = (
            _DEVICES.get(str(route[-2])) if symbol.kind == "subsystem" and len(route) > 2 else None
        )
        device = file.by_route.get((*route[:-2], group, route[-1])) if group else None
        node = source.node(route)
        if device is not None and node is not None and "uses" not in node.values:
            symbol.tied, device.tied = (device,), (symbol,)


def _smallest(index: Index, meaning: Meaning, expr: Expr, offset: int) -> Expr:
    best, size = expr, len(meaning.text) + 1
    for node in walk(expr):
        first, last = node.span
        where = meaning.where
        start, end = index.offsets(Place(where.file, where.route, "value", first, last))
        if start <= offset <= end and last - first < size:
            best, size = node, last - first
    return best
