"""Signatures of operators: `(q: vector[6, rad], arm: Arm) -> pose[B, E]`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from specc.expr.errors import ExprError
from specc.expr.parse_types import TypeNames, parse_type
from specc.expr.unify import frames_of
from specc.model.types import Type

_EXAMPLE = "for example `(q: vector[6, rad]) -> pose[B, E]`"
_BRACKETS = {"[": "]", "(": ")", "{": "}"}


class Signature(NamedTuple):
    """Named parameters and the result; frame variables start with a question mark."""

    parameters: tuple[tuple[str, Type], ...]
    result: Type


def parse_signature(text: str, names: TypeNames) -> Signature:
    """The signature that a text spells; raises `ExprError` with offsets into it."""
    opening = len(text) - len(text.lstrip())
    closing = _closing(text, opening)
    arrow = closing + 1 + len(text[closing + 1 :]) - len(text[closing + 1 :].lstrip())
    if not text.startswith("->", arrow):
        raise _error("a signature has its result behind `->`", arrow, len(text))
    parameters: dict[str, Type] = {}
    for start, end in _separated(text, opening + 1, closing):
        name, type = _parameter(text, start, end, names)
        if name in parameters:
            raise _error(f"parameter `{name}` stands twice", start, end)
        parameters[name] = type
    result = _type(text, arrow + 2, len(text), names)
    _check_variables(parameters, result, arrow + 2, len(text))
    return Signature(tuple(parameters.items()), result)


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
    """Every character with the number of brackets that are open behind it."""
    depth = 0
    for place in range(start, end):
        char = text[place]
        depth += (char in _BRACKETS) - (char in _BRACKETS.values())
        yield place, char, depth


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
        raise error.moved(start) from None


def _check_variables(parameters: dict[str, Type], result: Type, start: int, end: int) -> None:
    given = {frame for type in parameters.values() for frame in frames_of(type)}
    for frame in frames_of(result):
        if frame.startswith("?") and frame not in given:
            message = f"frame `{frame[1:]}` is neither declared nor in a parameter"
            help = "declare it under `frames:`, or let an argument bring it"
            raise ExprError(message, start, end, help, "E0308")
