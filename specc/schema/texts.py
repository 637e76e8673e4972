"""Texts that many keys have, and the keys that nearly all mappings have: title and traces."""

import keyword
import re
import unicodedata
from typing import Annotated

from specc.schema.keys import Fault, ListForm, Role, SpecModel, Text, key

PYTHON_PATH = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$"

_LETTERS = "use letters, digits and `_`; the first character is not a digit"
_ANOTHER = "choose another name"
_FORM = "write `package.module:name`"


def _of_name(value: str) -> Fault | None:
    # Expressions read some letters as others; a name is written as it is read.
    if value.isidentifier() and unicodedata.normalize("NFKC", value) == value:
        return None
    plain = re.sub(r"\W+", "_", unicodedata.normalize("NFKC", value)).strip("_")
    meant = plain if plain.isidentifier() else f"n{plain}"
    return "is not a valid name", f"{_LETTERS}, e.g. `{meant}`" if plain else _LETTERS


def _of_readable_name(value: str) -> Fault | None:
    if keyword.iskeyword(value):
        return "is a word of the expression language", f"{_ANOTHER}, e.g. `{value}_`"
    return _of_name(value)


def _of_field_name(value: str) -> Fault | None:
    private = "begins with two underscores, which makes it private in Python"
    if value.startswith("__") and value.isidentifier():
        return private, f"{_ANOTHER}, e.g. `own{value[1:]}`"
    return _of_readable_name(value)


def _of_path(value: str) -> Fault | None:
    if not re.fullmatch(PYTHON_PATH.rstrip("$"), value):
        return "does not have the form `package.module:name`", _FORM
    if any(map(keyword.iskeyword, re.split("[.:]", value))):
        return "contains a keyword of Python and cannot be imported", _FORM
    return None


_TOKENS = re.compile(r"[~/]?[A-Za-z_]\w*(/[A-Za-z_]\w*)*|~/[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


def topic_fault(value: str) -> Fault | None:
    """Why a text is no name of a topic or an action, and a way out."""
    # What rcl takes, but for substitutions: validate_topic_name.c of ROS 2.
    if _TOKENS.fullmatch(value) and "__" not in value and not value.endswith("_"):
        return None
    return (
        "is not a name of ROS 2",
        "use letters, digits and single `_` between `/`; none begins with a digit, e.g. `/arm/q`",
    )


def _of_node(value: str) -> Fault | None:
    return None if "~" not in value and not topic_fault(value) else topic_fault("")


def message_fault(value: str) -> Fault | None:
    """Why a text is no type of messages or of an action, and a way out."""
    if re.fullmatch(r"[a-z][a-z0-9_]*/((msg|action)/)?[A-Z][A-Za-z0-9]*", value):
        return None
    return "is not a type of messages", "write `package/Type`, e.g. `sensor_msgs/JointState`"


def _quantity(about: str, *examples: str) -> Text:
    """A number with its unit."""
    return Text(about=about, quantity=True, examples=examples)


_EXPRESSION = "An expression, e.g. `near(d_c, d_m, 0.001[m])`."

Name = Annotated[str, Text(fault=_of_name)]
"""Letters, digits and `_`, not beginning with a digit."""
ReadableName = Annotated[str, Text(fault=_of_readable_name)]
"""A name that can stand in an expression."""
FieldName = Annotated[str, Text(fault=_of_field_name)]
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
        "An interface, with its frames and types: `Report` or `Report[W]`.",
        examples=("Report", "Report[W]"),
    ),
]
RangeText = Annotated[
    str,
    Text(about="First and last value, e.g. `1..5`.", scalars=True, examples=("1..5", "0..3")),
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
TopicName = Annotated[str, Text(fault=topic_fault, examples=("/joint_states", "~/state"))]
NodeName = Annotated[str, Text(fault=_of_node)]
MessageName = Annotated[
    str,
    Text(
        fault=message_fault,
        examples=("sensor_msgs/JointState", "std_msgs/Float64MultiArray"),
    ),
]
PythonPath = Annotated[
    str,
    Text(about="A Python object as `package.module:name`.", pattern=PYTHON_PATH, fault=_of_path),
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
