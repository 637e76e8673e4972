"""What an expression of a specification is worth, from its text alone.

Nothing of the compiler is used: Python's parser reads the text, and section 5 of docs/language.md
says what the parts mean. It knows numbers, truth values, members of enums, optional values, and the
clocks of states and modes: all that machines with modes ask for.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from tests.soundness.evaluator import Absent, Key, Value

UNITS = {"s": 1.0, "m": 1.0, "ms": 1e-3, "mm": 1e-3}
"""Unit -> how much of the SI unit it is."""


class Nothing(ValueError):
    """Something was computed with an optional value that is not there."""


@dataclass(frozen=True, slots=True)
class Now:
    """All that an expression can ask for at one time stamp."""

    inputs: Mapping[Key, Value]
    fresh: Collection[Key]
    memory: Mapping[str, Value]
    lets: Mapping[str, ast.expr]
    elapsed: float
    """Of the state, in s."""
    entered: bool
    elapsed_of: Mapping[str, float]
    """Of each mode, in s."""
    entered_of: Collection[str]
    """The modes in the first period after an entry that was no `resume`."""
    period: float


def parsed(text: Any) -> ast.expr:
    """The tree of an expression, which may be a number or truth value of YAML."""
    return ast.parse(str(text).strip(), mode="eval").body


def worth(e: ast.expr, now: Now) -> Value:  # a case for each kind of node
    """The value; raises `Absent`, `Nothing`, and what arithmetic raises."""
    match e:
        case ast.Constant(value=value):
            return value
        case ast.Subscript(value=number, slice=ast.Name(id=unit)):
            return worth(number, now) * UNITS[unit]
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id="x"), attr=peer), attr=name):
            if (peer, name) not in now.inputs:
                raise Absent(f"x.{peer}.{name}")
            return now.inputs[peer, name]
        case ast.Name(id=name):
            return _named(name, now)
        case ast.Call(func=ast.Name(id=function), args=args):
            return _called(function, args, now)
        case ast.BoolOp(op=op, values=values):
            if isinstance(op, ast.And):
                return all(worth(part, now) for part in values)
            return any(worth(part, now) for part in values)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not worth(operand, now)
        case ast.UnaryOp(operand=operand):
            return -there(worth(operand, now))
        case ast.IfExp(test=test, body=then, orelse=otherwise):
            return worth(then if worth(test, now) else otherwise, now)
        case ast.BinOp(left=left, op=op, right=right):
            return _computed(op, there(worth(left, now)), there(worth(right, now)))
        case ast.Compare(left=left, ops=ops, comparators=others):
            return _compared(left, ops, others, now)
    raise TypeError(ast.dump(e))


def _named(name: str, now: Now) -> Value:
    """Memory, a let, a clock of the state, or else a member of an enum."""
    if name in now.memory:
        return now.memory[name]
    if name in now.lets:
        return worth(now.lets[name], now)
    if name in ("elapsed", "entered", "period"):
        return getattr(now, name)
    return name


def _called(function: str, args: list[ast.expr], now: Now) -> Value:
    match function, args:
        case (("fresh" | "present"), [ast.Attribute(value=ast.Attribute(attr=peer), attr=name)]):
            return (peer, name) in (now.fresh if function == "fresh" else now.inputs)
        case "elapsed", [ast.Name(id=mode)]:
            return now.elapsed_of[mode]
        case "entered", [ast.Name(id=mode)]:
            return mode in now.entered_of
    of: Callable[..., Value] = {"min": min, "max": max, "abs": abs}[function]
    return of(*[there(worth(arg, now)) for arg in args])


def _computed(op: ast.operator, a: Value, b: Value) -> Value:
    match op:
        case ast.Add():
            return a + b
        case ast.Sub():
            return a - b
        case ast.Mult():
            return a * b
        case ast.Div():
            return a / b
    raise TypeError(ast.dump(op))


def _compared(left: ast.expr, ops: list[ast.cmpop], others: list[ast.expr], now: Now) -> bool:
    a = worth(left, now)
    for op, other in zip(ops, others, strict=True):
        match op, other:
            case ast.In() | ast.NotIn(), ast.Set(elts=members):
                holds = (a in [worth(m, now) for m in members]) == isinstance(op, ast.In)
            case ast.Is() | ast.IsNot(), _:
                holds = (a is None) == isinstance(op, ast.Is)
            case _:
                b = worth(other, now)
                holds = _in_order(op, there(a), there(b))
                a = b
        if not holds:
            return False
    return True


def _in_order(op: ast.cmpop, a: Value, b: Value) -> bool:
    match op:
        case ast.Lt():
            return bool(a < b)
        case ast.LtE():
            return bool(a <= b)
        case ast.Gt():
            return bool(a > b)
        case ast.GtE():
            return bool(a >= b)
        case ast.Eq():
            return bool(a == b)
    return bool(a != b)


def there(value: Value) -> Value:
    """A value that must be there."""
    if value is None:
        raise Nothing("there is no value")
    return value
