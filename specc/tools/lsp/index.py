"""Which symbols there are, and where each is defined and named.

Definitions come from the text alone, what names mean from what the compiler took them for.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from specc.lang import ExprError
from specc.lang.parse import parse_syntax, span
from specc.model.expr import Expr, walk
from specc.model.system import Subsystem, System
from specc.model.types import Bool, Type
from specc.model.wires import Wire, Wires
from specc.reachable import grouped, reachable
from specc.resolve.context import Findings, Meaning, Use
from specc.resolve.uses import uses_in, uses_in_type
from specc.schema.keys import SymbolKind
from specc.schema.places import defined_by, is_device, split
from specc.source import Place, Route, SourceFile, Sources, TextNode, beside

# The symbols of one file, known from its text.


SymbolKey = tuple[str, Route]
"""File and route of a definition."""


@dataclass(eq=False, slots=True)
class Symbol:
    """Something with a name; `owner` is the subsystem or device that it belongs to."""

    kind: SymbolKind
    name: str
    place: Place
    owner: Route
    qualified: str
    """Unique among its kind in its file or owner: `x.c.T_d`, `Object.label`, `Mode.u`."""
    type: Type | None = None
    ends: tuple[Symbol, ...] = ()
    """All declarations of an element of a connection, this one included; empty for one."""
    tied: tuple[Symbol, ...] = ()
    """Others that have the same name because one is found by the name of the other."""

    @property
    def declarations(self) -> tuple[Symbol, ...]:
        """The places that declare it: both ends of a connection."""
        return self.ends or (self,)

    def join(self, other: Symbol) -> None:
        """Make two symbols declarations of one element."""
        joined = tuple(dict.fromkeys((*self.declarations, *other.declarations)))
        for end in joined:
            end.ends = joined


@dataclass(eq=False, slots=True)
class FileSymbols:
    """The symbols of one file: of the file itself, and of each subsystem and device in it."""

    uses: tuple[str, ...] = ()
    top: dict[tuple[SymbolKind, str], Symbol] = field(default_factory=dict)
    inside: dict[Route, dict[tuple[SymbolKind, str], Symbol]] = field(default_factory=dict)
    by_route: dict[Route, Symbol] = field(default_factory=dict)


def collect(source: SourceFile) -> FileSymbols:
    """The symbols that a file defines; none if it has no tree of values."""
    found = FileSymbols()
    for route, _, node in source.nodes:
        kind = defined_by(route)
        if kind is not None:
            _add(found, _symbol(kind, route, source.path), route)
        if len(route) == 2 and route[0] == "use" and node.scalar:
            found.uses = (*found.uses, beside(source.path, node.scalar))
        if _is_type_text(route) and node.scalar:
            _add_members(found, source.path, route, node.scalar)
    return found


def _symbol(kind: SymbolKind, route: Route, path: str) -> Symbol:
    owner, rest = split(route)
    name = str(route[-1])
    if kind in ("subsystem", "device"):
        return Symbol(kind, "c" if name == "control" else name, Place(path, route, "key"), (), "")
    qualified = name
    if kind == "element":
        qualified = ".".join(map(str, rest))
    elif kind == "field":
        qualified = f"{rest[1]}.{name}"
    return Symbol(kind, name, Place(path, route, "key"), owner, qualified)


def _add(found: FileSymbols, symbol: Symbol, route: Route) -> None:
    found.by_route[route] = symbol
    if symbol.kind in ("subsystem", "device"):
        # Known by the place alone: an agent may be reused under several names.
        return
    names = found.inside.setdefault(symbol.owner, {}) if symbol.owner else found.top
    names.setdefault((symbol.kind, symbol.qualified), symbol)


def _is_type_text(route: Route) -> bool:
    return route[:1] == ("types",) and (len(route) == 2 or route[2:] == ("type",))


def _add_members(found: FileSymbols, path: str, route: Route, text: str) -> None:
    for member in _members(text):
        place = Place(path, route, "value", *span(member))
        qualified = f"{route[1]}.{member.id}"
        symbol = Symbol("member", member.id, place, (), qualified)
        found.top.setdefault(("member", qualified), symbol)


def _members(text: str) -> Iterator[ast.Name]:
    """The members that `enum[a, b]` declares."""
    try:
        tree = parse_syntax(text)
    except ExprError:
        return
    match tree:
        case ast.Subscript(value=ast.Name(id="enum"), slice=inner):
            for node in inner.elts if isinstance(inner, ast.Tuple) else (inner,):
                if isinstance(node, ast.Name):
                    yield node


def in_force(files: Mapping[str, FileSymbols], path: str, owner: Route) -> Iterator[Symbol]:
    """The symbols that a text in a subsystem of a file may name, innermost first."""
    if path in files and owner and not is_device(owner):
        yield from files[path].inside.get(owner, {}).values()
    for file in reachable((path,), lambda file: files[file].uses if file in files else ()):
        own = files[file].top.values() if file in files else ()
        yield from (symbol for symbol in own if file == path or symbol.kind != "parameter")


def share(files: Mapping[str, FileSymbols], here: Place, element: Symbol) -> None:
    """Let a buffer have an element of its interface, as if it stood there."""
    owner, rest = split(here.route)
    if here.file in files:
        name = ".".join(map(str, rest))
        known = files[here.file].inside.setdefault(owner, {})
        if ("element", name) not in known:  # a description is there once for each of its uses
            own = Symbol("element", element.name, element.place, owner, name, element.type)
            known["element", name] = own
            element.join(own)


def symbol_at(files: Mapping[str, FileSymbols], key: SymbolKey) -> Symbol | None:
    """The symbol that is defined at a place; a member of an enum stands a step below its type."""
    path, route = key
    file = files.get(path)
    if file is None or route in file.by_route or route[:1] != ("types",) or len(route) != 3:
        return file.by_route.get(route) if file else None
    return file.top.get(("member", f"{route[1]}.{route[2]}"))


# What the model adds to the text: types of symbols, the ends of connections, peers, bindings.


@dataclass(eq=False, slots=True)
class Links:
    """Definitions that keys stand for, named by file and route."""

    wires: dict[SymbolKey, Wire] = field(default_factory=dict)
    """Key of a buffer (owner, direction, peer) -> its wire, if there is another end."""
    named: dict[SymbolKey, SymbolKey] = field(default_factory=dict)
    """Key of a buffer -> what has the name of its peer: an agent, not its control subsystem."""
    agents: dict[str, SymbolKey] = field(default_factory=dict)
    bindings: dict[SymbolKey, SymbolKey] = field(default_factory=dict)


def linked(files: Mapping[str, FileSymbols], system: System | None) -> Links:
    """Give symbols their types, and elements the other ends of their connections."""
    links = Links()
    if system is None:
        return links
    for constant in system.constants:
        _typed(files, constant.place, constant.value.type)
    for let in system.formula_lets:
        _typed(files, let.place, let.value.type if let.value else Bool())
    for item in system.plant.observed if system.plant else ():
        _typed(files, item.place, item.type)
    for subsystem in system.subsystems:
        _declare(files, subsystem)
    links.agents = {agent.name: key_of(agent.place) for agent in system.agents}
    wires = Wires(system.agents)
    for subsystem in system.subsystems:
        _connect(files, links, subsystem, wires)
    for binding in system.plant.bindings if system.plant else ():
        device = wires.devices.get(binding.device)
        for element in (*device.x, *device.y) if device else ():
            if element.name == binding.element:
                _typed(files, element.place, element.type)
                links.bindings[key_of(binding.place)] = key_of(element.place)
    return links


def key_of(place: Place) -> SymbolKey:
    """What a definition is known by."""
    return place.file, place.route


def _typed(files: Mapping[str, FileSymbols], place: Place, type_: Type) -> None:
    if symbol := symbol_at(files, key_of(place)):
        symbol.type = type_


def _declare(files: Mapping[str, FileSymbols], subsystem: Subsystem) -> None:
    """What a subsystem has; a buffer has the elements of its interface as if they stood there."""
    for memory in subsystem.memory:
        _typed(files, memory.place, memory.type)
    for let in subsystem.lets:
        _typed(files, let.place, let.value.type)
    for port in subsystem.ports:
        for element in port.elements:
            _typed(files, element.place, element.type)
            there = symbol_at(files, key_of(element.place))
            if there and port.interface and port.place_of(element) == port.place:
                share(files, port.place.below(element.name), there)


def _connect(
    files: Mapping[str, FileSymbols], links: Links, subsystem: Subsystem, wires: Wires
) -> None:
    for wire in wires.of(subsystem):
        port = wire.port
        if wire.part is None:
            continue
        links.wires.setdefault(key_of(port.place), wire)
        if named := wires.named(subsystem, port):
            links.named.setdefault(key_of(port.place), key_of(named))
        far = {e.name: symbol_at(files, key_of(e.place)) for e in wire.elements}
        for element in port.elements:
            near, end = symbol_at(files, key_of(element.place)), far.get(element.name)
            if near and end and near is not end:
                near.join(end)


# Where the texts of a file name symbols.


_PART = re.compile(r"[^.]+")


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A place that names a symbol: a stretch of its file, in offsets, and the type there."""

    start: int
    end: int
    symbol: Symbol
    place: Place
    defines: bool
    type: Type | None


def references_of(
    source: SourceFile,
    files: Mapping[str, FileSymbols],
    links: Links,
    uses: Iterable[Use],
) -> Iterator[Occurrence]:
    """The names of symbols in a file, definitions among them; `uses` are of that file."""
    reader = _Reader(source, files, links)
    yield from reader.definitions()
    yield from (found for use in uses for found in reader.used(use))
    for route, key, _ in source.nodes:
        if key is not None:
            yield from reader.in_key(route)


@dataclass(eq=False, slots=True)
class _Reader:
    source: SourceFile
    files: Mapping[str, FileSymbols]
    links: Links
    variables: dict[Place, Symbol] = field(default_factory=dict)

    def _named(
        self, symbol: Symbol, place: Place, defines: bool = False, type_: Type | None = None
    ) -> Occurrence:
        offsets = self.source.offsets(place)
        return Occurrence(*offsets, symbol, place, defines, type_ or symbol.type)

    def definitions(self) -> Iterator[Occurrence]:
        """The definitions themselves; members of enums stand in the texts of types."""
        own = self.files[self.source.path]
        members = (symbol for symbol in own.top.values() if symbol.kind == "member")
        for symbol in (*own.by_route.values(), *members):
            yield self._named(symbol, symbol.place, defines=True)

    def used(self, use: Use) -> Iterator[Occurrence]:
        """A name in a text, if what it names is a symbol."""
        key = key_of(use.of)
        if use.of.start is not None:
            symbol: Symbol | None = self._variable(use)
        else:
            symbol = self._at(self.links.named.get(key, key))
        if symbol is not None:
            yield self._named(symbol, use.place, use.place == use.of, use.type)

    def _variable(self, use: Use) -> Symbol:
        """A variable lives in its text only."""
        if use.of not in self.variables:
            name = (self.source.scalar(use.of) or "")[use.of.start : use.of.end]
            owner = split(use.of.route)[0]
            self.variables[use.of] = Symbol("variable", name, use.of, owner, name)
        symbol = self.variables[use.of]
        symbol.type = symbol.type or use.type
        return symbol

    def in_key(self, route: Route) -> Iterator[Occurrence]:
        """What the model knows of keys: the ends of buffers, and bound elements."""
        key, rest = (self.source.path, route), split(route)[1]
        match rest:
            case ("x" | "y", str()):
                if (symbol := self._at(self.links.named.get(key))) is not None:
                    yield self._named(symbol, Place(*key, "key"))
            case ("plant", "bind", str(name)):
                yield from self._bound(route, name)

    def _bound(self, route: Route, name: str) -> Iterator[Occurrence]:
        """Agent, device and element in `irp.E.m.c_d`."""
        element = self._at(self.links.bindings.get((self.source.path, route)))
        device = self._at((element.place.file, element.owner)) if element else None
        agent = self._at(self.links.agents.get(name.partition(".")[0]))
        parts = list(_PART.finditer(name))
        if len(parts) == 4:
            for part, symbol in zip(parts, (agent, None, device, element), strict=True):
                if symbol is not None:
                    place = Place(self.source.path, route, "key", *part.span())
                    yield self._named(symbol, place)

    def _at(self, key: SymbolKey | None) -> Symbol | None:
        return symbol_at(self.files, key) if key else None


# The index of a specification.


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

    def naming(self, symbols: Iterable[Symbol]) -> Iterator[tuple[str, Occurrence]]:
        """Every place, in any file, that defines or names one of some symbols."""
        wanted = set(symbols)
        for source in self.sources:
            for occurrence in self.occurrences(source.path):
                if occurrence.symbol in wanted:
                    yield source.path, occurrence

    def counterpart(self, symbol: Symbol) -> Symbol | None:
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
