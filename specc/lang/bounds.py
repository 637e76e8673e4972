"""Between which numbers the values of an expression lie, by what is known of its parts.

Proofs, exploration, checks and generated code ask here; they differ in what they know of leaves. A
truth value is a number, false before true. Of a vector it is what all its components lie between,
of a pose what all coordinates of its position do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from specc.lang import ranges
from specc.lang.builtins import FUNCTIONS
from specc.lang.ranges import ANY, Operation, Range
from specc.lang.signs import SIGNS
from specc.model import expr as m
from specc.model.types import Bool, Int


def operation_of(expr: m.Expr) -> Operation | None:
    """How the range of an expression follows from those of its parts; None if it is not known.

    Whole numbers beside reals become floats, as in generated code.
    """
    operation = _operation(expr)
    is_whole = [isinstance(part.type, Int) for part in m.children(expr)]
    if operation is None or not any(is_whole):
        return operation
    if isinstance(expr, m.Compare) and not all(is_whole):
        return partial(_rounded_either_way, operation, is_whole)
    return operation if _keeps_integers(expr) else partial(_on_floats, operation, is_whole)


def _operation(expr: m.Expr) -> Operation | None:
    match expr:
        case m.Binary(op=sign):
            return SIGNS[sign].range
        case m.Unary(op="-"):
            return ranges.negative
        case m.Unary(op=word) | m.Compare(op=word) | m.Logic(op=word):
            return ranges.CONDITIONS[word]
        case m.Builtin(name=name):
            return FUNCTIONS[name].range
        case m.Items() | m.Component() | m.Unwrap():
            return ranges.union
    return ranges.choice if isinstance(expr, m.Choice) else None


def _keeps_integers(expr: m.Expr) -> bool:
    """Whether whole numbers are taken as they are: a quotient is rounded, and not what it is of."""
    if isinstance(expr, m.Binary) and expr.op == "/":
        return isinstance(expr.left.type, Int) and isinstance(expr.right.type, Int)
    return not any(type_.units for type_ in (expr.type, *expr.type.parts))


def _on_floats(operation: Operation, is_whole: Sequence[bool], *parts: Range) -> Range:
    pairs = zip(parts, is_whole, strict=True)
    return operation(*[ranges.as_floats(part) if whole else part for part, whole in pairs])


def _rounded_either_way(operation: Operation, is_whole: Sequence[bool], *parts: Range) -> Range:
    """Of a comparison: numpy rounds a whole number beside a float, and Python does not."""
    return ranges.union(operation(*parts), _on_floats(operation, is_whole, *parts))


def range_of_parts(expr: m.Expr, parts: Sequence[Range]) -> Range:
    """The range of an expression by those of its parts."""
    if isinstance(expr, (m.Number, m.Truth)):
        return ranges.range_of_value(expr.value)
    static, operation = _static_range(expr), operation_of(expr)
    if operation is None:
        return static
    if not isinstance(expr, m.Logic):  # generated code has operands of others in its own
        pairs = zip(m.children(expr), parts, strict=True)
        parts = [
            ranges.as_integers(part) if isinstance(of.type, Int) else part for of, part in pairs
        ]
    return ranges.intersection(ranges.apply(operation, parts), static)


def _static_range(expr: m.Expr) -> Range:
    """What the values lie between whatever the parts are."""
    if isinstance(expr.type, Bool):
        return False, True
    if isinstance(expr, (m.Clock, m.Lag)):
        return ranges.NOT_NEGATIVE
    return FUNCTIONS[expr.name].bounds if isinstance(expr, m.Builtin) else ANY


def range_of(expr: m.Expr, known: Callable[[m.Expr], Range | None]) -> Range:
    """The range of an expression; `known` gives that of a leaf, None for what has to be computed.

    No expression is looked through: a let or a constant is a leaf.
    """
    if (leaf := known(expr)) is not None:
        return leaf
    return range_of_parts(expr, [range_of(part, known) for part in m.children(expr)])
