"""What the schema is written in: models of pydantic, kinds of values, keys with their roles.

The class of a mapping says all that is known of its keys: annotations say what their values are,
`key` what they are for. The check of files, the formatter, the editor, `specc status` and the JSON
Schema read it there.
"""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, TypeGuard, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    model_validator,
)
from pydantic.fields import FieldInfo

from specc.lang.notation import NotationError, notation_of

SymbolKind = Literal[
    "frame", "type", "field", "member", "constant", "file", "operator", "parameter", "agent",
    "interface", "subsystem", "device", "element", "memory", "let", "initial condition",
    "terminal condition", "error condition", "function", "behaviour", "state", "mode", "variable",
]  # fmt: skip
"""What a name can be the name of."""
RoleForm = Literal[
    "constant",
    "initial",
    "full",
    "type",
    "interface",
    "signature",
    "parameters",
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
    """What a text means; a `name` refers to a symbol of `kind` in its subsystem."""

    form: RoleForm
    kind: SymbolKind | None = None


# Kinds of values. Those that are classes here also annotate the types of keys.


@dataclass(frozen=True, slots=True)
class Text:
    """A kind of text values.

    `scalars`: a number or a truth value is accepted and becomes text; `quantity`: it is too, so
    that its missing unit is reported later. `filled` text is not empty. `fault` finds what else is
    wrong with a text.
    """

    role: Role | None = None
    about: str = ""
    scalars: bool = False
    quantity: bool = False
    filled: bool = False
    examples: tuple[str, ...] = ()
    pattern: str = ""
    fault: Callable[[str], Fault | None] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        """What pydantic validates a text with."""
        metadata: list[Any] = [Field(min_length=int(self.filled) or None)]
        if self.scalars or self.quantity:
            metadata.append(BeforeValidator(_text_of_scalar))
        if self.fault:
            metadata.append(AfterValidator(self._without_fault))
        return handler.generate_schema(Annotated[source, *metadata])

    def _without_fault(self, value: str) -> str:
        if self.fault and self.fault(value):
            raise ValueError
        return value

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> Any:
        """The JSON Schema that pydantic makes of it."""
        schema = {"anyOf": SCALARS} if self.scalars else handler(core)
        entries = {
            "description": self.about,
            "examples": list(self.examples),
            "minLength": int(self.filled),
            "pattern": self.pattern,
        }
        return schema | {name: value for name, value in entries.items() if value}


def _text_of_scalar(value: object) -> object:
    return repr(value) if isinstance(value, (bool, int, float)) else value


@dataclass(frozen=True, slots=True)
class LiteralKind:
    """One of a few values, for numbers that are no `Literal`."""

    values: tuple[object, ...]

    def __get_pydantic_core_schema__(self, _source: Any, handler: GetCoreSchemaHandler) -> Any:
        """What pydantic validates a value with."""
        return handler.generate_schema(Literal[self.values])

    def __get_pydantic_json_schema__(self, _core: Any, _handler: GetJsonSchemaHandler) -> Any:
        """The JSON Schema that pydantic makes of it."""
        return {"enum": list(self.values)}


@dataclass(frozen=True, slots=True)
class ListForm:
    """How a list is written: an item of the types in `single` may stand in place of the list."""

    single: tuple[type, ...] = ()
    min_length: int = 0
    max_length: int | None = None
    help: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        """What pydantic validates a list with."""
        lengths = Field(min_length=self.min_length or None, max_length=self.max_length)
        return handler.generate_schema(Annotated[source, lengths])

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> Any:
        """The JSON Schema that pydantic makes of it."""
        schema = handler(core)
        return {"anyOf": [schema["items"], schema]} if self.single else schema


@dataclass(frozen=True, slots=True)
class ListKind:
    """A list of items."""

    item: ValueKind
    form: ListForm


@dataclass(frozen=True, slots=True)
class MappingKind:
    """A mapping from names that people choose."""

    name: Text
    value: ValueKind


ValueKind = Text | LiteralKind | ListKind | MappingKind | type[int] | type["SpecModel"]
"""Of a value, if there is one; `bool` is a subclass of `int`."""


def _kind(annotation: Any, *metadata: Any) -> ValueKind:
    """The kind of values that an annotation stands for."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kind(arguments[0], *arguments[1:])
    for form in metadata:
        if isinstance(form, (Text, LiteralKind)):
            return form
    if origin in (Union, UnionType):
        return _kind(*(member for member in arguments if member is not NoneType))
    if origin in (list, tuple):
        forms = (form for form in metadata if isinstance(form, ListForm))
        return ListKind(_kind(arguments[0]), next(forms, ListForm()))
    if origin is dict:
        name = _kind(arguments[0])
        assert isinstance(name, Text)
        return MappingKind(name, _kind(arguments[1]))
    if origin is Literal:
        return LiteralKind(arguments)
    return Text() if annotation is str else annotation


def is_model(kind: object) -> TypeGuard[type[SpecModel]]:
    """Whether values of a kind are mappings with known keys."""
    return isinstance(kind, type) and issubclass(kind, SpecModel)


# Keys, and the mappings that they make.


OTHERS = "*"
"""Stands for all keys of a mapping that have no key of their own."""
_LAST = ("because", "eq", "table", "fig", "title", "symbol")
_DEFINES, _STEP = "x-defines", "x-step"


def key(
    default: Any = ...,
    about: str = "",
    *,
    alias: str | None = None,
    defines: SymbolKind | None = None,
    step: str = "",
) -> Any:
    """A key of a mapping; one without a default is needed.

    `alias` is the key in the file where Python has another name for it. `defines` says what the
    names below it define, or it does itself where there are none. `step` is its step of the
    procedure in section 3 of the paper. A model as the default stands for one of which the file
    gives nothing.
    """
    field: dict[str, Any] = {"default": default}
    if is_model(default):
        field = {"default_factory": default.model_construct}
    extra: dict[str, Any] = {_DEFINES: defines, _STEP: step}
    return Field(**field, alias=alias, description=about or None, json_schema_extra=extra)


class SpecModel(BaseModel):
    """A mapping with known keys.

    `short`: the key that a scalar in place of the mapping gives. `row`: the keys that the items
    of a list in place of it give. `first`: the keys that the formatter puts before the others.
    """

    # Only whole files are validated: what validates a part is built with them.
    model_config = ConfigDict(extra="forbid", defer_build=True, protected_namespaces=())

    short: ClassVar[str] = ""
    row: ClassVar[tuple[str, ...]] = ()
    first: ClassVar[tuple[str, ...]] = ()
    keys: ClassVar[dict[str, Key]] = {}
    """The keys that there are, by their names; inherited ones come first."""

    def __init_subclass__(cls, short: str = "", row: str = "", first: str = "") -> None:
        cls.short, cls.row, cls.first = short or cls.short, tuple(row.split()), tuple(first.split())

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Collect the keys, as soon as pydantic has its fields."""
        keys = (_key(name, field) for name, field in cls.model_fields.items())
        cls.keys = {key.name: key for key in keys}

    @property
    def given_keys(self) -> frozenset[str]:
        """The keys that the file gives."""
        given = self.model_fields_set
        return frozenset(key.name for key in self.keys.values() if key.attribute in given)

    @classmethod
    def is_key(cls, name: Any, value: Any = None) -> bool:
        """Whether a name of a mapping, with some value if that is known, is a key of it.

        Others are names that people choose.
        """
        return name in cls.keys and name != OTHERS

    @classmethod
    def with_others(cls, value: Any) -> Any:
        """A mapping with the names that people choose below `OTHERS`."""
        if OTHERS not in cls.keys or not isinstance(value, dict):
            return value
        own: dict[str, Any] = {}
        others: dict[str, Any] = {}
        # With a mapping below it, `is` is a name that somebody chose.
        chosen = "is" if cls.short == "is" and isinstance(value.get("is"), dict) else OTHERS
        for name, one in value.items():
            known = name != chosen and cls.is_key(name, one)
            (own if known else others)[name] = one
        return own | {OTHERS: others}

    @model_validator(mode="before")
    @classmethod
    def _validate_with_others(cls, value: Any) -> Any:
        return cls.with_others(value)


@dataclass(frozen=True, slots=True)
class Key:
    """A key as the file spells it, with the attribute that has its value."""

    name: str
    attribute: str
    kind: ValueKind
    needed: bool
    about: str
    defines: SymbolKind | None
    step: str


def _key(attribute: str, field: FieldInfo) -> Key:
    kind = _kind(field.annotation, *field.metadata)
    extra: Any = field.json_schema_extra or {}
    return Key(
        field.alias or attribute,
        attribute,
        kind,
        field.is_required(),
        field.description or about(kind),
        extra.get(_DEFINES),
        extra.get(_STEP, ""),
    )


def about(kind: ValueKind) -> str:
    """A description of all values of a kind."""
    if isinstance(kind, Text):
        return kind.about
    return " ".join((kind.__doc__ or "").split()) if is_model(kind) else ""


def layout(model: type[SpecModel]) -> list[str]:
    """The keys of a mapping in the order in which the formatter writes them."""
    known = [name for name in model.keys if name != OTHERS]
    inner = [name for name in known if name not in _LAST]
    return [name for name in dict.fromkeys((*model.first, *inner, *_LAST)) if name in known]


PYTHON_PATH = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$"

_LETTERS = "use letters, digits and `_`; the first character is not a digit"
_ANOTHER = "choose another name"
_FORM = "write `package.module:name`"


def _name_fault(value: str) -> Fault | None:
    # Expressions read some letters as others; a name is written as it is read.
    if value.isidentifier() and unicodedata.normalize("NFKC", value) == value:
        return None
    plain = re.sub(r"\W+", "_", unicodedata.normalize("NFKC", value)).strip("_")
    valid = plain if plain.isidentifier() else f"n{plain}"
    return "is not a valid name", f"{_LETTERS}, e.g. `{valid}`" if plain else _LETTERS


def _readable_name_fault(value: str) -> Fault | None:
    if keyword.iskeyword(value):
        return "is a word of the expression language", f"{_ANOTHER}, e.g. `{value}_`"
    return _name_fault(value)


def _field_name_fault(value: str) -> Fault | None:
    private = "begins with two underscores, which makes it private in Python"
    if value.startswith("__") and value.isidentifier():
        return private, f"{_ANOTHER}, e.g. `own{value[1:]}`"
    return _readable_name_fault(value)


def _path_fault(value: str) -> Fault | None:
    if not re.fullmatch(PYTHON_PATH.rstrip("$"), value):
        return "does not have the form `package.module:name`", _FORM
    if any(map(keyword.iskeyword, re.split("[.:]", value))):
        return "contains a keyword of Python and cannot be imported", _FORM
    return None


_TOKENS = re.compile(r"[~/]?[A-Za-z_]\w*(/[A-Za-z_]\w*)*|~/[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


def topic_fault(value: str) -> Fault | None:
    """Why a text is not a name of a topic or an action, and a help text."""
    # What rcl takes, but for substitutions: validate_topic_name.c of ROS 2.
    if _TOKENS.fullmatch(value) and "__" not in value and not value.endswith("_"):
        return None
    return (
        "is not a name of ROS 2",
        "use letters, digits and single `_` between `/`; none begins with a digit, e.g. `/arm/q`",
    )


def _symbol_fault(value: str) -> Fault | None:
    try:
        notation_of(value)
    except NotationError:
        return "is no symbol", "write a letter and what stands around it, e.g. `^B_{E_g} T_d`"
    return None


def _node_fault(value: str) -> Fault | None:
    return None if "~" not in value and not topic_fault(value) else topic_fault("")


def _field_fault(value: str) -> Fault | None:
    if re.fullmatch(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*", value):
        return None
    return "is no field of a message", "write its name, below others with dots: `pose.position`"


def message_fault(value: str) -> Fault | None:
    """Why a text is not a type of messages or of an action, and a help text."""
    if re.fullmatch(r"[a-z][a-z0-9_]*/((msg|action|srv)/)?[A-Z][A-Za-z0-9]*", value):
        return None
    return "is not a type of messages", "write `package/Type`, e.g. `sensor_msgs/JointState`"


def _panel_key_fault(value: str) -> Fault | None:
    if len(value) == 1 and value.isprintable() and not value.isspace():
        return None
    return "is not a key that a terminal has", "write one character, e.g. `s`"


def _quantity(about: str, *examples: str) -> Text:
    """A text kind for a number with its unit."""
    return Text(about=about, quantity=True, examples=examples)


_EXPRESSION = "An expression, e.g. `near(d_c, d_m, 0.001[m])`."

Name = Annotated[str, Text(fault=_name_fault)]
"""Letters, digits and `_`, not beginning with a digit."""
ReadableName = Annotated[str, Text(fault=_readable_name_fault)]
"""A name that can stand in an expression."""
FieldName = Annotated[str, Text(fault=_field_name_fault)]
"""A name that can stand behind a point, in expressions and in Python."""

ConstantText = Annotated[str, Text(Role("constant"), _EXPRESSION, scalars=True)]
InitialText = Annotated[str, Text(Role("initial"), _EXPRESSION, scalars=True)]
ExprText = Annotated[str, Text(Role("full"), _EXPRESSION, scalars=True)]
ArgumentText = Annotated[str, Text(Role("argument"), _EXPRESSION, scalars=True)]
WrittenType = Annotated[
    str,
    Text(
        Role("type"),
        "A type, e.g. `vector[6, rad]` or `pose[B, E]`.",
        examples=(
            "bool",
            "real[m]",
            "vector[6, rad]",
            "pose[B, E]",
            "wrench[E]",
            "list[Object[B]]",
        ),
    ),
]
InterfaceText = Annotated[
    str,
    Text(
        Role("interface"),
        "An interface, with its frames and types: `Report` or `Report[W]`; or `same`.",
        examples=("Report", "Report[W]", "same"),
    ),
]
RangeText = Annotated[
    str,
    Text(about="First and last value, e.g. `1..5`.", scalars=True, examples=("1..5", "0..3")),
]
SeedText = Annotated[
    str,
    Text(
        about="A seed, or the first and the last of several, e.g. `0..9`.",
        scalars=True,
        examples=("0..9", "3"),
    ),
]
SuccessText = Annotated[
    str,
    Text(
        about="How many of how many runs pass at least, e.g. `9 of 10`; all if left out.",
        examples=("9 of 10",),
    ),
]
RateText = Annotated[
    str,
    _quantity(
        "Periods per second, e.g. `500 Hz`, or the period, e.g. `2 ms`.",
        *("500 Hz", "100 Hz", "5 Hz", "2 ms"),
    ),
]
DurationText = Annotated[
    str,
    _quantity("Greatest age of the measurements behind the value, e.g. `20 ms`.", "20 ms", "0.5 s"),
]
BudgetText = Annotated[
    str,
    _quantity("Longest time that a step takes on the machine, e.g. `150 ms`.", "150 ms", "1 ms"),
]
GapText = Annotated[
    str,
    _quantity(
        "Longest time without a new sample of a sporadic device, e.g. `200 ms`.", "200 ms", "1 s"
    ),
]
SilenceText = Annotated[
    str,
    _quantity(
        "How long the agent may be silent until the device gets its safe outputs.", "20 ms", "0.5 s"
    ),
]
WaitText = Annotated[
    str,
    _quantity(
        "How long topics may have no first message when a run begins, e.g. `5 s`.", "5 s", "500 ms"
    ),
]
AnswerText = Annotated[
    str,
    _quantity("How long a caller waits for an answer, 1 s if left out, e.g. `500 ms`.", "1 s"),
]
TopicName = Annotated[str, Text(fault=topic_fault, examples=("/joint_states", "~/state"))]
NodeName = Annotated[str, Text(fault=_node_fault)]
FieldPath = Annotated[str, Text(fault=_field_fault, examples=("data", "pose.position"))]
MessageName = Annotated[
    str,
    Text(
        fault=message_fault,
        examples=("sensor_msgs/JointState", "std_msgs/Float64MultiArray"),
    ),
]
SymbolText = Annotated[
    str,
    Text(
        about="How documents write it, where its name does not say it: `dot(r)_p`.",
        filled=True,
        fault=_symbol_fault,
        examples=("T_d", "dot(r)_p", "^B_{E_g} T_d", "alpha_1", "cal(F)"),
    ),
]
PanelKey = Annotated[str, Text(scalars=True, fault=_panel_key_fault, examples=("s", "1"))]
PythonPath = Annotated[
    str,
    Text(about="A Python object as `package.module:name`.", pattern=PYTHON_PATH, fault=_path_fault),
]
ParametersText = Annotated[
    str,
    Text(
        Role("parameters"),
        "Parameters with their types, which a call gives values: `(to: pose[B, E])`.",
        examples=("(to: pose[B, E], speed: real[m/s])",),
    ),
]
FilePath = Annotated[str, Text(Role("path"))]
StateName = Annotated[str, Text(Role("name", "state"))]
TraceNumbers = Annotated[
    tuple[int, ...],
    ListForm(single=(int,), help="write a number or a list of numbers, e.g. `[4, 5]`"),
]


OF_EACH = "Indices with their ranges: there is one such part for each value, e.g. `{i: 1..5}`."


class Traced(SpecModel):
    """A part that may carry a title and its place in the paper."""

    title: str = key("", "What it is, in words; becomes a docstring.", step="role")
    eq: TraceNumbers = key((), "Equation number or numbers.")
    table: TraceNumbers = key((), "Table number or numbers.")
    fig: TraceNumbers = key((), "Figure number or numbers.")


class Denoted(Traced):
    """A part that formulas name, and that may have a symbol of its own in documents."""

    symbol: SymbolText | None = None
