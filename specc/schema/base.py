"""What the parts of the schema share: strictness, short forms, titles and traces."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field


def _as_text(value: object) -> object:
    """YAML reads `0.5` and `true` as values; to the expression language they are text."""
    return repr(value) if isinstance(value, (bool, int, float)) else value


def _as_tuple(value: object) -> object:
    return [value] if isinstance(value, int) and not isinstance(value, bool) else value


ExprText = Annotated[
    str,
    BeforeValidator(_as_text, json_schema_input_type=str | int | float | bool),
    Field(description="An expression, e.g. `near(d_c, d_m, 0.001[m])`."),
]
TypeText = Annotated[str, Field(description="A type, e.g. `vector[6, rad]` or `pose[B, E]`.")]
Numbers = Annotated[
    tuple[int, ...],
    BeforeValidator(_as_tuple, json_schema_input_type=int | list[int]),
]
PythonPath = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$",
        description="A Python object as `package.module:name`.",
    ),
]


class Strict(BaseModel):
    """A mapping with known keys only."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=False)


class Traced(Strict):
    """A part that may carry a title and its place in the paper."""

    title: str = Field("", description="What it is, in words; becomes a docstring.")
    eq: Numbers = Field((), description="Equation number or numbers.")
    table: Numbers = Field((), description="Table number or numbers.")
    fig: Numbers = Field((), description="Figure number or numbers.")


def short_form(key: str) -> BeforeValidator:
    """Accept a bare scalar where a mapping stands: `T_d: pose[B, E]` for `T_d: {type: ...}`."""

    def expand(value: object) -> object:
        return {key: value} if isinstance(value, (str, int, float)) else value

    return BeforeValidator(expand, json_schema_input_type=str | dict[str, Any])


def row_form(keys: tuple[str, ...]) -> BeforeValidator:
    """Accept a list of as many items as `keys` where a mapping stands."""

    def expand(value: object) -> object:
        if not isinstance(value, list):
            return value
        if len(value) != len(keys):
            raise ValueError(f"a row has {len(keys)} items: [{', '.join(keys)}]")
        return dict(zip(keys, value, strict=True))

    return BeforeValidator(expand, json_schema_input_type=list[str] | dict[str, Any])
