"""What can be known of a constructor of types: the columns of the table of types."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

from specc.lang.values import Value
from specc.model.expr import Expr
from specc.model.types import Type

Of = Callable[[Type, Any], Any]
"""From the type of a part and what there is of the part."""
Sort = Literal["truth", "whole", "real", "item", "other"]


@dataclass(frozen=True, slots=True)
class Python:
    """How generated code says types in some place: as annotations, contracts or forms of values."""

    of: Callable[[Type], str]
    """What it says for another type."""
    own: Callable[[str], str]
    """A name of the runtime."""
    named: Callable[[Type], str]
    """The class or alias of a type that has a name."""
    function: Callable[[str], str] = str
    """A function, `module:name`."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A constructor of types. A column is a function of the type first, unless it is a text.

    Of types that are made of others, a column says how these are put together: it is given `of`
    for them. The defaults are right for types whose values only pass through.
    """

    # What every constructor has.

    first_value: Callable[[Any, float], Value]
    """A value to begin with, as `specc.lang.evaluate` has them: nothing, the identity, the first
    member; where it consists of numbers, of this one."""
    decode: Callable[[Any, Any, Of], Value]
    """The value that data of a recording stands for; `...` for data of another type."""
    contract: Callable[[Any, Python], str]
    """What checks its values where they come from outside (`specc_runtime.contracts`)."""
    form: Callable[[Any, Python], str]
    """How its values are recorded (`specc_runtime.forms`)."""
    annotation: Callable[[Any, Python], str] = lambda type, py: py.named(type)
    """Its type in generated code."""

    # More about values.

    data: Callable[[Any, Value, Of], Any] = lambda type, value, of: str(value)
    """What recordings have of a value."""
    other_values: Callable[[Any, Value], Iterator[Value]] = lambda type, value: iter(())
    """Some values beside a given one."""
    map_parts: Callable[[Any, Value, Of], Value] = lambda type, value, of: value
    """A value with each part as `of` gives it."""
    literal: Callable[[Any, Value, Of], Expr | None] = lambda type, value, of: None
    """The expression of a value; None if there is none."""
    sort: Sort = "other"
    """What proofs take a value for: what is true or false, a number, one of items that are told
    apart and nothing else, or what they do not look into."""

    # How it is told.

    descriptions: Callable[[Any, Callable[[str], str], Callable[[Type], list[str]]], list[str]] = (
        lambda type, frame, of: []
    )
    """In words, with frames as `frame` names them."""
    words: Callable[[Any], tuple[str, ...]] = lambda type: ()
    """Values that are words, in order."""
    shapes: Callable[[Any], tuple[str, ...]] = lambda type: ()
    """What a value looks like in messages of ROS, as `specc.analysis.ros2` names shapes, scalars by
    their messages of `std_msgs`; first the one that it is published in."""
