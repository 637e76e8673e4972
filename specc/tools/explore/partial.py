"""What is left of an expression when everything that is known has been filled in.

Known values are literals, as expressions themselves. What rests on nothing unknown is computed by
`specc.lang.evaluate`, the rest stays as it stands, without lets.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Final

from specc.lang.evaluate import Environment, evaluate
from specc.model import expr as m
from specc.model.system import Subsystem, System
from specc.model.types import (
    Enum,
    Int,
    ListOf,
    OptionalOf,
    PartialOf,
    Real,
    Spatial,
    Text,
    Type,
    Vector,
)
from specc.proof import InputName

SOME: Final = "some"
"""A value of which nothing is known but that it is not None."""
Value = m.Expr | str
"""A literal, or SOME."""
EXACT: Final = 2**53
"""Up to it integers are the same as floats; which of the two a real is in a run matters beyond."""


@dataclass(slots=True)
class Known:
    """What is known when expressions of a subsystem are evaluated; what is missing is unknown."""

    lets: Mapping[str, m.Expr]
    constants: Mapping[str, m.Expr]
    period_s: Fraction
    inputs: Mapping[InputName, Value] = field(default_factory=dict)
    memory: Mapping[str, Value] = field(default_factory=dict)
    fresh: Mapping[InputName, bool] = field(default_factory=dict)
    present: Mapping[InputName, bool] = field(default_factory=dict)
    periods: int | None = None
    """Since the state was entered; only comparisons of `elapsed` with constants know of it."""
    _lets: dict[str, m.Expr] = field(default_factory=dict)


def static(subsystem: Subsystem, system: System) -> Known:
    """What is known of a subsystem at all times."""
    constants = (*system.constants, *subsystem.constants)
    return Known(
        {item.name: item.value for item in subsystem.lets},
        {constant.name: constant.value for constant in constants},
        1 / subsystem.rate_hz,
    )


def is_literal(expr: m.Expr) -> bool:
    """Whether an expression is a value that a run has exactly."""
    if isinstance(expr, m.Items):
        return all(map(is_literal, expr.items))
    if isinstance(expr, m.Number) and isinstance(expr.value, int):
        return abs(expr.value) <= EXACT
    return isinstance(expr, _LITERALS)


_LITERALS = (m.Number, m.Truth, m.TextLiteral, m.Member, m.Nothing, m.Unused)


def literal(value: Any, type_: Type) -> m.Expr | None:
    """A value as an expression; None for values that have no literals."""
    match type_:
        case OptionalOf(value=inner) | PartialOf(value=inner):
            return m.Nothing(type=type_) if value is None else literal(value, inner)
        case Enum():
            return m.Member(value, type=type_)
        case Text():
            return m.TextLiteral(value, type=type_)
        case Vector(element=inner) | ListOf(element=inner):
            return _items(value, [inner] * len(value), type_)
        case Spatial(linear=linear, angular=angular):
            return _items(value, [Real(linear)] * 3 + [Real(angular)] * 3, type_)
        case Int() | Real():
            return m.Unused(type=type_) if math.isnan(value) else m.Number(value, type=type_)
    return m.Truth(value, type=type_) if isinstance(value, bool) else None


def _items(values: tuple[Any, ...], types: list[Any], type_: Type) -> m.Expr | None:
    items = [literal(value, inner) for value, inner in zip(values, types, strict=True)]
    found = tuple(item for item in items if item is not None)
    return m.Items(found, type=type_) if len(found) == len(items) else None


def filled(expr: m.Expr, known: Known) -> m.Expr:
    """The expression with all that is known filled in: a literal, or what is left to be known."""
    rule = _RULES.get(type(expr))
    if rule is not None:
        return rule(expr, known)
    return _computed(m.mapped(expr, lambda part: filled(part, known)))


def _computed(expr: m.Expr) -> m.Expr:
    """The value of an expression whose parts are values; a fault in it is left to the run."""
    if not isinstance(expr, _COMPUTABLE) or not all(map(is_literal, m.children(expr))):
        return expr
    try:
        made = literal(evaluate(expr, Environment()), expr.type)
    except (ArithmeticError, ValueError, TypeError, LookupError):
        return expr
    return expr if made is None else made


_COMPUTABLE = (m.Unary, m.Binary, m.Compare, m.Among, m.Builtin)


# One rule for each kind of node that knows more than its parts.


def _named(values: Mapping[Any, Value], key: Any, expr: m.Expr) -> m.Expr:
    value = values.get(key, SOME)
    return expr if isinstance(value, str) else value


def _let(expr: m.LetRef, known: Known) -> m.Expr:
    if expr.name not in known._lets:
        known._lets[expr.name] = filled(known.lets[expr.name], known)
    return known._lets[expr.name]


def _constant(expr: m.ConstantRef, known: Known) -> m.Expr:
    value = known.constants.get(expr.name)
    made = expr if value is None else filled(value, known)
    return made if is_literal(made) else expr


def _asked(answers: Mapping[InputName, bool], expr: m.Fresh | m.Present) -> m.Expr:
    answer = answers.get((expr.input.peer, expr.input.element))
    return expr if answer is None else _truth(answer)


def _truth(value: bool) -> m.Expr:
    return m.TRUE if value else m.FALSE


def _clock(expr: m.Clock, known: Known) -> m.Expr:
    if expr.name == "period":
        return m.Number(float(known.period_s), type=expr.type)
    if known.periods is not None and expr.name == "entered":
        return _truth(known.periods == 0)
    return m.Number(0.0, type=expr.type) if known.periods == 0 else expr


def _compare(expr: m.Compare, known: Known) -> m.Expr:
    limit = limit_of(expr, known)
    if limit is not None and known.periods is not None:
        return _truth(holds_after(limit, known.periods, known.period_s))
    return _computed(m.mapped(expr, lambda part: filled(part, known)))


def _unary(expr: m.Unary, known: Known) -> m.Expr:
    operand = filled(expr.operand, known)
    return negated(operand) if expr.op == "not" else _computed(replace(expr, operand=operand))


def negated(expr: m.Expr) -> m.Expr:
    """`not expr`."""
    if isinstance(expr, m.Truth):
        return _truth(not expr.value)
    if isinstance(expr, m.Unary) and expr.op == "not":
        return expr.operand
    return m.Unary("not", expr, type=m.TRUE.type)


def _logic(expr: m.Logic, known: Known) -> m.Expr:
    end, parts = expr.op == "or", list[m.Expr]()
    for operand in expr.operands:
        part = filled(operand, known)
        if not isinstance(part, m.Truth):
            parts.append(part)
        elif part.value == end:
            return part
    if len(parts) < 2:
        return parts[0] if parts else _truth(not end)
    return replace(expr, operands=tuple(parts))


def _choice(expr: m.Choice, known: Known) -> m.Expr:
    test = filled(expr.test, known)
    if isinstance(test, m.Truth):
        return filled(expr.then if test.value else expr.otherwise, known)
    then, otherwise = filled(expr.then, known), filled(expr.otherwise, known)
    return then if then == otherwise else replace(expr, test=test, then=then, otherwise=otherwise)


def _is_none(expr: m.IsNone, known: Known) -> m.Expr:
    value = filled(expr.value, known)
    if isinstance(value, m.Nothing):
        return m.TRUE
    return m.FALSE if is_some(value, known) else replace(expr, value=value)


def is_some(value: m.Expr, known: Known) -> bool:
    """Whether a value that was filled in is surely not None."""
    if not isinstance(value.type, OptionalOf):
        return not isinstance(value, m.Nothing)
    match value:
        case m.Input(peer=peer, element=element):
            return (peer, element) in known.inputs
        case m.MemoryRef(name=name):
            return name in known.memory
    return False


def _sure(expr: m.Sure, known: Known) -> m.Expr:
    value = filled(expr.value, known)
    return value if is_literal(value) else replace(expr, value=value)


def _component(expr: m.Component, known: Known) -> m.Expr:
    value = filled(expr.value, known)
    if isinstance(value, m.Items) and expr.index < len(value.items):
        return value.items[expr.index]
    return replace(expr, value=value)


def _quantifier(expr: m.Quantifier, known: Known) -> m.Expr:
    over = filled(expr.over, known)
    if not isinstance(over, m.Items) or expr.kind not in ("all", "any"):
        return replace(expr, over=over, body=filled(expr.body, known))
    each = tuple(m.instance(expr.body, expr.variable, item) for item in over.items)
    return _logic(m.Logic("and" if expr.kind == "all" else "or", each, type=expr.type), known)


_RULES: dict[type, Callable[[Any, Known], m.Expr]] = {
    m.Input: lambda e, known: _named(known.inputs, (e.peer, e.element), e),
    m.MemoryRef: lambda e, known: _named(known.memory, e.name, e),
    m.LetRef: _let,
    m.ConstantRef: _constant,
    m.Fresh: lambda e, known: _asked(known.fresh, e),
    m.Present: lambda e, known: _asked(known.present, e),
    m.Clock: _clock,
    m.Compare: _compare,
    m.Unary: _unary,
    m.Logic: _logic,
    m.Choice: _choice,
    m.IsNone: _is_none,
    m.Sure: _sure,
    m.Component: _component,
    m.Quantifier: _quantifier,
}


# Comparisons of `elapsed` with constants.


def limit_of(expr: m.Compare, known: Known) -> m.Compare | None:
    """A comparison of `elapsed` itself with a constant, its value filled in; None for others."""
    static = Known(known.lets, known.constants, known.period_s)
    sides = expr.left, expr.right
    clocks = [isinstance(side, m.Clock) and side.name == "elapsed" for side in sides]
    if sum(clocks) != 1:
        return None
    left, right = (
        side if clock else filled(side, static) for side, clock in zip(sides, clocks, strict=True)
    )
    if not isinstance(right if clocks[0] else left, m.Number):
        return None
    return replace(expr, left=left, right=right)


def holds_after(limit: m.Compare, periods: int, period_s: Fraction) -> bool:
    """The answer to such a comparison so many periods after the state was entered."""
    return bool(evaluate(limit, Environment(clock={"elapsed": float(periods * period_s)})))


def turns(limit: m.Compare, period_s: Fraction) -> Iterator[int]:
    """The numbers of periods, 1 or more, at which the answer is not what it was just before."""
    number = limit.right if isinstance(limit.left, m.Clock) else limit.left
    assert isinstance(number, m.Number)
    if not 0 <= number.value < 1e9 * period_s:
        return
    about = int(number.value / period_s)
    for periods in range(max(1, about - 1), about + 4):
        before, after = (holds_after(limit, n, period_s) for n in (periods - 1, periods))
        if before != after:
            yield periods


# Numbers for the values that are kept, so that configurations are small and quickly compared.


MOST_VALUES = 32
"""Of one element; where more are computed, later ones are unknown."""

UNKNOWN, ABSENT = 0, 1
"""Numbers of what is not a value; the others number literals, and SOME."""


@dataclass(slots=True)
class Numbers:
    """Numbers things in the order in which they come."""

    known: dict[Any, int] = field(default_factory=dict)
    things: list[Any] = field(default_factory=list)

    def of(self, thing: Any) -> int:
        """The number of a thing."""
        number = self.known.get(thing)
        if number is None:
            number = self.known[thing] = len(self.things)
            self.things.append(thing)
        return number


class Values:
    """Numbers of the values that are kept, shared by all machines."""

    def __init__(self) -> None:
        self._numbers = Numbers()
        for reserved in ("unknown", "absent", SOME):
            self._numbers.of(reserved)
        self._seen: dict[str, set[int]] = {}
        self.widened: set[str] = set()

    def of(self, target: str, expr: m.Expr, known: Known) -> int:
        """The number of what is assigned to a target."""
        if not is_literal(expr):
            return self._numbers.of(SOME) if is_some(expr, known) else UNKNOWN
        number = self._numbers.of(expr)
        seen = self._seen.setdefault(target, set())
        if number not in seen and len(seen) >= MOST_VALUES:
            self.widened.add(target)
            return UNKNOWN if isinstance(expr, m.Nothing) else self._numbers.of(SOME)
        seen.add(number)
        return number

    def value(self, number: int) -> Value | None:
        """What a number stands for; None if it is unknown or absent."""
        return None if number in (UNKNOWN, ABSENT) else self._numbers.things[number]
