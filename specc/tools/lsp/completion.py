"""What could stand at the cursor."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from specc.lang import ExprError, ExprErrors, Scope
from specc.lang.builtins import BUILTIN_NAMES
from specc.lang.errors import CLOCK_NAMES
from specc.lang.types import SYNTAX
from specc.lang.typing import expression
from specc.model.types import (
    Enum,
    Record,
    Type,
)
from specc.model.units import UNITS
from specc.resolve.definitions import may_be_size
from specc.resources import LIBRARY, library_parts
from specc.schema.keys import Role, RoleForm, SymbolKind
from specc.schema.places import defined_by, keys_at, names_used_file, role_of, split, values_at
from specc.source import Route, beside
from specc.tools.lsp.cursor import TextCursor, cursors, outside
from specc.tools.lsp.describe import describe_symbol
from specc.tools.lsp.formulas import WORDS, following
from specc.tools.lsp.index import Index
from specc.tools.lsp.symbols import Symbol

# What can be written at the end of an unfinished expression or type.


_UNIT = re.compile(r"\d\s*\[(?:[^\]]*[*/\s(])?(\w*)$")
_PEER = re.compile(r"(?<![\w.])x\s*\.\s*(\w*)$")
_ELEMENT = re.compile(r"(?<![\w.])x\s*\.\s*(\w+)\s*\.\s*(\w*)$")
_PART = re.compile(r"\.(\w*)$")
_ASKED = re.compile(r"\b(?:fresh|present|age|late)\(\s*(\w*)$")
_COMPARED = re.compile(r"(?:[=!]=\s*|\bin\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_NAME = re.compile(r"[^\W\d]?\w*$")
_HEAD = re.compile(r"(\w+)\s*\[[^\[\]]*$")

_CONSTANTS: tuple[SymbolKind, ...] = ("parameter", "constant", "file", "operator", "member")
_VISIBLE: dict[RoleForm, tuple[SymbolKind, ...]] = {
    "constant": _CONSTANTS,
    "argument": _CONSTANTS,
    "initial": _CONSTANTS,
    "full": ("memory", "let", *_CONSTANTS),
}
PARAMETER_TYPES = {"frame": "", "agent": ""}
"""Types that only parameters have."""


@dataclass(frozen=True, slots=True)
class Completion:
    """A proposal, and how many characters before the cursor it replaces.

    With `name_only` these are the name there, else also the path that the name ends.
    """

    label: str
    kind: str
    detail: str = ""
    words: str = ""
    name_only: bool = False
    replaces: int = 0
    suffix: str = ""
    """What follows it."""


_BUFFERS = Completion("x", "inputs", "input buffers")


def complete_expression(
    index: Index, path: str, owner: Route, form: RoleForm, before: str
) -> Iterator[Completion]:
    """Proposals behind `before`, the beginning of an expression."""
    inputs = form in ("initial", "full")
    if _UNIT.search(before):
        yield from (Completion(unit, "unit") for unit in UNITS)
    elif found := _ELEMENT.search(before):
        if inputs:
            yield from _elements(index, path, owner, found.group(1))
    elif _PEER.search(before):
        if inputs:
            yield from _peers(index, path, owner)
    elif found := _PART.search(before):
        value = _postfix(before[: found.start()])
        type_ = _type_of(index, path, owner, value) if value else None
        yield from _parts(type_)
    elif inputs and _ASKED.search(before):
        yield _BUFFERS
    else:
        if found := _COMPARED.search(before):
            value = _postfix(before[: found.start()].rstrip())
            yield from _members(index, path, owner, value)
        yield from _names(index, path, owner, form)


def complete_type(index: Index, path: str, before: str) -> Iterator[Completion]:
    """Proposals behind `before`, the beginning of a type or a signature."""
    head = _HEAD.search(before)
    around = head.group(1) if head else ""
    symbols = list(index.visible(path, ()))
    if around in ("real", "spatial", "vector"):
        yield from (Completion(unit, "unit") for unit in UNITS)
    if around in ("vector", "image"):
        sizes = [symbol for symbol in symbols if _may_be_size(index, symbol)]
        yield from _of_kind(index, sizes, ("parameter",))
    if around not in ("real", "enum", "image"):
        frames = around not in ("", "vector", "list", "nonempty", "optional", "partial")
        yield from _of_kind(index, symbols, ("frame",) if frames else ("type",))
        if not frames:
            for label, usage in (SYNTAX | PARAMETER_TYPES).items():
                yield Completion(label, "type", usage)


def _may_be_size(index: Index, symbol: Symbol) -> bool:
    node = index.node(symbol.place.file, symbol.place.route)
    return symbol.kind == "parameter" and node is not None and may_be_size(node.scalar or "")


def _elements(index: Index, path: str, owner: Route, peer: str) -> Iterator[Completion]:
    for symbol in index.visible(path, owner):
        if symbol.kind == "element" and symbol.qualified.startswith(f"x.{peer}."):
            yield _item(index, symbol)


def _peers(index: Index, path: str, owner: Route) -> Iterator[Completion]:
    inputs = [s.qualified for s in index.visible(path, owner) if s.kind == "element"]
    peers = [name.split(".")[1] for name in inputs if name.startswith("x.")]
    yield from (Completion(peer, "subsystem") for peer in dict.fromkeys(peers))


def _names(index: Index, path: str, owner: Route, form: RoleForm) -> Iterator[Completion]:
    yield from _of_kind(index, index.visible(path, owner), _VISIBLE[form])
    yield from (Completion(name, "builtin") for name in BUILTIN_NAMES)
    if form == "full":
        yield from (Completion(name, "clock") for name in CLOCK_NAMES)
    if form in ("full", "initial"):
        yield _BUFFERS


def _members(index: Index, path: str, owner: Route, value: str) -> Iterator[Completion]:
    """The members that a value can be compared with; all of them if its type is not known yet."""
    type_ = _type_of(index, path, owner, value) if value else None
    for symbol in index.visible(path, owner):
        enum = symbol.qualified.partition(".")[0]
        fits = not isinstance(type_, Enum) or enum == type_.name
        if symbol.kind == "member" and fits:
            yield _item(index, symbol)


def _of_kind(
    index: Index, symbols: Iterable[Symbol], kinds: tuple[SymbolKind | None, ...]
) -> Iterator[Completion]:
    for symbol in symbols:
        if symbol.kind in kinds:
            yield _item(index, symbol)


def _item(index: Index, symbol: Symbol) -> Completion:
    detail = str(symbol.type or "")
    return Completion(symbol.name, symbol.kind, detail, describe_symbol(index, symbol))


def _parts(type_: Type | None) -> Iterator[Completion]:
    if isinstance(type_, Record):
        yield from (Completion(name, "field", str(inner)) for name, inner in type_.fields)
    elif type_ is not None:
        yield from (Completion(name, "component") for name in type_.names)


def _postfix(before: str) -> str:
    """The value at the end of a text that a dot may follow: names, calls and brackets."""
    others = (at + 1 for at, char in outside(before) if not (char.isalnum() or char in "_."))
    return before[next(others, 0) :]


def _type_of(index: Index, path: str, owner: Route, text: str) -> Type | None:
    """The type of a value in the widest scope of a subsystem."""
    scopes: list[Scope] = [
        meaning.scope
        for (file, route), meaning in index.meanings.items()
        if file == path and route[: len(owner)] == owner
    ]
    for scope in sorted(scopes, key=lambda s: len(s.lets) + len(s.memory), reverse=True)[:1]:
        try:
            return expression(text, scope).type
        except (ExprError, ExprErrors):
            return None
    return None


# What can be written at the cursor: keys, values and names of the structure.


_PATH = re.compile(rf"(?:{LIBRARY})?[\w.]*$")
_FIXED = {
    "initial condition": ("always", "otherwise"),
    "terminal condition": ("always", "never"),
    "error condition": ("never",),
}


def complete(index: Index | None, path: str, text: str, offset: int) -> list[Completion]:
    """Everything that can be written at an offset of a text, however unfinished that is."""
    found: dict[tuple[str, str], Completion] = {}
    for cursor in cursors(text, offset):
        suffix = ": " if cursor.is_key and not text[offset:].lstrip(" ").startswith(":") else ""
        for item in _items(index, path, cursor):
            word = (_NAME if item.name_only else _PATH).search(cursor.before)
            whole = replace(item, replaces=len(word.group()) if word else 0, suffix=suffix)
            found.setdefault((item.label, item.kind), whole)
    return list(found.values())


def _items(index: Index | None, path: str, cursor: TextCursor) -> Iterator[Completion]:
    if cursor.is_key:
        if index is not None:
            taken = set(cursor.siblings)
            yield from (i for i in _named_keys(index, path, cursor) if i.label not in taken)
        for key, words in keys_at(cursor.route).items():
            if key not in cursor.siblings and defined_by((*cursor.route, key)) is None:
                yield Completion(key, "key", "", words)
        return
    for value in values_at(cursor.route):
        yield Completion(value, "value")
    if names_used_file(cursor.route):
        yield from (Completion(name, "file") for name in library_parts())
    role = role_of(cursor.route)
    if index is not None and role is not None:
        yield from _values(index, path, cursor, role)


def _values(index: Index, path: str, cursor: TextCursor, role: Role) -> Iterator[Completion]:
    owner = split(cursor.route)[0]
    if role.form in ("type", "signature"):
        yield from _names_only(complete_type(index, path, cursor.before))
    elif role.form == "interface":
        inside = "[" in cursor.before
        kinds: tuple[SymbolKind, ...] = ("frame", "type") if inside else ("interface",)
        yield from _of_kind(index, index.visible(path, ()), kinds)
    elif role.form == "name":
        for word in _FIXED.get(role.kind or "", ()):
            yield Completion(word, "value")
        yield from _of_kind(index, index.visible(path, owner), (role.kind,))
    elif role.form == "task":
        yield from _task(index, role)
    elif role.form == "formula":
        yield from _formula(index, path, cursor.before)
    elif role.form != "path":
        found = complete_expression(index, path, owner, role.form, cursor.before)
        yield from _names_only(found)
        if role.form == "argument":
            yield from _of_kind(index, index.visible(path, ()), ("frame", "agent"))


def _names_only(found: Iterator[Completion]) -> Iterator[Completion]:
    return (replace(item, name_only=True) for item in found)


def _task(index: Index, role: Role) -> Iterator[Completion]:
    """Subsystems; states and memory of the one whose cycles are counted."""
    subsystems = index.system.subsystems if index.system else ()
    task = index.system.task if index.system else None
    counted = [s for s in subsystems if task and s.qualified_name == task.subsystem]
    names = {
        "subsystem": [s.qualified_name for s in subsystems],
        "state": [state.name for s in counted for state in s.states],
        "memory": [memory.name for s in counted for memory in s.memory],
    }
    for name in names[role.kind or ""]:
        yield Completion(name, role.kind or "")


def _formula(index: Index, path: str, before: str) -> Iterator[Completion]:
    """What may follow in a requirement."""
    if (found := following(before, index.paths)) is not None:
        yield from (Completion(name, "value", name_only=True) for name in found)
        return
    yield from _names_only(complete_expression(index, path, (), "constant", before))
    if not _UNIT.search(before):
        yield from _of_kind(index, index.visible(path, ()), ("let",))
        yield from (Completion(name, "agent") for name in index.paths.below(()))
        yield from (Completion(name, "operator") for name in WORDS)


def _named_keys(index: Index, path: str, cursor: TextCursor) -> Iterator[Completion]:
    """Keys that are names: targets of functions, elements of the other end, parameters."""
    owner, rest = split(cursor.route)
    symbols = list(index.visible(path, owner))
    match rest:
        case ("functions", _) | ("through",):
            yield from _of_kind(index, symbols, ("memory",))
            for symbol in symbols:
                if symbol.kind == "element" and symbol.qualified.startswith("y."):
                    yield replace(_item(index, symbol), label=symbol.qualified)
        case ("x" | "y", str(peer)):
            yield from _far_elements(index, path, (*owner, str(rest[0]), peer))
        case (*_, "with"):
            yield from _parameters(index, path, cursor)
        case ("plant", "bind"):
            yield from _device_elements(index)


def _far_elements(index: Index, path: str, route: tuple[str | int, ...]) -> Iterator[Completion]:
    """Elements that the other end of a connection has."""
    wire = index.links.wires.get((path, route))
    for element in wire.elements if wire else ():
        yield Completion(element.name, "element", str(element.type))


def _parameters(index: Index, path: str, cursor: TextCursor) -> Iterator[Completion]:
    user = index.node(path, cursor.route[:-1])
    used = user.values.get("use") if user else None
    file = index.files.get(beside(path, used.scalar)) if used and used.scalar else None
    yield from _of_kind(index, file.top.values() if file else (), ("parameter",))


def _device_elements(index: Index) -> Iterator[Completion]:
    for device in index.system.devices if index.system else ():
        for element in (*device.x, *device.y):
            name = f"{device.qualified_name}.{element.name}"
            yield Completion(name, "element", str(element.type), element.title)
