"""The symbols that a file defines, and how a name finds one: from the text alone."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from specc.lang import ExprError
from specc.lang.parse import parse_syntax, span
from specc.model.types import Type
from specc.reachable import reachable
from specc.schema.keys import SymbolKind
from specc.schema.places import defined_by, is_device, split
from specc.source import Place, Route, SourceFile, beside

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
