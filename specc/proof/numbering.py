"""Value numbers: expressions that surely have the same value get the same number.

Lets and constants are looked through. Sharing numbers instead of copying expressions keeps the work
linear where lets refer to lets many times over.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction

from specc.lang import ranges
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import range_of_parts
from specc.lang.ranges import ANY, NOT_NEGATIVE, Range
from specc.lang.values import SIGNS
from specc.model.expr import (
    LENGTH,
    Binary,
    BoundVariable,
    Builtin,
    Choice,
    Clock,
    Component,
    ConstantRef,
    Expr,
    Items,
    Lag,
    LetRef,
    Live,
    Member,
    Node,
    Number,
    Quantifier,
    TextLiteral,
    Truth,
    Unary,
    Unwrap,
    children,
)
from specc.model.types import Int, ListOf, Real

KnownValue = float | bool | str
Depths = Mapping[str, int]
"""Variable of a quantifier -> how many quantifiers are around its own."""

_NUMBERS = (Unary, Binary, Builtin, Choice, Clock, Lag, Live, Component, Items)
_MOST_BITS = 4096
"""Whole numbers beyond this size are not computed: powers of powers are soon larger than memory."""


class Numbering:
    """Numbers the expressions of one subsystem; equal numbers mean equal values in one period."""

    def __init__(
        self,
        lets: Mapping[str, Expr],
        constants: Mapping[str, Expr],
        period_s: Fraction | None = None,
    ) -> None:
        """`lets` and `constants` in order of dependence; `period_s` if it is known."""
        self.exact_period_s = period_s
        self.period_s = None if period_s is None else float(period_s)
        self.lets = lets
        self._constant_values = constants
        self._numbers: dict[object, int] = {}
        self._values: dict[int, KnownValue] = {}
        self._ranges: dict[int, Range] = {}
        self._live: set[int] = set()
        # By identity, with the expression itself so that no other one takes its identity.
        self._cache: dict[tuple[int, tuple[tuple[str, int], ...]], tuple[Expr, int]] = {}
        self._constants: dict[str, int] = {}
        self._lets: dict[str, int] = {}
        for name, value in constants.items():
            self._constants[name] = self.number(value)
        for name, value in lets.items():
            self._lets[name] = self.number(value)

    def named_values(self) -> Iterator[Expr]:
        """The values of constants and lets in order of dependence, so that no chain is deep."""
        yield from self._constant_values.values()
        yield from self.lets.values()

    def constant_value(self, number: int) -> KnownValue | None:
        """The value of a number that stands for a known one: a number, truth, member or text."""
        return self._values.get(number)

    def constant_number(self, expr: Expr, bound: Depths | None = None) -> float | None:
        """What number an expression is; None if that is not known, or it is no number."""
        value = self._values.get(self.number(expr, bound))
        return value if isinstance(value, (int, float)) and not isinstance(value, bool) else None

    def resolve(self, expr: Expr) -> Expr:
        """The value of a let or a constant; any other expression itself."""
        while isinstance(expr, (LetRef, ConstantRef)):
            names = self.lets if isinstance(expr, LetRef) else self._constant_values
            if expr.name not in names:
                break
            expr = names[expr.name]
        return expr

    def item(self, component: Component) -> Expr | None:
        """The item of a literal vector; None if it is converted or unknown."""
        found = self.literal_item(component)
        return found if found is not None and found.type == component.type else None

    def literal_item(self, component: Component) -> Expr | None:
        """The item of a literal vector as it is written; None if unknown."""
        whole = self.resolve(component.value)
        if isinstance(whole, Items) and 0 <= component.index < len(whole.items):
            return whole.items[component.index]
        return None

    def number(self, expr: Expr, bound: Depths | None = None) -> int:
        """The number of `expr`; `bound` says how deep each quantifier variable was bound."""
        key = id(expr), tuple(bound.items()) if bound else ()
        known = self._cache.get(key)
        if known is None:
            known = self._cache[key] = expr, self._number(expr, bound or {})
        return known[1]

    def _number(self, expr: Expr, inside: Depths) -> int:
        while isinstance(expr, Unwrap):
            expr = expr.value
        match expr:
            case LetRef(name=name) | ConstantRef(name=name) if name in self._named(expr):
                return self._named(expr)[name]
            case BoundVariable(name=name):
                return self._number_for(("bound", inside.get(name, name)))
            case Number(value=value) | Truth(value=value) | TextLiteral(value=value):
                return self._constant_number(value)
            case Member(name=name):
                return self._constant_number(name)
            case Component() if (item := self.item(expr)) is not None:
                return self.number(item, inside)
            case Quantifier(kind=kind, variable=variable, over=over, body=body):
                depth = len(inside)
                parts = self.number(over, inside), self.number(body, {**inside, variable: depth})
                return self._number_for(("quantifier", kind, *parts))
        if isinstance(expr, Clock) and expr.name == "period" and self.period_s is not None:
            return self._constant_number(self.period_s)
        return self._compound(expr, [self.number(child, inside) for child in children(expr)])

    def _named(self, expr: LetRef | ConstantRef) -> dict[str, int]:
        return self._lets if isinstance(expr, LetRef) else self._constants

    def pair(self, a: int, b: int) -> int:
        """A number for an unordered pair of values."""
        return self._number_for(("pair", min(a, b), max(a, b)))

    def range_of(self, expr: Expr, bound: Depths | None = None) -> Range:
        """The least and greatest value of a number, as far as it follows from what it is."""
        return self._range_of(self.number(expr, bound))

    def live_range(self, expr: Expr, bound: Depths | None = None) -> Range:
        """The range of what depends on a constant that may change; any range for all else."""
        number = self.number(expr, bound)
        return self._range_of(number) if number in self._live else ANY

    def _range_of(self, number: int) -> Range:
        value = self._values.get(number)
        if isinstance(value, (int, float)):
            return ranges.range_of_value(value)
        return self._ranges.get(number, ANY)

    def _compound(self, expr: Expr, parts: list[int]) -> int:
        given = parts
        if isinstance(expr, (Unary, Binary, Builtin)):
            known = [*map(self._typed, children(expr), parts)]
            folded = _fold(expr, known)
            if folded is not None:
                return self._constant_number(folded)
        if isinstance(expr, Builtin) and FUNCTIONS[expr.name].compares and len(parts) == 3:
            parts = [*sorted(parts[:2]), parts[2]]
        if isinstance(expr, Binary) and SIGNS[expr.op].commutes:
            parts = sorted(parts)
        whole = isinstance(expr, Binary) and isinstance(expr.type, Int)  # 2 * n, unlike 2.0 * n
        number = self._number_for((type(expr).__name__, whole, *labels(expr), *parts))
        if isinstance(expr, Live) or not self._live.isdisjoint(parts):
            self._live.add(number)
        if number not in self._ranges and isinstance(expr, _NUMBERS):
            self._ranges[number] = self._range(expr, given)
        return number

    def _typed(self, expr: Expr, number: int) -> KnownValue | None:
        """The value of a number, whole if the expression is: 1 and 1.0 are one value."""
        value = self._values.get(number)
        return int(value) if isinstance(value, float) and isinstance(expr.type, Int) else value

    def _range(self, expr: Expr, parts: list[int]) -> Range:
        match expr:
            case Builtin(name=name, args=(several,)) if name == LENGTH:
                return int(isinstance(several.type, ListOf) and several.type.nonempty), math.inf
        found = range_of_parts(expr, [self._range_of(part) for part in parts])
        is_square = isinstance(expr, Binary) and expr.op == "*" and parts[0] == parts[1]
        return ranges.intersection(found, NOT_NEGATIVE) if is_square else found

    def _constant_number(self, value: KnownValue) -> int:
        # 0.0 and -0.0 are equal, but not the same divisor.
        kind = math.copysign(1.0, value) if value == 0.0 and isinstance(value, float) else 1.0
        number = self._number_for(("value", isinstance(value, bool), kind, value))
        self._values[number] = value
        return number

    def _number_for(self, key: object) -> int:
        return self._numbers.setdefault(key, len(self._numbers))


def labels(expr: Expr) -> tuple[object, ...]:
    """The fields of a node that are no nodes; of tuples their length."""
    values = [getattr(expr, name) for name in expr.__match_args__]
    return tuple(len(v) if isinstance(v, tuple) else v for v in values if not isinstance(v, Node))


def _fold(expr: Unary | Binary | Builtin, known: list[KnownValue | None]) -> float | None:
    """The result of known numbers; None if it has none, or not the same on every machine."""
    match expr:
        case Unary(op=op):
            return _computed(lambda a: -a if op == "-" else None, known)
        case Binary(op=op):
            return _computed(SIGNS[op].value, known)
    function = FUNCTIONS[expr.name]
    if not function.is_foldable:
        return None
    is_real = isinstance(expr.type, Real)
    return _computed(lambda *args: function.value(*(map(float, args) if is_real else args)), known)


def _computed(compute: Callable[..., float | None], known: list[KnownValue | None]) -> float | None:
    """What is computed from numbers; None if they are not known or it is not a finite number."""
    numbers = [k for k in known if isinstance(k, (int, float)) and not isinstance(k, bool)]
    if len(numbers) != len(known):
        return None
    if any(isinstance(n, int) and n.bit_length() > _MOST_BITS for n in numbers):
        return None
    try:
        result = compute(*numbers)
    except (ArithmeticError, ValueError):
        return None
    return None if isinstance(result, float) and not math.isfinite(result) else result
