"""What can be written at the end of an unfinished expression or type."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from specc.expr import ExprError, ExprErrors, Scope
from specc.expr.scope import BUILTIN_NAMES, CLOCK_NAMES
from specc.expr.typing import expression
from specc.lsp.describe import describe_symbol
from specc.lsp.index import Index
from specc.lsp.structure import Form, Kind
from specc.lsp.symbols import Symbol
from specc.model.types import (
    SPATIAL_COMPONENTS,
    VECTOR3_COMPONENTS,
    Enum,
    Record,
    Spatial,
    Type,
    Vector,
)
from specc.model.units import UNITS
from specc.source import Route

_UNIT = re.compile(r"\d\s*\[(?:[^\]]*[*/\s(])?(\w*)$")
_PEER = re.compile(r"(?<![\w.])x\s*\.\s*(\w*)$")
_ELEMENT = re.compile(r"(?<![\w.])x\s*\.\s*(\w+)\s*\.\s*(\w*)$")
_PART = re.compile(r"\.(\w*)$")
_ASKED = re.compile(r"\b(?:fresh|present)\(\s*(\w*)$")
_COMPARED = re.compile(r"(?:[=!]=\s*|\bin\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_NAME = re.compile(r"[^\W\d]?\w*$")
_HEAD = re.compile(r"(\w+)\s*\[[^\[\]]*$")
_OPENING = {")": "(", "]": "["}

_CONSTANTS: tuple[Kind, ...] = ("parameter", "constant", "file", "operator", "member")
_VISIBLE: dict[Form, tuple[Kind, ...]] = {
    "constant": _CONSTANTS,
    "argument": _CONSTANTS,
    "initial": _CONSTANTS,
    "full": ("memory", "let", *_CONSTANTS),
}
TYPE_WORDS = {
    "bool": "",
    "int": "",
    "real": "real[m/s]",
    "text": "",
    "file": "",
    "vector": "vector[6, rad]",
    "spatial": "spatial[E, kg/s, kg*m**2/s]",
    "wrench": "wrench[E]",
    "twist": "twist[E]",
    "pose": "pose[B, E]",
    "image": "image[480, 640, 3]",
    "enum": "enum[open, closed]",
    "list": "list[pose[B, E]]",
    "frame": "",
}
"""The types of the language, with how those that take something are spelt."""


@dataclass(frozen=True, slots=True)
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
    if around not in ("real", "enum", "image"):
        frames = around not in ("", "list", "vector")
        yield from _of_kind(index, symbols, ("frame",) if frames else ("type",), word)
        if not frames:
            yield from (
                Item(label, "type", usage, word=word) for label, usage in TYPE_WORDS.items()
            )


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
    index: Index, symbols: Iterator[Symbol] | list[Symbol], kinds: tuple[Kind, ...], word: str
) -> Iterator[Item]:
    for symbol in symbols:
        if symbol.kind in kinds:
            yield _item(index, symbol, word)


def _item(index: Index, symbol: Symbol, word: str) -> Item:
    detail = str(symbol.type) if symbol.type else ""
    return Item(symbol.name, symbol.kind, detail, describe_symbol(index, symbol), word)


def _parts(type_: Type | None, word: str) -> Iterator[Item]:
    match type_:
        case Record():
            for name, inner in type_.fields:
                yield Item(name, "field", str(inner), word=word)
        case Spatial() | Vector(6):
            yield from (Item(name, "component", word=word) for name in SPATIAL_COMPONENTS)
        case Vector(3):
            yield from (Item(name, "component", word=word) for name in VECTOR3_COMPONENTS)


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
