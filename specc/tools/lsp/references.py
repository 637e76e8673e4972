"""Where symbols are referred to, across files and in Python."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from specc.model.system import Subsystem, System
from specc.model.types import Bool, Enum, Type, nested_types
from specc.model.wires import Wire, Wires
from specc.resolve.context import Use
from specc.schema.places import split
from specc.source import Place, Route, SourceFile
from specc.tools.lsp.symbols import (
    FileSymbols,
    Symbol,
    SymbolKey,
    share,
    symbol_at,
)

# Which names of a specification Python code relies on.


def enums_in_python(system: System) -> dict[str, str]:
    """Enums that reach Python code, which knows their members by name, each with that code."""
    found: dict[str, str] = {}
    for type_, code in _crossing(system):
        for part in nested_types([type_]):
            if isinstance(part, Enum):
                found.setdefault(part.name, code)
    return found


def _crossing(system: System) -> Iterator[tuple[Type, str]]:
    """Types of what goes to operators and to the functions of the plant, or comes from them."""
    for operator in system.operators:
        for type_ in (operator.result, *(type_ for _, type_ in operator.parameters)):
            yield type_, f"operator `{operator.name}`"
    for device in system.devices:
        for element in (*device.x, *device.y):
            yield element.type, f"the plant, by `{device.qualified_name}.{element.name}`"
    watched = system.task.watch if system.task else ()
    for subsystem in system.subsystems:
        for memory in subsystem.memory:
            if memory.name in watched:
                yield memory.type, "the judge of the task"


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
    for wire in wires.wires_of(subsystem):
        port = wire.port
        if wire.peer is None:
            continue
        links.wires.setdefault(key_of(port.place), wire)
        if named := wires.peer_place(subsystem, port):
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
