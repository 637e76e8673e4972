"""Which symbols there are, and where each is defined and named.

Definitions come from the text alone, what names mean from what the compiler took them for.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from specc.lang import ExprError
from specc.lang.parse import parse_syntax, span
from specc.model.bindings import Widget
from specc.model.expr import Expr, walk
from specc.model.system import System
from specc.model.task import OF_ELEMENTS
from specc.model.types import Bool, Type
from specc.model.wires import Wire, Wires
from specc.reachable import grouped, reachable
from specc.resolve.context import Findings, Meaning, Use
from specc.resolve.uses import uses_in, uses_in_type
from specc.schema.keys import SymbolKind
from specc.schema.places import defined_by, is_device, split_at_part
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
    """All declarations of an element of a connection, this one included; empty for one. Or the
    error conditions of several states that a row names by one name."""
    namesakes: tuple[Symbol, ...] = ()
    """Others that have the same name because one is found by the name of the other."""
    panel: Widget | None = None
    """What of the operator's panel sets it."""

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
    by_owner: dict[Route, dict[tuple[SymbolKind, str], Symbol]] = field(default_factory=dict)
    by_route: dict[Route, Symbol] = field(default_factory=dict)


def collect(source: SourceFile) -> FileSymbols:
    """The symbols that a file defines; none if it has no tree of values."""
    found = FileSymbols()
    for route, _, node in source.nodes:
        if (kind := defined_by(route)) is not None:
            symbol = found.by_route[route] = _symbol(kind, route, source.path)
            if kind not in ("subsystem", "device"):  # an agent may be reused under several names
                names = found.by_owner.setdefault(symbol.owner, {}) if symbol.owner else found.top
                names.setdefault((kind, symbol.qualified), symbol)
        if len(route) == 2 and route[0] == "use" and node.scalar:
            found.uses = (*found.uses, beside(source.path, node.scalar))
        is_type = route[:1] == ("types",) and (len(route) == 2 or route[2:] == ("type",))
        for member in _members(node.scalar or "") if is_type else ():
            place = Place(source.path, route, "value", *span(member))
            qualified = f"{route[1]}.{member.id}"
            symbol = Symbol("member", member.id, place, (), qualified)
            found.top.setdefault(("member", qualified), symbol)
    return found


def _symbol(kind: SymbolKind, route: Route, path: str) -> Symbol:
    owner, rest = split_at_part(route)
    name, place = str(route[-1]), Place(path, route, "key")
    match kind:
        case "subsystem" | "device":
            return Symbol(kind, "c" if name == "control" else name, place, (), "")
        case "element":
            return Symbol(kind, name, place, owner, ".".join(map(str, rest)))
        case "field":
            return Symbol(kind, name, place, owner, f"{rest[1]}.{name}")
    return Symbol(kind, name, place, owner, name)


def _members(text: str) -> Iterator[ast.Name]:
    """The members that `enum[a, b]` declares."""
    try:
        tree = parse_syntax(text)
    except ExprError:
        return
    match tree:
        case ast.Subscript(value=ast.Name(id="enum"), slice=inner):
            nodes = inner.elts if isinstance(inner, ast.Tuple) else (inner,)
            yield from (node for node in nodes if isinstance(node, ast.Name))


# All files of a specification.


_DEVICES = {"virtual_effectors": "real_effectors", "virtual_receptors": "real_receptors"}
_PART = re.compile(r"[^.]+")


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A place that names a symbol: a range of its file, in offsets, and the type there."""

    start: int
    end: int
    symbol: Symbol
    place: Place
    defines: bool
    type: Type | None


class Index:
    """The symbols of some files, as far as the files could be understood."""

    def __init__(self, sources: Sources, system: System | None, found: Findings) -> None:
        """`system` is what the files describe, `found` what resolving noted on the way."""
        self.sources, self.system, self.found = sources, system, found
        self.files = {source.path: collect(source) for source in sources}
        self.meanings: dict[SymbolKey, Meaning] = {}
        """By file and route; of a reused description the first one that has no error."""
        for meaning in found.meanings:
            key = meaning.where.file, meaning.where.route
            if key not in self.meanings or self.meanings[key].expr is None:
                self.meanings[key] = meaning
        self.wires: dict[SymbolKey, Wire] = {}
        """Key of a buffer (owner, direction, peer) -> its wire, if there is another end."""
        self._peers: dict[SymbolKey, SymbolKey] = {}
        """Key of a buffer -> what has the name of its peer: an agent, not its control subsystem."""
        self._bindings: dict[SymbolKey, SymbolKey] = {}
        self._disturbed: list[tuple[Place, SymbolKey]] = []
        """Where disturbances name elements of devices, with the keys of these."""
        self._occurrences: dict[str, tuple[Occurrence, ...]] = {}
        if system is not None:
            self._add_types(system)
            self._connect(system)
            self._bind(system)
        for file in self.files.values():
            self._tie_devices(file)
        self._join_errors()

    # What the model adds to the text: types of symbols, ends of connections, bindings.

    def _add_types(self, system: System) -> None:
        typed = [(constant.place, constant.value.type) for constant in system.constants]
        for let in system.formula_lets:
            typed.append((let.place, let.value.type if let.value else Bool()))
        if system.plant:
            typed += [(each.place, each.type) for each in system.plant.observed]
        for subsystem in system.subsystems:
            # What modes remember stands in no file.
            memory = (item for item in subsystem.memory if item.name.isidentifier())
            lets = (let for let in subsystem.lets if let.name.isidentifier())
            typed += [(item.place, item.type) for item in memory]
            typed += [(let.place, let.value.type) for let in lets]
            typed += [(each.place, each.type) for port in subsystem.ports for each in port.elements]
        for place, type_ in typed:
            if symbol := self.symbol_at(key_of(place)):
                symbol.type = type_

    def _connect(self, system: System) -> None:
        """Join the ends of connections."""
        wires = Wires(system.agents)
        for subsystem in system.subsystems:
            for port in subsystem.ports:
                for element in port.elements:
                    there = self.symbol_at(key_of(element.place))
                    if there and port.interface and port.place_of(element) == port.place:
                        self._share(port.place.below(element.name), there)
        for subsystem in system.subsystems:
            for wire in wires.wires_of(subsystem):
                if wire.peer is None:
                    continue
                port = wire.port
                self.wires.setdefault(key_of(port.place), wire)
                if named := wires.peer_place(subsystem, port):
                    self._peers.setdefault(key_of(port.place), key_of(named))
                far = {e.name: self.symbol_at(key_of(e.place)) for e in wire.elements}
                for element in port.elements:
                    near, end = self.symbol_at(key_of(element.place)), far.get(element.name)
                    if near and end and near is not end:
                        near.join(end)

    def _bind(self, system: System) -> None:
        """Join bindings and disturbances to the elements of devices."""
        wires = Wires(system.agents)
        for binding in system.plant.bindings if system.plant else ():
            device = wires.devices.get(binding.device)
            for element in (*device.x, *device.y) if device else ():
                if element.name == binding.element:
                    self._bindings[key_of(binding.place)] = key_of(element.place)
                    if symbol := self.symbol_at(key_of(element.place)):
                        symbol.type, symbol.panel = element.type, binding.panel
        reported = {f"{d.qualified_name}.{e.name}": e for d in system.devices for e in d.y}
        for disturbance in system.disturbances:
            for _, action in disturbance.actions_on(*OF_ELEMENTS):
                if action.name in reported:
                    self._disturbed.append((action.place, key_of(reported[action.name].place)))

    def _share(self, here: Place, element: Symbol) -> None:
        """Let a buffer have an element of its interface, as if it stood there."""
        owner, rest = split_at_part(here.route)
        if here.file in self.files:
            name = ".".join(map(str, rest))
            known = self.files[here.file].by_owner.setdefault(owner, {})
            if ("element", name) not in known:  # a description is there once for each of its uses
                own = Symbol("element", element.name, element.place, owner, name, element.type)
                known["element", name] = own
                element.join(own)

    def _tie_devices(self, file: FileSymbols) -> None:
        """A virtual effector or receptor without `uses` works with the device of its own name."""
        for route, symbol in file.by_route.items():
            if symbol.kind == "subsystem" and len(route) > 2 and route[-2] in _DEVICES:
                device = file.by_route.get((*route[:-2], _DEVICES[str(route[-2])], route[-1]))
                node = self.node(symbol.place.file, route)
                if device is not None and node is not None and "uses" not in node.values:
                    symbol.namesakes, device.namesakes = (device,), (symbol,)

    def _join_errors(self) -> None:
        """A row of several states names the error conditions of one name of all of them."""
        for places in grouped((use.place, use.of) for use in self.found.uses).values():
            named = (self.symbol_at(key_of(of)) for of in dict.fromkeys(places))
            errors = [each for each in named if each and each.kind == "error condition"]
            for other in errors[1:]:
                errors[0].join(other)

    # Texts and values.

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

    def value_at(self, path: str, offset: int) -> tuple[Route, TextNode, bool] | None:
        """The key or the text at a place: its route, where it stands, and whether it is the key."""
        source = self.sources.get(path)
        for route, key, node in source.nodes if source else ():
            if key is not None and key.start <= offset <= key.end:
                return route, key, True
            if node.scalar is not None and node.start <= offset <= node.end:
                return route, node, False
        return None

    def part_at(self, path: str, offset: int) -> tuple[Meaning, Expr] | None:
        """The smallest part of a typed expression at a place, with the meaning of the whole."""
        for (file, route), meaning in self.meanings.items():
            if file != path or meaning.expr is None:
                continue
            start, end = self.offsets(Place(path, route))
            if start <= offset <= end:
                value = Place(path, route)
                spans = (
                    (part, self.offsets(value.within(*part.span))) for part in walk(meaning.expr)
                )
                parts = (part for part, (first, last) in spans if first <= offset <= last)
                return meaning, min(parts, key=_size, default=meaning.expr)
        return None

    # Symbols and their names.

    def symbol_at(self, key: SymbolKey | None) -> Symbol | None:
        """The symbol that is defined at a place; a member of an enum is a step below its type."""
        path, route = key or ("", ())
        file = self.files.get(path)
        if file is None or route in file.by_route or route[:1] != ("types",) or len(route) != 3:
            return file.by_route.get(route) if file else None
        return file.top.get(("member", f"{route[1]}.{route[2]}"))

    def counterpart(self, symbol: Symbol) -> Symbol | None:
        """The symbol that this index has for one of another index."""
        file = self.files.get(symbol.place.file)
        if file is None:
            return None
        named = file.top.get((symbol.kind, symbol.qualified))
        found = file.by_route.get(symbol.place.route, named)
        return found if found is not None and found.kind == symbol.kind else None

    def visible(self, path: str, owner: Route) -> Iterator[Symbol]:
        """The symbols that a text in a subsystem of a file may name, innermost first."""
        files = self.files
        if path in files and owner and not is_device(owner):
            yield from files[path].by_owner.get(owner, {}).values()
        for file in reachable((path,), lambda file: files[file].uses if file in files else ()):
            own = files[file].top.values() if file in files else ()
            yield from (symbol for symbol in own if file == path or symbol.kind != "parameter")

    def name_at(self, path: str, offset: int) -> Occurrence | None:
        """The name at a place; the place behind its last character counts too."""
        found = [o for o in self.occurrences(path) if o.start <= offset <= o.end]
        return min(found, key=lambda o: (o.end - o.start, o.end == offset), default=None)

    def occurrences_of(self, symbols: Iterable[Symbol]) -> Iterator[tuple[str, Occurrence]]:
        """Every place, in any file, that defines or names one of some symbols."""
        wanted = set(symbols)
        for source in self.sources:
            for occurrence in self.occurrences(source.path):
                if occurrence.symbol in wanted:
                    yield source.path, occurrence

    def occurrences(self, path: str) -> tuple[Occurrence, ...]:
        """All names of symbols in a file, in no particular order."""
        source = self.sources.get(path)
        if source is None:
            return ()
        if path not in self._occurrences:
            found = [*self._definitions(path), *self._uses(source), *self._keys(source)]
            self._occurrences[path] = tuple(
                Occurrence(
                    *source.offsets(place), symbol, place, place == defined, type_ or symbol.type
                )
                for symbol, place, defined, type_ in found
            )
        return self._occurrences[path]

    def _definitions(self, path: str) -> Iterator[_Name]:
        """The definitions themselves; members of enums stand in the texts of types."""
        own = self.files[path]
        members = (symbol for symbol in own.top.values() if symbol.kind == "member")
        for symbol in (*own.by_route.values(), *members):
            yield symbol, symbol.place, symbol.place, None

    def _uses(self, source: SourceFile) -> Iterator[_Name]:
        """The names that resolving looked up; a variable lives in its text only."""
        variables: dict[Place, Symbol] = {}
        for use in dict.fromkeys(self._looked_up(source)):
            if use.of.start is None:
                key = key_of(use.of)
                symbol = self.symbol_at(self._peers.get(key, key))
            else:
                name = (source.scalar(use.of) or "")[use.of.start : use.of.end]
                own = Symbol("variable", name, use.of, split_at_part(use.of.route)[0], name)
                symbol = variables.setdefault(use.of, own)
                symbol.type = symbol.type or use.type
            if symbol is not None:
                yield symbol, use.place, use.of, use.type

    def _looked_up(self, source: SourceFile) -> Iterator[Use]:
        """What resolving knows of the names in a file.

        The texts of many have a `{i}` for their index, before which alone names stand in place.
        """
        path = source.path
        yield from (use for use in self.found.uses if use.place.file == path)
        texts = [(m.where, m.text, uses_in(m)) for (f, _), m in self.meanings.items() if f == path]
        types = (t for t in self.found.types if t.where.file == path)
        texts += [(t.where, t.text, uses_in_type(t)) for t in types]
        for where, text, uses in texts:
            written = source.scalar(where.place) or ""
            for use in uses:
                here = slice(use.place.start, use.place.end)
                if text[here] == written[here]:
                    yield use

    def _keys(self, source: SourceFile) -> Iterator[_Name]:
        """What the model knows of keys: the ends of buffers, and parts of `irp.E.m.c_d`."""
        for route, key, _ in source.nodes:
            match split_at_part(route)[1] if key else ():
                case ("x" | "y", str()):
                    symbol = self.symbol_at(self._peers.get((source.path, route)))
                    if symbol is not None:
                        yield symbol, Place(source.path, route, "key"), None, None
                case ("plant", "bind", str(name)):
                    element = self._bindings.get((source.path, route))
                    yield from self._of_device(Place(source.path, route, "key"), name, element)
        for place, element in self._disturbed:
            if place.file == source.path:
                yield from self._of_device(place, source.scalar(place) or "", element)

    def _of_device(self, place: Place, text: str, key: SymbolKey | None) -> Iterator[_Name]:
        """What the parts of `irp.E.m.c_d` stand for, with the key of the element if it is known.

        Of an element of the panel the last part may stand alone.
        """
        parts = [*_PART.finditer(text)]
        element = self.symbol_at(key)
        if len(parts) == 1 and element is not None:
            yield element, place, None, None
        elif len(parts) == 4:
            owner = (element.place.file, element.owner) if element else None
            agents = self.system.agents if self.system else ()
            agent = next((key_of(a.place) for a in agents if a.name == parts[0][0]), None)
            named = self.symbol_at(agent), None, self.symbol_at(owner), element
            for part, symbol in zip(parts, named, strict=True):
                if symbol is not None:
                    yield symbol, replace(place, start=part.start(), end=part.end()), None, None


_Name = tuple[Symbol, Place, Place | None, Type | None]
"""A symbol, where it is named, where it is defined, and its type there."""


def _size(expr: Expr) -> int:
    return expr.span[1] - expr.span[0]


def key_of(place: Place) -> SymbolKey:
    """The key of a definition."""
    return place.file, place.route
