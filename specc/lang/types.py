"""Texts of types, signatures and interfaces: `vector[6, rad]`, `(q: Motors) -> pose[B, E]`."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal, NamedTuple

from specc.diagnostics.nearest import nearest
from specc.lang.builtins import RESERVED
from specc.lang.errors import ExprError, did_you_mean, unknown_name
from specc.lang.names import unit_error
from specc.lang.parse import LONGEST, parse_syntax, span
from specc.model import types as t
from specc.model.types import Type
from specc.model.units import UNITS, Unit, UnitError, unit_of

MakeType = Callable[[tuple[t.Frame, ...]], t.Type]
"""Makes a named type for the frames given to it; raises `ExprError` if they do not suit it."""

LARGEST_SIZE = 100_000
_PLAIN: dict[str, t.Type] = {
    "bool": t.Bool(),
    "int": t.Int(),
    "real": t.Real(),
    "text": t.Text(),
    "file": t.File(),
}
_USAGE = {
    "real": "real[m/s]",
    "vector": "vector[6, rad]",
    "spatial": "spatial[E, kg/s, kg*m**2/s]",
    "wrench": "wrench[E]",
    "twist": "twist[E]",
    "pose": "pose[B, E]",
    "point": "point[B]",
    "image": "image[480, 640, 3]",
    "enum": "enum[open, closed]",
    "list": "list[pose[B, E]]",
    "nonempty": "nonempty[pose[B, E]]",
    "optional": "optional[pose[B, E]]",
    "partial": "partial[wrench[E]]",
}

SYNTAX = {**dict.fromkeys(_PLAIN, ""), **_USAGE}
"""The types of the language, with how those that take something are spelt."""
TYPE_WORDS = frozenset(SYNTAX) - {"point"}
"""Names of the language; a specification gives them to no type of its own.

Version 1 had no points: a type of that name is the one that is meant.
"""

_FOREIGN_TYPES = {
    **dict.fromkeys(("float", "double", "float32", "float64", "number"), "real"),
    **dict.fromkeys(("string", "str"), "text"),
    **dict.fromkeys(("integer", "int32", "int64", "uint8"), "int"),
    "boolean": "bool",
    "array": "vector",
}
"""What other languages call the types."""


@dataclass(frozen=True)
class TypeNames:
    """Frames and named types that type texts may use."""

    frames: Mapping[str, t.Frame] = field(default_factory=dict)
    """Frame as it is spelt -> frame that it stands for (a parameter stands for another)."""
    types: Mapping[str, MakeType] = field(default_factory=dict)
    sizes: Mapping[str, int] = field(default_factory=dict)
    """Parameters that may stand for the size of a vector or an image."""
    variables_allowed: bool = False
    """In signatures an undeclared frame is a variable, `?X`."""


def parse_type(text: str, names: TypeNames) -> t.Type:
    """Parse a type; raises `ExprError` with offsets into it."""
    try:
        tree = parse_syntax(text)
    except ExprError as error:
        raise _as_type_error(error) from None
    return TypeReader(names).type(tree)


def _as_type_error(error: ExprError) -> ExprError:
    """Reword an error about an expression as one about a type."""
    if error.code == "E0303":
        message = error.message.replace("expression", "type")
        help = "name a part of it under `types:`"
        return ExprError(message, error.start, error.end, help, "E0303")
    help = f"for example `{_USAGE['vector']}` or `{_USAGE['pose']}`"
    return ExprError("this is not a type", error.start, error.end, help, "E0306")


def name_and_arguments(node: ast.expr) -> tuple[str, list[ast.expr]]:
    """A name and what it has in brackets, as in `pose[B, E]`; no name if it is anything else."""
    match node:
        case ast.Name(id=name):
            return name, []
        case ast.Subscript(value=ast.Name(id=name), slice=ast.Tuple(elts=items)):
            return name, items
        case ast.Subscript(value=ast.Name(id=name), slice=item):
            return name, [item]
    return "", []


@dataclass(frozen=True, slots=True)
class TypeReader:
    """Reads the trees of types."""

    names: TypeNames

    def type(self, node: ast.expr) -> t.Type:
        """The type that a tree spells."""
        name, args = name_and_arguments(node)
        if not name:
            raise self._error(node, "this is not a type", f"for example `{_USAGE['vector']}`")
        is_plain = isinstance(node, ast.Name)
        return self._named(node, name, args) if is_plain else self._applied(node, name, args)

    def _named(self, node: ast.expr, name: str, args: list[ast.expr]) -> t.Type:
        if name in _PLAIN and not args:
            return _PLAIN[name]
        make = self.names.types.get(name)
        if make is None:
            raise self._unknown(node, name)
        frames = tuple(self.frame(arg) for arg in args)
        try:
            return make(frames)
        except ExprError as error:
            raise ExprError(error.message, *span(node), error.help, error.code) from None

    def _applied(self, node: ast.expr, name: str, args: list[ast.expr]) -> t.Type:
        if name == "enum":
            return self._enum(args)
        shape = SHAPES.get(name)
        is_right = shape is not None and shape.needed <= len(args) <= len(shape.takes)
        if shape is not None and is_right and name not in self.names.types:
            given = zip(shape.takes, args, strict=False)
            return shape.make(*(_READERS[kind](self, arg) for kind, arg in given))
        if name in TYPE_WORDS or (name not in self.names.types and name in _USAGE):
            usage = f"it is spelt like `{_USAGE[name]}`" if name in _USAGE else "it takes nothing"
            raise self._error(node, f"`{name}` does not take these in brackets", usage)
        return self._named(node, name, args)

    def _layers(self, node: ast.expr) -> int:
        layers = self._size(node)
        if layers in (1, 3):
            return layers
        help = f"for example `{_USAGE['image']}`"
        raise self._error(node, "an image has 3 channels, a depth map 1", help)

    def _non_optional(self, node: ast.expr) -> t.Type:
        value = self.type(node)
        if isinstance(value, t.OptionalOf):
            raise self._error(node, f"{value} may be None already", "leave one optional[...] out")
        return value

    def _partial_base(self, node: ast.expr) -> t.Type:
        value = self.type(node)
        match value:
            case t.Spatial() | t.Vector(element=t.Real(), frame=""):
                return value
        help = "vectors of reals and spatial vectors have components that may be missing"
        raise self._error(node, f"a `{value}` is there as a whole or not at all", help)

    def _element(self, node: ast.expr) -> t.Real | t.Enum | t.Int | t.Bool:
        name = node.id if isinstance(node, ast.Name) else ""
        if name in self.names.types or name in _PLAIN or name_and_arguments(node)[0] == "enum":
            type = self.type(node)
            if isinstance(type, (t.Real, t.Enum, t.Int, t.Bool)):
                return type
            raise self._error(
                node, f"a vector has no `{type}` components", "any items are allowed in a list"
            )
        return t.Real(self._unit(node))

    def _unit(self, node: ast.expr) -> Unit:
        try:
            unit = unit_of(node)
        except UnitError as error:
            raise unit_error(error, span(node)[1], "`m/s` or `kg*m**2`") from None
        if unit.is_coherent:
            return unit.coherent()
        message = "a type has SI units; only literals have others"
        raise ExprError(message, *span(node), f"write `{unit}`", "E0305")

    def frame(self, node: ast.expr) -> t.Frame:
        """The frame that a tree names."""
        if not isinstance(node, ast.Name):
            raise self._error(node, "a frame is a name", "declare it under `frames:`")
        known = self.names.frames
        if node.id in known:
            return known[node.id]
        if self.names.variables_allowed:
            return f"?{node.id}"
        raise unknown_name(
            "frame", node.id, known, "declare it under `frames:`", span(node), "E0201"
        )

    def _size(self, node: ast.expr) -> int:
        match node:
            case ast.Constant(value=int(size)) if type(size) is int and is_size(size):
                return size
            case ast.Name(id=name) if name in self.names.sizes:
                return self.names.sizes[name]
            case ast.Name(id=name) if name not in UNITS:
                close = nearest(name, self.names.sizes)
                help = did_you_mean(close) or _SIZE_PARAMETER.format(name)
                message = f"`{name}` is not a size: that is {A_SIZE}, or a parameter"
                error = ExprError(message, *span(node), help, "E0306")
                raise error.set_repair(name, close)
        message = f"a size is {A_SIZE}"
        help = f"for example `{_USAGE['vector']}` or `{_USAGE['image']}`"
        if isinstance(node, ast.Name):
            help = f"for example `vector[6, {node.id}]`; {_NAMED_SIZE.format(node.id)}"
        raise self._error(node, message, help)

    def _enum(self, nodes: list[ast.expr]) -> t.Enum:
        members: list[str] = []
        for node in nodes:
            if not isinstance(node, ast.Name):
                raise self._error(
                    node, "a member of an enum is a name", f"for example `{_USAGE['enum']}`"
                )
            if node.id in members or node.id in RESERVED:
                why = "stands twice" if node.id in members else "is a name of the language"
                raise self._error(node, f"`{node.id}` {why}", "choose another name")
            members.append(node.id)
        return t.Enum("", tuple(members))

    def _unknown(self, node: ast.expr, name: str) -> ExprError:
        if name in _USAGE:
            return self._error(
                node, f"`{name}` is not complete", f"it is spelt like `{_USAGE[name]}`"
            )
        known = [*self.names.types, *_PLAIN, *_USAGE]
        start = span(node)[0]
        at = start, start + len(name)
        ours = [ours for word, ours in _FOREIGN_TYPES.items() if word == name.lower()]
        return unknown_name("type", name, known, "declare it under `types:`", at, "E0233", ours)

    def _error(self, node: ast.expr, message: str, help: str = "") -> ExprError:
        return ExprError(message, *span(node), help, "E0306")


A_SIZE = f"a whole number from 1 to {LARGEST_SIZE}"
_NAMED_SIZE = "a description may have `parameters: {{{}: int}}`"
_SIZE_PARAMETER = f"write the number; {_NAMED_SIZE}"


def is_size(number: float) -> bool:
    """Whether a vector may have so many components."""
    return number == int(number) and 0 < number <= LARGEST_SIZE


TypeArgument = Literal["frame", "size", "layers", "unit", "element", "type", "present", "complete"]


@dataclass(frozen=True, slots=True)
class Shape:
    """What a type takes in brackets, of which the first so many are needed, and what it is then."""

    takes: tuple[TypeArgument, ...]
    make: Callable[..., t.Type]
    needed: int = 1


def _of_kind(kind: str) -> Callable[[t.Frame], t.Type]:
    return lambda frame: t.Spatial(frame, *t.SPATIAL_KINDS[kind])


SHAPES = {
    "real": Shape(("unit",), t.Real),
    "list": Shape(("type",), t.ListOf),
    "nonempty": Shape(("type",), partial(t.ListOf, nonempty=True)),
    "optional": Shape(("present",), t.OptionalOf),
    "partial": Shape(("complete",), t.PartialOf),
    "vector": Shape(("size", "element"), lambda size, of=_PLAIN["real"]: t.Vector(size, of)),
    "pose": Shape(("frame", "frame"), t.Pose, needed=2),
    "point": Shape(("frame",), t.point),
    "wrench": Shape(("frame",), _of_kind("wrench")),
    "twist": Shape(("frame",), _of_kind("twist")),
    "spatial": Shape(("frame", "unit", "unit"), t.Spatial, needed=3),
    "image": Shape(("size", "size", "layers"), lambda h, w, of=1: t.Image(h, w, of), needed=2),
}
"""Types that have something in brackets; the members of an enum are not limited in number."""
_READERS: dict[TypeArgument, Callable[[TypeReader, ast.expr], Any]] = {
    "frame": TypeReader.frame,
    "size": TypeReader._size,
    "layers": TypeReader._layers,
    "unit": TypeReader._unit,
    "element": TypeReader._element,
    "type": TypeReader.type,
    "present": TypeReader._non_optional,
    "complete": TypeReader._partial_base,
}


# Signatures of operators: `(q: vector[6, rad], arm: Arm) -> pose[B, E]`.


_EXAMPLE = "for example `(q: vector[6, rad]) -> pose[B, E]`"
_MARKS = re.compile(r"[\[\](){},]")


class Signature(NamedTuple):
    """Named parameters and the result; frame variables start with a question mark."""

    parameters: tuple[tuple[str, Type], ...]
    result: Type


def parse_signature(text: str, names: TypeNames) -> Signature:
    """Parse a signature; raises `ExprError` with offsets into it."""
    stretches, (start, end) = signature_parts(text)
    parameters = _named_types(text, stretches, names)
    result = _type(text, start, end, names)
    _check_variables(parameters, result, start, end)
    return Signature(tuple(parameters.items()), result)


def parse_parameters(text: str, names: TypeNames) -> dict[str, Type]:
    """Parse a signature without a result; raises `ExprError` with offsets into it."""
    stretches, end = parameter_parts(text)
    if rest := text[end:].strip():
        message = "a behaviour or function has no result"
        raise ExprError(message, end, len(text), f"leave out `{rest}`", "E0306")
    return _named_types(text, stretches, names)


def _named_types(
    text: str, stretches: Iterable[tuple[int, int]], names: TypeNames
) -> dict[str, Type]:
    """The types of parameters, each written as a name, a colon and a type."""
    parameters: dict[str, Type] = {}
    for first, last in stretches:
        before, colon, _ = text[first:last].partition(":")
        name = before.strip()
        if not colon or not name.isidentifier():
            raise _error("a parameter is a name, a colon and a type", first, last)
        type = _type(text, first + len(before) + 1, last, names)
        if name in parameters:
            raise _error(f"parameter `{name}` stands twice", first, last)
        parameters[name] = type
    return parameters


def signature_parts(text: str) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """The spans of the parameters and the result of a signature; raises `ExprError`."""
    parameters, end = parameter_parts(text)
    arrow = end + len(text[end:]) - len(text[end:].lstrip())
    if not text.startswith("->", arrow):
        raise _error("a signature has its result after `->`", arrow, len(text))
    return parameters, (arrow + 2, len(text))


def parameter_parts(text: str) -> tuple[list[tuple[int, int]], int]:
    """The spans of what stands in the first brackets, and their end; raises `ExprError`."""
    if len(text) > LONGEST:
        message = f"the signature has {len(text)} characters; at most {LONGEST} are read"
        raise _error(message, LONGEST, len(text))
    opening = len(text) - len(text.lstrip())
    closing = _closing(text, opening)
    return list(_separated(text, opening + 1, closing)), closing + 1


def _error(message: str, start: int, end: int) -> ExprError:
    return ExprError(message, min(start, end), end, _EXAMPLE, "E0306")


def _closing(text: str, opening: int) -> int:
    """The offset of the bracket that closes the parameters of a signature."""
    if not text.startswith("(", opening):
        raise _error("a signature starts with its parameters in brackets", opening, len(text))
    for offset, _, depth in _levels(text, opening, len(text)):
        if depth == 0:
            return offset
    raise _error("the bracket is not closed", opening, len(text))


def _levels(text: str, start: int, end: int) -> Iterator[tuple[int, str, int]]:
    """Yield every bracket and comma with the number of brackets that are open after it."""
    depth = 0
    for found in _MARKS.finditer(text, start, end):
        char = found[0]
        depth += (char in "[({") - (char in "])}")
        yield found.start(), char, depth


def _separated(text: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """Yield the spans between commas outside of brackets."""
    if not text[start:end].strip():
        return
    for offset, char, depth in _levels(text, start, end):
        if char == "," and depth == 0:
            yield start, offset
            start = offset + 1
    yield start, end


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


SAME = "same"
"""In the place of an interface: the elements of the other end."""


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
    """Parse the use of an interface; raises `ExprError` with offsets into it.

    `interfaces` says which frames and types each one takes.
    """
    try:
        tree = parse_syntax(text)
    except ExprError as error:
        raise ExprError(_NO_INTERFACE, error.start, error.end, _INTERFACE, "E0237") from None
    name, args = name_and_arguments(tree)
    if not name:
        raise ExprError(_NO_INTERFACE, 0, len(text), _INTERFACE, "E0237")
    if name == SAME and name not in interfaces:
        message, help = f"`{SAME}` takes nothing in brackets", f"write `{SAME}`"
        raise ExprError(message, *span(tree), help, "E0237")
    if name not in interfaces:
        start = span(tree)[0]
        at = start, start + len(name)
        way = "declare it under `interfaces:`"
        raise unknown_name("interface", name, [*interfaces, SAME], way, at, "E0201")
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


NameKind = Literal["type", "interface", "frame", "argument", "size"]


@dataclass(frozen=True, slots=True)
class NameMention:
    """A name in a text, by its position; an argument of an interface is a frame or a type."""

    kind: NameKind
    name: str
    start: int
    end: int


TextForm = Literal["type", "signature", "parameters", "interface"]


def names_of(form: TextForm, text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the text of a type, of a signature or of an interface with its arguments."""
    return _READ[form](text, types)


def names_of_type(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the text of a type; `types` tells type names from units.

    A text that cannot be read has none, here and below.
    """
    tree = _tree(text)
    if tree is not None:
        yield from _in_type(tree, types)


def names_of_signature(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the types of a signature."""
    try:
        parts, result = signature_parts(text)
    except ExprError:
        return
    yield from _in_stretches(text, [*_typed_stretches(text, parts), result], types)


def names_of_parameters(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the types of a signature without a result."""
    try:
        parts, _ = parameter_parts(text)
    except ExprError:
        return
    yield from _in_stretches(text, _typed_stretches(text, parts), types)


def _typed_stretches(text: str, parts: Iterable[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """The spans of the types of parameters."""
    return ((text.find(":", first, last) + 1, last) for first, last in parts)


def _in_stretches(
    text: str, stretches: Iterable[tuple[int, int]], types: Collection[str]
) -> Iterator[NameMention]:
    for first, last in stretches:
        for found in names_of_type(text[first:last], types):
            yield NameMention(found.kind, found.name, found.start + first, found.end + first)


def names_of_interface(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The interface that a buffer names, and the frames and types that it is given."""
    tree = _tree(text)
    name, items = name_and_arguments(tree) if tree is not None else ("", [])
    if tree is not None and name:
        yield _head_mention("interface", tree, name)
    for item in items:
        if isinstance(item, ast.Name):
            yield _mention("argument", item)
        else:
            yield from _in_type(item, types)


_READ = {
    "type": names_of_type,
    "signature": names_of_signature,
    "parameters": names_of_parameters,
    "interface": names_of_interface,
}


def _tree(text: str) -> ast.expr | None:
    try:
        return parse_syntax(text)
    except ExprError:
        return None


def _in_type(node: ast.expr, types: Collection[str]) -> Iterator[NameMention]:
    name, items = name_and_arguments(node)
    if name in types:
        yield _head_mention("type", node, name)
        yield from (m for item in items for m in _plain_mention("frame", item))
    elif name in SHAPES:
        for parameter, item in zip(SHAPES[name].takes, items, strict=False):
            if parameter == "frame" or parameter == "size":
                yield from _plain_mention(parameter, item)
            else:
                yield from _in_type(item, types)


def _head_mention(kind: NameKind, node: ast.expr, name: str) -> NameMention:
    """The name with which a text begins."""
    start = span(node)[0]
    return NameMention(kind, name, start, start + len(name))


def _plain_mention(kind: NameKind, node: ast.expr) -> Iterator[NameMention]:
    if isinstance(node, ast.Name):
        yield _mention(kind, node)


def _mention(kind: NameKind, node: ast.Name) -> NameMention:
    return NameMention(kind, node.id, *span(node))
