"""What can be written at the cursor: keys, values and names of the structure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.lsp.cursor import Cursor, cursors
from specc.lsp.describe import describe_symbol
from specc.lsp.expression_completion import Item, complete_expression, complete_type
from specc.lsp.index import Index
from specc.lsp.keys import keys_at, values_at
from specc.lsp.structure import Kind, Role, defined_by, role_of, split
from specc.lsp.symbols import Symbol, beside, node_at

_WORD = re.compile(r"[\w.]*$")
_FIXED = {
    "initial condition": ("always",),
    "terminal condition": ("always", "never"),
    "error condition": ("never",),
}


@dataclass(frozen=True, slots=True)
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
    elif role.form == "name":
        for word in _FIXED.get(role.kind or "", ()):
            yield Item(word, "value")
        yield from _symbols(index, index.visible(path, owner), (role.kind,))
    elif role.form == "task":
        yield from _task(index, role)
    elif role.form != "path":
        yield from complete_expression(index, path, owner, role.form, cursor.before)
        if role.form == "argument":
            yield from _symbols(index, index.visible(path, ()), ("frame",))


def _task(index: Index, role: Role) -> Iterator[Item]:
    names = {
        "subsystem": index.links.subsystems,
        "state": index.links.states,
        "memory": index.links.memory,
    }
    for name in names[role.kind or ""]:
        yield Item(name, role.kind or "")


def _symbols(
    index: Index, symbols: Iterable[Symbol], kinds: tuple[Kind | None, ...]
) -> Iterator[Item]:
    for symbol in symbols:
        if symbol.kind in kinds:
            words = describe_symbol(index, symbol)
            yield Item(symbol.name, symbol.kind, str(symbol.type or ""), words)


def _named_keys(index: Index, path: str, cursor: Cursor) -> Iterator[Item]:
    """Keys that are names: targets of functions, elements of the other end, parameters."""
    owner, rest = split(cursor.route)
    symbols = list(index.visible(path, owner))
    match rest:
        case ("functions", _):
            yield from _symbols(index, symbols, ("memory",))
            for symbol in symbols:
                if symbol.kind == "element" and symbol.qualified.startswith("y."):
                    words = describe_symbol(index, symbol)
                    yield Item(symbol.qualified, "element", str(symbol.type or ""), words)
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
    user = node_at(index.sources.get(path), cursor.route[:-1])
    used = user.values.get("use") if user else None
    file = index.files.get(beside(path, used.scalar)) if used and used.scalar else None
    yield from _symbols(index, file.top.values() if file else (), ("parameter",))


def _device_elements(index: Index) -> Iterator[Item]:
    for device in index.system.devices if index.system else ():
        for element in (*device.x, *device.y):
            name = f"{device.qualified_name}.{element.name}"
            yield Item(name, "element", str(element.type), element.title)
