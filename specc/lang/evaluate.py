"""What a typed expression means: its value, and the range of its values.

The evaluator is slow and obvious, the oracle of generated code. Numbers are finite: what overflows
raises, as it is a fault of a run.

Values are Python's own: a vector or spatial vector is a tuple of floats, a pose a tuple of four
rows, a list a tuple, a member of an enum its name, a missing component NaN.

Proofs, exploration, checks and generated code ask for ranges; they differ in what they know of
leaves. A truth value is a number, false before true. The range of a vector holds all its
components, that of a pose all coordinates of its position.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from specc.lang import ranges
from specc.lang.builtins import FUNCTIONS
from specc.lang.ranges import ANY, Operation, Range
from specc.lang.values import SIGNS, Value
from specc.model import expr as m
from specc.model.types import Bool, Int, ListOf, Real, Vector


@dataclass(frozen=True)
class Environment:
    """Values of everything that an expression may refer to."""

    inputs: Mapping[tuple[str, str], Value] = field(default_factory=dict)
    fresh: Collection[tuple[str, str]] = ()
    present: Collection[tuple[str, str]] | None = None
    """None: whatever has a value in `inputs`."""
    lags: Mapping[tuple[str, str, str], Value] = field(default_factory=dict)
    """How far inputs are behind: `age` or `late`, peer, element."""
    memory: Mapping[str, Value] = field(default_factory=dict)
    lets: Mapping[str, Value] = field(default_factory=dict)
    constants: Mapping[str, Value] = field(default_factory=dict)
    live: Mapping[str, Value] = field(default_factory=dict)
    """Constants that may change, as they are now."""
    files: Mapping[str, str] = field(default_factory=dict)
    clock: Mapping[str, Value] = field(default_factory=dict)
    operators: Mapping[str, Callable[..., Value]] = field(default_factory=dict)
    parameters: Mapping[str, Value] = field(default_factory=dict)
    bound: Mapping[str, Value] = field(default_factory=dict)
    count: Callable[[int], object] = abs
    """Told of steps, and of items, before they are made; what it raises goes through."""


def evaluate(expr: m.Expr, env: Environment) -> Value:
    """Evaluate an expression; raises what its operators raise, and KeyError for a missing value."""
    return _EVALUATORS[type(expr)](expr, env)


def _count_items(env: Environment, values: Iterable[Value]) -> None:
    """Count components and items of values against the budget, before they are combined."""
    env.count(sum(len(value) for value in values if isinstance(value, tuple)))


def _arguments(args: tuple[m.Expr, ...], env: Environment) -> list[Value]:
    return [evaluate(arg, env) for arg in args]


def _unary(e: m.Unary, env: Environment) -> Value:
    value = evaluate(e.operand, env)
    _count_items(env, (value,))
    if e.op == "not":
        return not value
    return tuple(-v for v in value) if isinstance(value, tuple) else -value


def _binary(e: m.Binary, env: Environment) -> Value:
    left, right = evaluate(e.left, env), evaluate(e.right, env)
    _count_items(env, (left, right))
    return _check_finite(SIGNS[e.op].value(left, right))


def _check_finite(value: Value) -> Value:
    """Return a computed value; raises OverflowError if a number in it is too large."""
    if isinstance(value, tuple):
        for part in value:
            _check_finite(part)
    elif isinstance(value, float) and not math.isfinite(value):
        raise OverflowError("the result is too large")
    return value


def _compare(e: m.Compare, env: Environment) -> bool:
    left, right = evaluate(e.left, env), evaluate(e.right, env)
    _count_items(env, (left, right))
    return m.COMPARISONS[e.op](left, right)


def _logic(e: m.Logic, env: Environment) -> bool:
    values = (evaluate(operand, env) for operand in e.operands)
    return all(values) if e.op == "and" else any(values)


def _items(e: m.Items, env: Environment) -> Value:
    env.count(len(e.items))
    values = tuple(_arguments(e.items, env))
    return tuple(map(float, values)) if e.type.is_array else values


def _quantifier(e: m.Quantifier, env: Environment) -> Value:
    assert isinstance(e.over.type, (Vector, ListOf))  # typing guarantees it
    items = evaluate(e.over, env)
    env.count(len(items) * sum(1 for _ in m.walk(e.body)))
    values = (
        evaluate(e.body, replace(env, bound={**env.bound, e.variable: item})) for item in items
    )
    if e.kind in ("all", "any"):
        return all(values) if e.kind == "all" else any(values)
    numbers = list(values)
    best = max(numbers) if e.kind == "argmax" else min(numbers)
    return items[numbers.index(best)]


def _as_floats(whole: m.Expr, values: Sequence[Value]) -> Sequence[Value]:
    """The values that an expression chooses from, with integers converted if its type is real."""
    if isinstance(whole.type, Real):
        return [float(value) if isinstance(value, int) else value for value in values]
    return values


def _literal(e: Any, env: Environment) -> Value:
    return e.value


def _builtin(e: m.Builtin, env: Environment) -> Value:
    args = _arguments(e.args, env)
    _count_items(env, args)
    value = FUNCTIONS[e.name].value(*_as_floats(e, args))
    return _check_finite(value) if FUNCTIONS[e.name].overflows else value


def _lookup(kind: str, e: Any, env: Environment) -> Value:
    return getattr(env, kind)[e.name]


_EVALUATORS: dict[type, Callable[[Any, Environment], Value]] = {
    m.Number: _literal,
    m.Truth: _literal,
    m.TextLiteral: _literal,
    m.Member: lambda e, env: e.name,
    m.Unused: lambda e, env: math.nan,
    m.Nothing: lambda e, env: None,
    m.IsNone: lambda e, env: evaluate(e.value, env) is None,
    m.Unwrap: lambda e, env: evaluate(e.value, env),
    m.Input: lambda e, env: env.inputs[e.peer, e.element],
    m.MemoryRef: partial(_lookup, "memory"),
    m.LetRef: partial(_lookup, "lets"),
    m.ConstantRef: partial(_lookup, "constants"),
    m.Live: partial(_lookup, "live"),
    m.FileRef: partial(_lookup, "files"),
    m.BoundVariable: partial(_lookup, "bound"),
    m.ParameterRef: partial(_lookup, "parameters"),
    m.Clock: partial(_lookup, "clock"),
    m.Fresh: lambda e, env: (e.input.peer, e.input.element) in env.fresh,
    m.Present: lambda e, env: e.input.key in (env.inputs if env.present is None else env.present),
    m.Lag: lambda e, env: env.lags[e.name, e.input.peer, e.input.element],
    m.Call: lambda e, env: env.operators[e.operator](*_arguments(e.args, env)),
    m.Builtin: _builtin,
    m.Unary: _unary,
    m.Binary: _binary,
    m.Compare: _compare,
    m.IsOneOf: lambda e, env: evaluate(e.item, env) in e.members,
    m.Logic: _logic,
    m.Choice: lambda e, env: _as_floats(
        e, [evaluate(e.then if evaluate(e.test, env) else e.otherwise, env)]
    )[0],
    m.Items: _items,
    m.FieldOf: lambda e, env: getattr(evaluate(e.value, env), e.name),
    m.Component: lambda e, env: evaluate(e.value, env)[e.index],
    m.Quantifier: _quantifier,
}


def operation_of(expr: m.Expr) -> Operation | None:
    """The operation that gives the range of an expression from those of its parts, or None.

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
    """Whether an operation uses whole numbers unrounded.

    A quotient of two is rounded, its operands are not.
    """
    if isinstance(expr, m.Binary) and expr.op == "/":
        return isinstance(expr.left.type, Int) and isinstance(expr.right.type, Int)
    return not any(type_.units for type_ in (expr.type, *expr.type.parts))


def _on_floats(operation: Operation, is_whole: Sequence[bool], *parts: Range) -> Range:
    pairs = zip(parts, is_whole, strict=True)
    return operation(*[ranges.as_floats(part) if whole else part for part, whole in pairs])


def _rounded_either_way(operation: Operation, is_whole: Sequence[bool], *parts: Range) -> Range:
    """The range of a comparison, with whole numbers beside floats rounded or not.

    Numpy rounds them, Python does not.
    """
    return ranges.union(operation(*parts), _on_floats(operation, is_whole, *parts))


def range_of_parts(expr: m.Expr, parts: Sequence[Range]) -> Range:
    """Compute the range of an expression from those of its parts."""
    if isinstance(expr, (m.Number, m.Truth)):
        return ranges.range_of_value(expr.value)
    if isinstance(expr, m.Live):
        return expr.low, expr.high
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
    """The range of an expression whatever its parts are."""
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
