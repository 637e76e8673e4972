"""What a buffer names: an interface with its frames and types, `Report[W, Status]`."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from specc.lang.errors import ExprError, unknown
from specc.lang.parse import parse_syntax, span
from specc.lang.types import TypeNames, TypeReader
from specc.model import types as t
from specc.model.types import Type


class InterfaceUse(NamedTuple):
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
    match tree:
        case ast.Name(id=name):
            args: tuple[ast.expr, ...] = ()
        case ast.Subscript(value=ast.Name(id=name), slice=inner):
            args = tuple(inner.elts) if isinstance(inner, ast.Tuple) else (inner,)
        case _:
            raise ExprError(_NO_INTERFACE, 0, len(text), _INTERFACE, "E0237")
    if name not in interfaces:
        start = span(tree)[0]
        at = start, start + len(name)
        way = "declare it under `interfaces:`"
        raise unknown("interface", name, interfaces, way, at, "E0236")
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
