"""What could stand at the cursor."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

from specc.frozen import frozen
from specc.lang import ExprError, ExprErrors, Scope
from specc.lang.builtins import BUILTIN_NAMES
from specc.lang.errors import CLOCK_NAMES
from specc.lang.types import SPELT
from specc.lang.typing import expression
from specc.model.types import (
    Enum,
    Record,
    Type,
)
from specc.model.units import UNITS
from specc.resolve.definitions import may_be_size
from specc.schema.keys import Form, Role, SymbolKind
from specc.schema.places import defined_by, keys_at, role_of, split, values_at
from specc.source import Route
from specc.tools.lsp.cursor import Cursor, cursors
from specc.tools.lsp.describe import describe_symbol
from specc.tools.lsp.formulas import WORDS, following
from specc.tools.lsp.index import Index
from specc.tools.lsp.symbols import Symbol, beside

# What can be written at the end of an unfinished expression or type.


_UNIT = re.compile(r"\d\s*\[(?:[^\]]*[*/\s(])?(\w*)$")
_PEER = re.compile(r"(?<![\w.])x\s*\.\s*(\w*)$")
_ELEMENT = re.compile(r"(?<![\w.])x\s*\.\s*(\w+)\s*\.\s*(\w*)$")
_PART = re.compile(r"\.(\w*)$")
_ASKED = re.compile(r"\b(?:fresh|present|age|late)\(\s*(\w*)$")
_COMPARED = re.compile(r"(?:[=!]=\s*|\bin\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_NAME = re.compile(r"[^\W\d]?\w*$")
_HEAD = re.compile(r"(\w+)\s*\[[^\[\]]*$")
_OPENING = {")": "(", "]": "["}

_CONSTANTS: tuple[SymbolKind, ...] = ("parameter", "constant", "file", "operator", "member")
_VISIBLE: dict[Form, tuple[SymbolKind, ...]] = {
    "constant": _CONSTANTS,
    "argument": _CONSTANTS,
    "initial": _CONSTANTS,
    "full": ("memory", "let", *_CONSTANTS),
}
PARAMETER_TYPES = {"frame": "", "agent": ""}
"""Types that only parameters have."""


@frozen
class Item:
    """A proposal; `word` is what it goes on from, where that is not the word at the cursor."""

    label: str
    kind: str
    detail: str = ""
    words: str = ""
    word: str | None = None


def complete_expression(
    index: Index, path: str, owner: Route, form: Form, before: str
) -> Iterator[Item]:
    """Proposals behind `before`, the beginning of an expression."""
    inputs = form in ("initial", "full")
    if found := _UNIT.search(before):
        yield from (Item(unit, "unit", word=found.group(1)) for unit in UNITS)
    elif found := _ELEMENT.search(before):
        if inputs:
            yield from _elements(index, path, owner, *found.groups())
    elif found := _PEER.search(before):
        if inputs:
            yield from _peers(index, path, owner, found.group(1))
    elif found := _PART.search(before):
        value = _postfix(before[: found.start()])
        type_ = _type_of(index, path, owner, value) if value else None
        yield from _parts(type_, found.group(1))
    elif inputs and (found := _ASKED.search(before)):
        yield _buffers(found.group(1))
    else:
        if found := _COMPARED.search(before):
            value = _postfix(before[: found.start()].rstrip())
            yield from _members(index, path, owner, value, found.group(1))
        found = _NAME.search(before)
        yield from _names(index, path, owner, form, found.group() if found else "")


def complete_type(index: Index, path: str, before: str) -> Iterator[Item]:
    """Proposals behind `before`, the beginning of a type or a signature."""
    head = _HEAD.search(before)
    name = _NAME.search(before)
    word = name.group() if name else ""
    around = head.group(1) if head else ""
    symbols = list(index.visible(path, ()))
    if around in ("real", "spatial", "vector"):
        yield from (Item(unit, "unit", word=word) for unit in UNITS)
    if around in ("vector", "image"):
        sizes = [symbol for symbol in symbols if _may_be_size(index, symbol)]
        yield from _of_kind(index, sizes, ("parameter",), word)
    if around not in ("real", "enum", "image"):
        frames = around not in ("", "vector", "list", "nonempty", "optional", "partial")
        yield from _of_kind(index, symbols, ("frame",) if frames else ("type",), word)
        if not frames:
            for label, usage in (SPELT | PARAMETER_TYPES).items():
                yield Item(label, "type", usage, word=word)


def _may_be_size(index: Index, symbol: Symbol) -> bool:
    node = index.node(symbol.place.file, symbol.place.route)
    return symbol.kind == "parameter" and node is not None and may_be_size(node.scalar or "")


def _elements(index: Index, path: str, owner: Route, peer: str, word: str) -> Iterator[Item]:
    for symbol in index.visible(path, owner):
        if symbol.kind == "element" and symbol.qualified.startswith(f"x.{peer}."):
            yield _item(index, symbol, word)


def _peers(index: Index, path: str, owner: Route, word: str) -> Iterator[Item]:
    inputs = [s.qualified for s in index.visible(path, owner) if s.kind == "element"]
    peers = [name.split(".")[1] for name in inputs if name.startswith("x.")]
    yield from (Item(peer, "subsystem", word=word) for peer in dict.fromkeys(peers))


def _names(index: Index, path: str, owner: Route, form: Form, word: str) -> Iterator[Item]:
    yield from _of_kind(index, index.visible(path, owner), _VISIBLE[form], word)
    yield from (Item(name, "builtin", word=word) for name in BUILTIN_NAMES)
    if form == "full":
        yield from (Item(name, "clock", word=word) for name in CLOCK_NAMES)
    if form in ("full", "initial"):
        yield _buffers(word)


def _buffers(word: str) -> Item:
    return Item("x", "inputs", "input buffers", word=word)


def _members(index: Index, path: str, owner: Route, value: str, word: str) -> Iterator[Item]:
    """The members that a value can be compared with; all of them if its type is not known yet."""
    type_ = _type_of(index, path, owner, value) if value else None
    for symbol in index.visible(path, owner):
        enum = symbol.qualified.partition(".")[0]
        fits = not isinstance(type_, Enum) or enum == type_.name
        if symbol.kind == "member" and fits:
            yield _item(index, symbol, word)


def _of_kind(
    index: Index,
    symbols: Iterable[Symbol],
    kinds: tuple[SymbolKind | None, ...],
    word: str | None = None,
) -> Iterator[Item]:
    for symbol in symbols:
        if symbol.kind in kinds:
            yield _item(index, symbol, word)


def _item(index: Index, symbol: Symbol, word: str | None = None) -> Item:
    detail = str(symbol.type or "")
    return Item(symbol.name, symbol.kind, detail, describe_symbol(index, symbol), word)


def _parts(type_: Type | None, word: str) -> Iterator[Item]:
    if isinstance(type_, Record):
        yield from (Item(name, "field", str(inner), word=word) for name, inner in type_.fields)
    elif type_ is not None:
        yield from (Item(name, "component", word=word) for name in type_.names)


def _postfix(before: str) -> str:
    """The value at the end of a text that a dot may follow: names, calls and brackets."""
    at, open_brackets = len(before), []
    while at:
        char = before[at - 1]
        if char in _OPENING:
            open_brackets.append(_OPENING[char])
        elif open_brackets:
            if char == open_brackets[-1]:
                open_brackets.pop()
        elif not (char.isalnum() or char in "_."):
            break
        at -= 1
    return before[at:]


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


_WORD = re.compile(r"[\w.]*$")
_FIXED = {
    "initial condition": ("always", "otherwise"),
    "terminal condition": ("always", "never"),
    "error condition": ("never",),
}


@frozen
class Completion:
    """An item, how many characters before the cursor it replaces, and what follows it."""

    item: Item
    replaces: int
    suffix: str = ""


def complete(index: Index | None, path: str, text: str, offset: int) -> list[Completion]:
    """Everything that can be written at an offset of a text, however unfinished that is."""
    found: dict[tuple[str, str], Completion] = {}
    for cursor in cursors(text, offset):
        suffix = ": " if cursor.is_key and not text[offset:].lstrip(" ").startswith(":") else ""
        for item in _items(index, path, cursor):
            word = item.word if item.word is not None else _word(cursor.before)
            found.setdefault((item.label, item.kind), Completion(item, len(word), suffix))
    return list(found.values())


def _word(before: str) -> str:
    found = _WORD.search(before)
    return found.group() if found else ""


def _items(index: Index | None, path: str, cursor: Cursor) -> Iterator[Item]:
    if cursor.is_key:
        if index is not None:
            taken = set(cursor.siblings)
            yield from (i for i in _named_keys(index, path, cursor) if i.label not in taken)
        for key, words in keys_at(cursor.route).items():
            if key not in cursor.siblings and defined_by((*cursor.route, key)) is None:
                yield Item(key, "key", "", words)
        return
    for value in values_at(cursor.route):
        yield Item(value, "value")
    role = role_of(cursor.route)
    if index is not None and role is not None:
        yield from _values(index, path, cursor, role)


def _values(index: Index, path: str, cursor: Cursor, role: Role) -> Iterator[Item]:
    owner = split(cursor.route)[0]
    if role.form in ("type", "signature"):
        yield from complete_type(index, path, cursor.before)
    elif role.form == "interface":
        inside = "[" in cursor.before
        kinds: tuple[SymbolKind, ...] = ("frame", "type") if inside else ("interface",)
        yield from _of_kind(index, index.visible(path, ()), kinds)
    elif role.form == "name":
        for word in _FIXED.get(role.kind or "", ()):
            yield Item(word, "value")
        yield from _of_kind(index, index.visible(path, owner), (role.kind,))
    elif role.form == "task":
        yield from _task(index, role)
    elif role.form == "formula":
        yield from _formula(index, path, cursor.before)
    elif role.form != "path":
        yield from complete_expression(index, path, owner, role.form, cursor.before)
        if role.form == "argument":
            yield from _of_kind(index, index.visible(path, ()), ("frame", "agent"))


def _task(index: Index, role: Role) -> Iterator[Item]:
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
        yield Item(name, role.kind or "")


def _formula(index: Index, path: str, before: str) -> Iterator[Item]:
    """What may follow in a requirement."""
    paths = index.links.paths
    if (found := following(before, paths)) is not None:
        yield from (Item(name, "value", word=found[1]) for name in found[0])
        return
    yield from complete_expression(index, path, (), "constant", before)
    if not _UNIT.search(before):
        yield from _of_kind(index, index.visible(path, ()), ("let",))
        yield from (Item(name, "agent") for name in paths.below(()))
        yield from (Item(name, "operator") for name in WORDS)


def _named_keys(index: Index, path: str, cursor: Cursor) -> Iterator[Item]:
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


def _far_elements(index: Index, path: str, route: tuple[str | int, ...]) -> Iterator[Item]:
    """Elements that the other end of a connection has."""
    far = index.links.peers.get((path, route))
    direction = "y" if route[-2] == "x" else "x"
    file = index.files.get(far[0]) if far else None
    for symbol in file.inside.get(far[1], {}).values() if file and far else ():
        same_side = symbol.qualified.startswith(f"{route[-2]}.")
        device = symbol.qualified.count(".") == 1
        if symbol.kind == "element" and (device or not same_side):
            if device and not symbol.qualified.startswith(f"{direction}."):
                continue
            yield Item(symbol.name, "element", str(symbol.type or ""))


def _parameters(index: Index, path: str, cursor: Cursor) -> Iterator[Item]:
    user = index.node(path, cursor.route[:-1])
    used = user.values.get("use") if user else None
    file = index.files.get(beside(path, used.scalar)) if used and used.scalar else None
    yield from _of_kind(index, file.top.values() if file else (), ("parameter",))


def _device_elements(index: Index) -> Iterator[Item]:
    for device in index.system.devices if index.system else ():
        for element in (*device.x, *device.y):
            name = f"{device.qualified_name}.{element.name}"
            yield Item(name, "element", str(element.type), element.title)
