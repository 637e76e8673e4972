"""Texts with types in them: signatures of operators, and interfaces with what they are given."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from specc.lang.errors import ExprError, unknown_name
from specc.lang.parse import LONGEST, parse_syntax, span
from specc.lang.types import TypeNames, TypeReader, name_and_arguments, parse_type
from specc.model import types as t
from specc.model.types import Type

# Signatures of operators: `(q: vector[6, rad], arm: Arm) -> pose[B, E]`.


_EXAMPLE = "for example `(q: vector[6, rad]) -> pose[B, E]`"
_MARKS = re.compile(r"[\[\](){},]")


class Signature(NamedTuple):
    """Named parameters and the result; frame variables start with a question mark."""

    parameters: tuple[tuple[str, Type], ...]
    result: Type


def parse_signature(text: str, names: TypeNames) -> Signature:
    """The signature that a text spells; raises `ExprError` with offsets into it."""
    stretches, (start, end) = signature_parts(text)
    parameters: dict[str, Type] = {}
    for first, last in stretches:
        name, type = _parameter(text, first, last, names)
        if name in parameters:
            raise _error(f"parameter `{name}` stands twice", first, last)
        parameters[name] = type
    result = _type(text, start, end, names)
    _check_variables(parameters, result, start, end)
    return Signature(tuple(parameters.items()), result)


def signature_parts(text: str) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Where the parameters of a signature stand and where its result; raises `ExprError`."""
    if len(text) > LONGEST:
        message = f"the signature has {len(text)} characters; at most {LONGEST} are read"
        raise _error(message, LONGEST, len(text))
    opening = len(text) - len(text.lstrip())
    closing = _closing(text, opening)
    arrow = closing + 1 + len(text[closing + 1 :]) - len(text[closing + 1 :].lstrip())
    if not text.startswith("->", arrow):
        raise _error("a signature has its result after `->`", arrow, len(text))
    return list(_separated(text, opening + 1, closing)), (arrow + 2, len(text))


def _error(message: str, start: int, end: int) -> ExprError:
    return ExprError(message, min(start, end), end, _EXAMPLE, "E0307")


def _closing(text: str, opening: int) -> int:
    """Where the bracket that opens a signature is closed."""
    if not text.startswith("(", opening):
        raise _error("a signature starts with its parameters in brackets", opening, len(text))
    for place, _, depth in _levels(text, opening, len(text)):
        if depth == 0:
            return place
    raise _error("the bracket is not closed", opening, len(text))


def _levels(text: str, start: int, end: int) -> Iterator[tuple[int, str, int]]:
    """Every bracket and comma with the number of brackets that are open behind it."""
    depth = 0
    for found in _MARKS.finditer(text, start, end):
        char = found[0]
        depth += (char in "[({") - (char in "])}")
        yield found.start(), char, depth


def _separated(text: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """The stretches between commas that stand in no bracket."""
    if not text[start:end].strip():
        return
    for place, char, depth in _levels(text, start, end):
        if char == "," and depth == 0:
            yield start, place
            start = place + 1
    yield start, end


def _parameter(text: str, start: int, end: int, names: TypeNames) -> tuple[str, Type]:
    name, colon, _ = text[start:end].partition(":")
    if not colon or not name.strip().isidentifier():
        raise _error("a parameter is a name, a colon and a type", start, end)
    return name.strip(), _type(text, start + len(name) + 1, end, names)


def _type(text: str, start: int, end: int, names: TypeNames) -> Type:
    try:
        return parse_type(text[start:end], names)
    except ExprError as error:
        raise error.shifted(start) from None


def _check_variables(parameters: dict[str, Type], result: Type, start: int, end: int) -> None:
    given = {frame for type in parameters.values() for frame in type.frames}
    for frame in result.frames:
        if frame.startswith("?") and frame not in given:
            message = f"frame `{frame[1:]}` is neither declared nor in a parameter"
            help = "declare it under `frames:`, or use it in the type of a parameter"
            raise ExprError(message, start, end, help, "E0308")


# What a buffer names: an interface with its frames and types, `Report[W, Status]`.


@dataclass(frozen=True, slots=True)
class InterfaceUse:
    """The name of an interface, with the frames and types that it is given."""

    name: str
    frames: tuple[t.Frame, ...]
    types: tuple[Type, ...]


def parse_interface(
    text: str,
    names: TypeNames,
    interfaces: Mapping[str, tuple[Sequence[str], Sequence[str]]],
) -> InterfaceUse:
    """The use of an interface that a text spells; raises `ExprError` with offsets into it.

    `interfaces` says which frames and types each one takes.
    """
    try:
        tree = parse_syntax(text)
    except ExprError as error:
        raise ExprError(_NO_INTERFACE, error.start, error.end, _INTERFACE, "E0237") from None
    name, args = name_and_arguments(tree)
    if not name:
        raise ExprError(_NO_INTERFACE, 0, len(text), _INTERFACE, "E0237")
    if name not in interfaces:
        start = span(tree)[0]
        at = start, start + len(name)
        way = "declare it under `interfaces:`"
        raise unknown_name("interface", name, interfaces, way, at, "E0236")
    frames, types = interfaces[name]
    if len(args) != len(frames) + len(types):
        usage = ", ".join((*frames, *types))
        takes = f"takes {usage}" if usage else "takes nothing in brackets"
        help = f"write `{name}[{usage}]` with frames and types of yours"
        help = help if usage else f"write `{name}`"
        raise ExprError(f"interface `{name}` {takes}", *span(tree), help, "E0237")
    reader = TypeReader(names)
    given = (reader.frame(arg) for arg in args[: len(frames)])
    return InterfaceUse(name, tuple(given), tuple(map(reader.type, args[len(frames) :])))


_NO_INTERFACE = "this is not the name of an interface"
_INTERFACE = "for example `Report` or `Report[W]`; or write the elements: `{status: bool}`"
