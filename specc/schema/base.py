"""What the parts of the schema share: strictness, short forms, titles and traces."""

import keyword
import re
import unicodedata
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError


def _as_text(value: object) -> object:
    """YAML reads `0.5` and `true` as values; to the expression language they are text."""
    return repr(value) if isinstance(value, (bool, int, float)) else value


def _as_tuple(value: object) -> object:
    return [value] if isinstance(value, int) and not isinstance(value, bool) else value


def _name(value: str) -> str:
    # Expressions read some letters as others; a name is written as it is read.
    if not value.isidentifier() or unicodedata.normalize("NFKC", value) != value:
        plain = re.sub(r"\W+", "_", unicodedata.normalize("NFKC", value)).strip("_")
        meant = plain if plain.isidentifier() else f"n{plain}" if plain else ""
        raise PydanticCustomError("not_a_name", "{meant}", {"meant": meant})
    return value


def _readable_name(value: str) -> str:
    if keyword.iskeyword(_name(value)):
        raise PydanticCustomError("word_of_expressions", "{meant}", {"meant": f"{value}_"})
    return value


def _field_name(value: str) -> str:
    if _readable_name(value).startswith("__"):
        raise PydanticCustomError("private_name", "{meant}", {"meant": f"own{value[1:]}"})
    return value


def _importable(value: str) -> str:
    if any(map(keyword.iskeyword, re.split("[.:]", value))):
        raise PydanticCustomError("keyword_in_path", "{meant}", {"meant": ""})
    return value


Name = Annotated[str, AfterValidator(_name)]
"""Letters, digits and `_`, not beginning with a digit."""
ReadableName = Annotated[str, AfterValidator(_readable_name)]
"""A name that can stand in an expression."""

FieldName = Annotated[str, AfterValidator(_field_name)]
"""A name that can stand behind a point, in expressions and in Python."""

ExprText = Annotated[
    str,
    BeforeValidator(_as_text, json_schema_input_type=str | int | float | bool),
    Field(description="An expression, e.g. `near(d_c, d_m, 0.001[m])`."),
]
TypeText = Annotated[
    str,
    Field(
        description="A type, e.g. `vector[6, rad]` or `pose[B, E]`.",
        examples=[
            "bool",
            "real[m]",
            "vector[6, rad]",
            "pose[B, E]",
            "wrench[E]",
            "list[Object[B]]",
        ],
    ),
]
RateText = Annotated[
    str,
    # A number without its unit is told what a rate looks like, not what kind of YAML it is.
    BeforeValidator(_as_text, json_schema_input_type=str),
    Field(
        description="Periods per second, e.g. `500 Hz`, or the period, e.g. `2 ms`.",
        examples=["500 Hz", "100 Hz", "5 Hz", "2 ms"],
    ),
]
DurationText = Annotated[
    str,
    BeforeValidator(_as_text, json_schema_input_type=str),
    Field(
        description="Greatest age of the measurements behind the value, e.g. `20 ms`.",
        examples=["20 ms", "0.5 s"],
    ),
]
GapText = Annotated[
    str,
    BeforeValidator(_as_text, json_schema_input_type=str),
    Field(
        description="Longest time without a new sample of a sporadic device, e.g. `200 ms`.",
        examples=["200 ms", "1 s"],
    ),
]
Numbers = Annotated[
    tuple[int, ...],
    BeforeValidator(_as_tuple, json_schema_input_type=int | list[int]),
]
PYTHON_PATH = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$"
PythonPath = Annotated[
    str,
    Field(
        pattern=PYTHON_PATH,
        description="A Python object as `package.module:name`.",
    ),
    AfterValidator(_importable),
]


class Strict(BaseModel):
    """A mapping with known keys only."""

    # Only files are validated: what validates their parts is not built for each part as well.
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=False, defer_build=True)


class Traced(Strict):
    """A part that may carry a title and its place in the paper."""

    title: str = Field("", description="What it is, in words; becomes a docstring.")
    eq: Numbers = Field((), description="Equation number or numbers.")
    table: Numbers = Field((), description="Table number or numbers.")
    fig: Numbers = Field((), description="Figure number or numbers.")


def short_form(key: str, model: type[BaseModel]) -> BeforeValidator:
    """Accept a bare scalar where a `model` stands: `T_d: pose[B, E]` for `T_d: {type: ...}`."""

    def expand(value: object) -> object:
        return {key: value} if isinstance(value, (str, int, float)) else value

    return BeforeValidator(expand, json_schema_input_type=str | int | float | bool | model)


def row_form(keys: tuple[str, ...], row: Any) -> BeforeValidator:
    """Accept a list of as many items as `keys` where a mapping stands; `row` types both."""

    def expand(value: object) -> object:
        if not isinstance(value, list):
            return value
        if len(value) != len(keys):
            message = f"a row has {len(keys)} items, this one has {len(value)}"
            raise PydanticCustomError("row_length", message, {"keys": ", ".join(keys)})
        return dict(zip(keys, value, strict=True))

    return BeforeValidator(expand, json_schema_input_type=row)
