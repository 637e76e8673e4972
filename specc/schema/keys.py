"""What the schema is written in: kinds of values, keys with their roles, mappings of keys.

The class of a mapping says all that is known of its keys: annotations say what their values are,
`key` what they are for. The check of files, the formatter, the editor, `specc status` and the JSON
Schema read it there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType, NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    Union,
    get_args,
    get_origin,
)

SymbolKind = Literal[
    "frame", "type", "field", "member", "constant", "file", "operator", "parameter", "agent",
    "interface", "subsystem", "device", "element", "memory", "let", "initial condition",
    "terminal condition", "error condition", "function", "behaviour", "state", "variable",
]  # fmt: skip
"""What a name can be the name of."""
RoleForm = Literal[
    "constant",
    "initial",
    "full",
    "type",
    "interface",
    "signature",
    "name",
    "task",
    "argument",
    "path",
    "formula",
]
"""Expressions (over constants, over inputs too, over everything), types, sorts of names, and
formulas of temporal logic."""
SCALARS = [{"type": name} for name in ("string", "integer", "number", "boolean")]
"""What stands for text in JSON Schema where numbers and truth values are text too."""
Fault = tuple[str, str]
"""What is wrong with a value, in words that follow it, and a way out."""


@dataclass(frozen=True, slots=True)
class Role:
    """What a text is; a name is one of a symbol of `kind` in the subsystem around it."""

    form: RoleForm
    kind: SymbolKind | None = None


# Kinds of values, as the annotations of keys say them.


@dataclass(frozen=True, slots=True)
class Text:
    """Text.

    `scalars`: a number or a truth value is taken for the text that it is; `quantity`: one is too,
    but only to be told that it lacks its unit. Where `filled`, it may not be empty. `fault` finds
    what is wrong beyond that.
    """

    role: Role | None = None
    about: str = ""
    scalars: bool = False
    quantity: bool = False
    filled: bool = False
    examples: tuple[str, ...] = ()
    pattern: str = ""
    fault: Callable[[str], Fault | None] | None = None

    def __get_pydantic_json_schema__(self, core: Any, handler: Callable[[Any], Any]) -> Any:
        """The JSON Schema; where pydantic is asked for one, it asks."""
        form = {"anyOf": SCALARS} if self.scalars else handler(core)
        told = {
            "description": self.about,
            "examples": list(self.examples),
            "minLength": int(self.filled),
            "pattern": self.pattern,
        }
        return form | {name: value for name, value in told.items() if value}


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number."""


@dataclass(frozen=True, slots=True)
class Truth:
    """`true` or `false`."""


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of a few values."""

    values: tuple[object, ...]

    def __get_pydantic_json_schema__(self, core: Any, handler: Callable[[Any], Any]) -> Any:
        """The JSON Schema; where pydantic is asked for one, it asks."""
        return {"enum": list(self.values)}


@dataclass(frozen=True, slots=True)
class Listed:
    """How a list is written: an item of these types `alone`, at `least` and at `most` so many."""

    alone: tuple[type, ...] = ()
    least: int = 0
    most: int | None = None
    help: str = ""

    def __get_pydantic_json_schema__(self, core: Any, handler: Callable[[Any], Any]) -> Any:
        """The JSON Schema; where pydantic is asked for one, it asks."""
        form = handler(core)
        if self.least:
            form["minItems"] = self.least
        if self.most is not None:
            form["maxItems"] = self.most
        return {"anyOf": [form["items"], form]} if self.alone else form


@dataclass(frozen=True, slots=True)
class Several:
    """A list or tuple of items."""

    item: ValueKind
    made: Callable[[list[Any]], object]
    how: Listed


@dataclass(frozen=True, slots=True)
class Named:
    """A mapping from names that people choose."""

    name: Text
    value: ValueKind


@dataclass(frozen=True, slots=True)
class Optional:
    """A value, or nothing."""

    value: ValueKind


ValueKind = Text | Whole | Truth | OneOf | Several | Named | Optional | type["Part"]
_PLAIN: dict[Any, ValueKind] = {str: Text(), int: Whole(), bool: Truth()}


def _kind(annotation: Any, how: Any = None) -> ValueKind:
    """The kind of values that an annotation stands for."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    found: ValueKind = _PLAIN.get(annotation, annotation)
    if origin is Annotated:
        how = arguments[1]
        found = how if isinstance(how, (Text, OneOf)) else _kind(arguments[0], how)
    elif origin in (list, tuple):
        found = Several(_kind(arguments[0]), origin, how or Listed())
    elif origin is dict:
        name = _kind(arguments[0])
        assert isinstance(name, Text)
        found = Named(name, _kind(arguments[1]))
    elif origin is Literal:
        found = OneOf(arguments)
    elif origin in (Union, UnionType):
        found = Optional(*(_kind(member) for member in arguments if member is not NoneType))
    return found


def bare(kind: ValueKind) -> ValueKind:
    """The kind of the value if there is one."""
    return kind.value if isinstance(kind, Optional) else kind


# Keys, and the mappings that they make.


OTHERS = "*"
"""Stands for all keys of a mapping that have no key of their own."""
_LAST = ("because", "eq", "table", "fig", "title")


def key(
    default: Any = dataclasses.MISSING,
    about: str = "",
    *,
    spelled: str = "",
    defines: SymbolKind | None = None,
    step: str = "",
) -> Any:
    """A key of a mapping; one without a default is needed.

    `spelled` is the key where Python has another name for it. `defines` says what the names below
    it, or it, if there are none, define; `step` is the step of section 3 that it belongs to.
    """
    told = {"description": about, "alias": spelled, "defines": defines, "step": step}
    metadata = {name: value for name, value in told.items() if value}
    make = default if isinstance(default, type) else type(default)
    if make in (dict, list) or issubclass(make, Part):
        return dataclasses.field(default_factory=make, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


class Part:
    """A mapping with known keys.

    `short`: the key that a scalar in place of the mapping gives. `row`: the keys that the items
    of a list in place of it give. `first`: the keys that the formatter puts before the others.
    `more`: keys that a table has, with their annotations.
    """

    short: ClassVar[str] = ""
    row: ClassVar[tuple[str, ...]] = ()
    first: ClassVar[tuple[str, ...]] = ()
    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}
    keys: ClassVar[dict[str, Key]] = {}
    """The keys that there are, by their names; inherited ones come first."""
    given: ClassVar[frozenset[str]] = frozenset()
    """The keys that the file gives."""
    known: ClassVar[frozenset[str]] = frozenset()
    """The keys that have a name of their own."""
    needed: ClassVar[frozenset[str]] = frozenset()
    """The keys that it has to give."""
    makers: ClassVar[dict[str, Callable[[], object]]] = {}
    """What makes defaults, by attributes."""

    def __init__(self, **values: Any) -> None:
        made = {name: make() for name, make in self.makers.items() if name not in values}
        self.__dict__.update(made, **values)

    def __init_subclass__(
        cls,
        short: str = "",
        row: str = "",
        first: str = "",
        more: Mapping[str, tuple[Any, Any]] = MappingProxyType({}),
    ) -> None:
        for name, (annotation, field) in more.items():
            cls.__annotations__[name] = annotation
            setattr(cls, name, field)
        cls.short, cls.row, cls.first = short or cls.short, tuple(row.split()), tuple(first.split())
        made: Any = dataclasses.dataclass(init=False, repr=False, eq=False)(cls)
        cls.keys = {one.name: one for one in map(_key, dataclasses.fields(made))}
        cls.known = frozenset(cls.keys) - {OTHERS}
        cls.needed = frozenset(one.name for one in cls.keys.values() if one.needed)
        cls.makers = {one.attribute: one.make for one in cls.keys.values() if one.make}


@dataclass(frozen=True, slots=True)
class Key:
    """A key as the file spells it, with the attribute that has its value."""

    name: str
    attribute: str
    kind: ValueKind
    needed: bool
    make: Callable[[], object] | None
    """Makes the default; None if the class has it."""
    about: str
    defines: SymbolKind | None
    step: str


def _key(field: dataclasses.Field[Any]) -> Key:
    told, kind = field.metadata, _kind(field.type)
    make = None if field.default_factory is dataclasses.MISSING else field.default_factory
    return Key(
        told.get("alias", field.name),
        field.name,
        kind,
        make is None and field.default is dataclasses.MISSING,
        make,
        told.get("description", "") or about(kind),
        told.get("defines"),
        told.get("step", ""),
    )


def about(kind: ValueKind) -> str:
    """What is known of all values of a kind, in words."""
    match bare(kind):
        case Text() as text:
            return text.about
        case type() as part:
            return " ".join((part.__doc__ or "").split())
    return ""


def layout(part: type[Part]) -> list[str]:
    """The keys of a mapping in the order in which the formatter writes them."""
    known = [name for name in part.keys if name != OTHERS]
    inner = [name for name in known if name not in _LAST]
    return [name for name in dict.fromkeys((*part.first, *inner, *_LAST)) if name in known]
