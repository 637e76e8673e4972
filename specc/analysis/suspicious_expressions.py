"""Expressions that are well typed and surely a mistake, by what is known of their numbers.

Known numbers are those that are written down, also through lets, constants, parameters, and memory
that nothing writes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, Literal

from specc.analysis.reads import Dependences, ExpressionText, text_of, texts, texts_of_system
from specc.lang import ranges
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import Environment, evaluate, range_of
from specc.lang.functions import BuiltinFunction
from specc.lang.ranges import Range
from specc.lang.values import SIGNS
from specc.limits import TooMuchError
from specc.model.expr import (
    LITERALS,
    Binary,
    Builtin,
    Choice,
    Compare,
    Component,
    ConstantRef,
    Expr,
    Items,
    LazyByDependence,
    LetRef,
    Live,
    Logic,
    MemoryRef,
    Offsets,
    Quantifier,
    Unary,
    children,
    has_unknown,
    is_live,
    walk,
)
from specc.model.fsm import Assignment
from specc.model.system import Constant, Let, Memory, Subsystem, System
from specc.model.types import Real, Vector
from specc.model.units import RADIAN
from specc.proof import Depths, Numbering
from specc.reachable import reachable
from specc.source import Place


def no_value(error: Exception) -> str:
    """Explain why arithmetic has no result."""
    match error:
        case TooMuchError():
            return str(error)
        case OverflowError():
            return "it is too large"
        case ZeroDivisionError():
            return "it divides by zero"
    return "it takes a root of a negative number" if "domain" in str(error) else str(error)


def failure(expr: Expr, value: Callable[[Expr], float | None]) -> str:
    """Explain why an operation has no result; "" if it may have one.

    `value` gives the number that a part is, None if it is not known.
    """
    known = [value(part) for part in children(expr)]
    match expr:
        case Binary(op=op) if SIGNS[op].may_fail:
            compute = SIGNS[op].value
            if op == "/" and known[0] is None:
                known[0] = 1.0  # whatever it is, only a divisor of zero fails
        case Builtin(name=name) if FUNCTIONS[name].may_fail and FUNCTIONS[name].is_foldable:
            compute = FUNCTIONS[name].value
        case _:
            return ""
    if None in known:
        return ""
    try:
        compute(*known)
    except (ArithmeticError, ValueError) as error:
        return no_value(error)
    return ""


Answer = Literal["yes", "no", "some", "settled"]
"""Whether a condition holds: always, never, at times, or as constants say that are not known."""


def is_evaluated(whole: Expr, part: Expr, answer: Callable[[Expr], Answer]) -> bool:
    """Whether every evaluation of an expression surely evaluates a part of it."""
    if whole is part:
        return True
    return any(is_evaluated(each, part, answer) for each in evaluated_parts(whole, answer))


def evaluated_parts(whole: Expr, answer: Callable[[Expr], Answer]) -> Iterator[Expr]:
    """The direct parts that some evaluation computes; a "settled" test leaves that open."""
    match whole:
        case Choice(test=test, then=then, otherwise=otherwise):
            yield test
            known = answer(test)
            if known in ("yes", "some"):
                yield then
            if known in ("no", "some"):
                yield otherwise
        case Logic(op=op, operands=operands):
            goes_on = "yes" if op == "and" else "no"
            for operand in operands:
                yield operand
                if answer(operand) not in (goes_on, "some"):
                    return
        case Quantifier(over=over):
            yield over
        case _:
            yield from children(whole)


UNIT_LENGTH_WITHIN = 1e-3
"""How far the length of a quaternion may be from 1."""
_MOST_LIVE = 4
"""Constants that may change in an expression whose values are looked at."""
_QUATERNION = 4
"""Components of one; an axis has three."""
_ONE = -1
"""Stands for what is known in a sum."""
_ROUNDING = 1e-9
_ANGLE_OF_ALL = math.pi * (1 - 1e-12)
"""No two orientations are further apart."""
_WHOLE_TURN = 2 * _ANGLE_OF_ALL


@dataclass(frozen=True, slots=True)
class SuspiciousExpression:
    """`expr` in a text is surely a mistake because of its parts `causes`; `number` is their value.

    `origin` is where the first of these parts was written down; `why` says why it fails.
    """

    kind: Literal[
        "tolerance",
        "angle",
        "turn",
        "quaternion",
        "axis",
        "bounds",
        "itself",
        "unchanged",
        "fails",
        "fails in range",
    ]
    expr: Expr
    text: ExpressionText
    causes: tuple[Expr, ...]
    origin: tuple[ExpressionText, Expr]
    number: float = 0.0
    why: str = ""


class SuspiciousExpressions:
    """Finds them in one subsystem, or in the constants of a system, in one walk."""

    def __init__(
        self,
        owner: Subsystem | System,
        constants: Mapping[str, Constant],
        dependences: Dependences,
        numbering: Numbering,
    ) -> None:
        """`constants` of the system; `numbering` and `dependences` know those, and the lets."""
        self._dependences = dependences
        self._numbering = numbering
        own = (*constants.values(), *owner.constants)
        self._named: dict[tuple[type, str], Constant | Let | Memory] = {
            (ConstantRef, constant.name): constant for constant in own
        }
        every, lets, writing = tuple[ExpressionText, ...](), tuple[Let, ...](), list[Assignment]()
        if isinstance(owner, Subsystem):
            every, lets = tuple(texts(owner)), owner.lets
            writing = [a for f in owner.functions for a in f.assignments if not a.peer]
            written = {item.name for item in writing}
            unwritten = (item for item in owner.memory if item.name not in written)
            self._named |= {(LetRef, item.name): item for item in lets}
            self._named |= {(MemoryRef, item.name): item for item in unwritten}
        else:
            every = tuple(texts_of_system(owner))
        self._has_live = any(is_live(constant.value) for constant in own)
        self._constants = {constant.place for constant in owner.constants}
        self._lets = {item.place for item in lets}
        self._found: list[SuspiciousExpression] = []
        for text in every:
            if not isinstance(text.expr, LITERALS):
                self._visit(text, text.expr, {})
        for item in writing:
            memory = MemoryRef(item.name, type=item.value.type)
            if numbering.number(item.value) == numbering.number(memory):
                self._add("unchanged", text_of(item), item.value, memory)
        self.all = tuple(_in_all_copies(self._found, every))
        self._at = {id(part.expr) for part in self.all}
        self._lets_with_any: set[str] = set()
        for let in lets:
            if self.is_in(let.value):
                self._lets_with_any.add(let.name)

    def is_in(self, expr: Expr) -> bool:
        """Whether an expression is suspicious, itself or in a let."""
        return bool(self._at) and any(
            id(node) in self._at or (isinstance(node, LetRef) and node.name in self._lets_with_any)
            for node in walk(expr)
        )

    def varies(self, expr: Expr) -> bool:
        """Whether an expression is known, and depends on more than constants."""
        on = self._dependences.of(expr)
        written = any((MemoryRef, name) not in self._named for name in on.memory)
        return not has_unknown(expr) and (written or not on.is_stable)

    def _add(
        self,
        kind: Any,
        text: ExpressionText,
        expr: Expr,
        *causes: Expr,
        origin: tuple[ExpressionText, Expr] | None = None,
        number: float = 0.0,
        why: str = "",
    ) -> None:
        origin = origin or (text, expr)
        self._found.append(SuspiciousExpression(kind, expr, text, causes, origin, number, why))

    def _visit(self, text: ExpressionText, expr: Expr, bound: Depths) -> None:
        if isinstance(expr, Builtin):
            self._check_call(text, expr, FUNCTIONS[expr.name])
        if isinstance(expr, Compare):
            self._check_difference(text, expr)
        if (why := failure(expr, self._value)) and self._is_surely_evaluated(text, expr):
            self._add("fails", text, expr, expr, why=why)
        elif (why := self._failure_in_range(expr)) and self._is_surely_evaluated(text, expr):
            self._add("fails in range", text, expr, expr, why=why)
        self._check_itself(text, expr, bound)
        for child in children(expr):
            inside = bound
            if isinstance(expr, Quantifier) and child is expr.body:
                inside = {**bound, expr.variable: len(bound)}
            self._visit(text, child, inside)

    # Calls.

    def _check_call(self, text: ExpressionText, call: Builtin, function: BuiltinFunction) -> None:
        if function.compares:
            self._check_tolerances(text, call)
        if function.direction is not None:
            self._check_direction(text, call, call.args[function.direction])
        if function.picks and not self._check_clamp(text, call):
            self._check_computed_clamp(text, call)
        if function.limits is not None:
            low, high = (call.args[place] for place in function.limits)
            if self._exceeds(low, high):  # `clamp(a, 2, 1)` is 1
                value = self._value(high)
                origin = (text, call) if value is None else self._origin(text, high)
                self._add("bounds", text, call, high, low, origin=origin, number=value or 0.0)
        if function.neutral is not None:
            place, neutral, _ = function.neutral
            if self._value(call.args[place]) == neutral:
                self._add("unchanged", text, call, *call.args[:1])

    def _check_direction(self, text: ExpressionText, call: Builtin, direction: Expr) -> None:
        """A quaternion whose length is not 1, or an axis of no length."""
        origin = self._origin(text, direction)
        items = origin[1].items if isinstance(origin[1], Items) else ()
        parts = [part for item in items if (part := self._value(item)) is not None]
        length = math.hypot(*parts)
        kind = "quaternion" if len(items) == _QUATERNION else "axis"
        is_meant = abs(length - 1) <= UNIT_LENGTH_WITHIN if kind == "quaternion" else length > 0
        if items and len(parts) == len(items) and not is_meant:
            self._add(kind, text, call, direction, origin=origin, number=length)

    def _check_tolerances(self, text: ExpressionText, near: Builtin) -> None:
        for limit, is_angle in zip(near.args[2:], (False, True), strict=False):
            value = self._least(limit) if self._value(limit) is None else self._value(limit)
            kind = "tolerance" if value is not None and value <= 0 else "angle" if is_angle else ""
            if value is not None and kind and (value <= 0 or value >= _ANGLE_OF_ALL):
                self._add(kind, text, near, limit, origin=self._origin(text, limit), number=value)
            elif not is_angle:
                self._check_turn(text, near, near.args[0], limit)

    def _check_turn(
        self, text: ExpressionText, comparison: Expr, compared: Expr, limit: Expr
    ) -> None:
        """A difference of angles that is compared with a whole turn or more."""
        value, of = self._value(limit), compared.type
        unit = of.element if isinstance(of, Vector) else of
        is_angle = isinstance(unit, Real) and unit.unit == RADIAN
        if is_angle and value is not None and value >= _WHOLE_TURN:
            self._add(
                "turn", text, comparison, limit, origin=self._origin(text, limit), number=value
            )

    def _check_clamp(self, text: ExpressionText, outer: Builtin) -> bool:
        """`min(max(a, 2), 1)` is 1, and `max(min(a, 1), 2)` is 2."""
        known = [(value, arg) for arg in outer.args if (value := self._value(arg)) is not None]
        if not known:
            return False
        is_least = _picks(outer) < 0
        tightest = min if is_least else max
        value, limit = tightest(known, key=lambda pair: pair[0])
        for inner in outer.args:
            clamped = self._origin(text, inner)[1]
            if _picks(clamped) != -_picks(outer) or self._value(inner) is not None:
                continue
            least, most = range_of(clamped, self._known)
            if least > value if is_least else most < value:
                origin = self._origin(text, limit)
                self._add("bounds", text, outer, limit, inner, origin=origin, number=value)
                return True
        return False

    def _check_computed_clamp(self, text: ExpressionText, outer: Builtin) -> None:
        """`min(max(a, b + 1), b)` is b."""
        for inner in outer.args:
            if not isinstance(inner, Builtin) or _picks(inner) != -_picks(outer):
                continue
            for limit, other in product(outer.args, inner.args):
                lower, upper = (other, limit) if _picks(outer) < 0 else (limit, other)
                if limit is not inner and self._exceeds(lower, upper):
                    self._add("bounds", text, outer, limit, other)
                    return

    def _exceeds(self, one: Expr, other: Expr) -> bool:
        """Whether an expression is surely greater than another one, by a constant."""
        difference = self._sum(one, 1)
        for part, times in self._sum(other, -1).items():
            difference[part] = difference.get(part, 0.0) + times
        left = {part: times for part, times in difference.items() if abs(times) > _ROUNDING}
        return left.keys() == {_ONE} and left[_ONE] > 0

    def _sum(self, expr: Expr, times: float) -> dict[int, float]:
        """An expression as a linear combination of unknown parts, by value number."""
        if (value := self._value(expr)) is not None:
            return {_ONE: value * times}
        match expr:
            case Unary(op="-", operand=operand):
                return self._sum(operand, -times)
            case Binary(op="+" | "-" as op, left=left, right=right):
                found = self._sum(left, times)
                for part, more in self._sum(right, times if op == "+" else -times).items():
                    found[part] = found.get(part, 0.0) + more
                return found
            case Binary(op="*", left=left, right=right):
                for factor, other in ((left, right), (right, left)):
                    if (value := self._value(factor)) is not None:
                        return self._sum(other, times * value)
            case Binary(op="/", left=left, right=right) if value := self._value(right):
                return self._sum(left, times / value)
        return {self._numbering.number(expr): times}

    # Parts that are the same, and operations that have no result.

    def _check_difference(self, text: ExpressionText, comparison: Compare) -> None:
        """`abs(a - b) < 360[deg]`, or of a component of a difference."""
        through, left, right = self._numbering.resolve, comparison.left, comparison.right
        for side, limit in ((left, right), (right, left)):
            size = through(side)
            if isinstance(size, Builtin) and FUNCTIONS[size.name].is_size:
                difference = through(size.args[0])
                if isinstance(difference, Component):
                    difference = through(difference.value)
                if isinstance(difference, Binary) and difference.op == "-":
                    self._check_turn(text, comparison, difference, limit)

    def _check_itself(self, text: ExpressionText, expr: Expr, bound: Depths) -> None:
        match expr:
            case Compare(left=left, right=right) | Binary(op="-" | "/", left=left, right=right):
                pairs = [(left, right)]
            case Builtin(name=name, args=args) if FUNCTIONS[name].same_arguments:
                compared = args[:2] if FUNCTIONS[name].compares else args
                pairs = list(self._alike(compared, bound))
            case Logic(operands=args):
                pairs = list(self._alike(args, bound))
            case Choice(then=then, otherwise=otherwise):
                pairs = [(then, otherwise)]
                pairs += [(then, otherwise.then)] if isinstance(otherwise, Choice) else []
                pairs += [(then.otherwise, otherwise)] if isinstance(then, Choice) else []
            case _:
                return
        for one, other in pairs:
            written_alike = isinstance(expr, Choice) and one == other and not has_unknown(one)
            if written_alike or self._same(one, other, bound):
                at = other if isinstance(expr, Logic) else expr
                self._add("itself", text, expr, one, other, origin=(text, at))
                return

    def _known(self, expr: Expr) -> Range | None:
        value = self._value(expr)
        return None if value is None else ranges.range_of_value(value)

    # Constants that may change: what they make of an expression at the ends of their ranges.

    def _failure_in_range(self, expr: Expr) -> str:
        """Why an operation has no result for some values of the constants that may change."""
        if not isinstance(expr, (Binary, Builtin)) or not self._may_change(expr):
            return ""
        corners = [partial(self._value_at, corner) for corner in self._corners(expr)]
        found = (failure(expr, value) for value in corners)
        if why := next(filter(None, found), ""):
            return why
        if isinstance(expr, Binary) and expr.op == "/":
            divisors = [value(expr.right) for value in corners]
            known = [divisor for divisor in divisors if divisor is not None]
            if known and min(known) < 0 < max(known):
                return no_value(ZeroDivisionError())
        return ""

    def _may_change(self, expr: Expr) -> bool:
        return self._has_live and self._dependences.of(expr).has_live

    def _least(self, expr: Expr) -> float | None:
        """The least of the values that an expression of constants that may change is known for."""
        if not self._may_change(expr):
            return None
        values = [self._value_at(corner, expr) for corner in self._corners(expr)]
        return min((value for value in values if value is not None), default=None)

    def _corners(self, expr: Expr) -> Iterator[Mapping[str, float]]:
        """The ends of the ranges of the constants that may change, in all combinations."""
        through = self._numbering.resolve
        parts = reachable([through(expr)], lambda part: map(through, children(part)))
        live = {part.name: (part.low, part.high) for part in parts if isinstance(part, Live)}
        ends = product(*live.values()) if len(live) <= _MOST_LIVE else ()
        return (dict(zip(live, each, strict=True)) for each in ends)

    def _value_at(self, corner: Mapping[str, float], expr: Expr) -> float | None:
        """What an expression of constants is worth there; None for others."""

        def named(values: Mapping[str, Expr]) -> Mapping[str, Any]:
            return LazyByDependence(values, lambda name: evaluate(values[name], env))

        constants = {n: text_of(c).expr for (k, n), c in self._named.items() if k is ConstantRef}
        env = Environment(live=corner, constants=named(constants), lets=named(self._numbering.lets))
        try:
            return float(evaluate(expr, env))
        except (LookupError, ArithmeticError, ValueError, TypeError):
            return None

    def _is_surely_evaluated(self, text: ExpressionText, part: Expr) -> bool:
        """Whether no constant decides that a part of a text is left out.

        Constants without a value, also inlined ones, are reported elsewhere. A let may be used in a
        branch.
        """
        begin, end = part.span
        by_name = any(each.span[0] < begin or each.span[1] > end for each in children(part))
        if (text.part in self._constants and not is_live(part)) or by_name:
            return False
        if text.part in self._lets:
            return not self._rests_on_constants(part)
        return is_evaluated(text.expr, part, self._answer)

    def _rests_on_constants(self, expr: Expr) -> bool:
        """Whether an expression depends on constants, or on memory that nothing writes."""
        on = self._dependences.of(expr)
        return bool(on.constants) or any((MemoryRef, name) in self._named for name in on.memory)

    def _answer(self, test: Expr) -> Answer:
        """The truth of a condition, as far as constants decide it."""
        value = self._numbering.constant_value(self._numbering.number(test))
        least, greatest = range_of(test, self._known)
        if isinstance(value, bool) or least == greatest:
            return "yes" if (value if isinstance(value, bool) else least) else "no"
        return "settled" if self._rests_on_constants(test) else "some"

    def _alike(self, args: tuple[Expr, ...], bound: Depths) -> Iterator[tuple[Expr, Expr]]:
        """Arguments that have one value, each with the first of them."""
        first: dict[int, Expr] = {}
        for arg in args:
            earlier = first.setdefault(self._numbering.number(arg, bound), arg)
            if earlier is not arg:
                yield earlier, arg

    def _same(self, one: Expr, other: Expr, bound: Depths) -> bool:
        """Whether two expressions have one value, whatever the values of constants are."""
        if self._numbering.number(one, bound) != self._numbering.number(other, bound):
            return False
        return self.varies(one) or (
            one == other
            and any(isinstance(node, (ConstantRef, MemoryRef, LetRef)) for node in walk(one))
        )

    def _value(self, expr: Expr) -> float | None:
        if isinstance(expr, MemoryRef) and (named := self._named.get((MemoryRef, expr.name))):
            return self._value(text_of(named).expr)
        return self._numbering.constant_number(expr)

    def _origin(self, text: ExpressionText, expr: Expr) -> tuple[ExpressionText, Expr]:
        """Where what an expression names was written down."""
        for _ in self._named:
            named = self._named.get((type(expr), getattr(expr, "name", "")))
            if named is None:
                break
            text = text_of(named)
            expr = text.expr
        return text, expr


def _in_all_copies(
    found: list[SuspiciousExpression], every: Sequence[ExpressionText]
) -> Iterator[SuspiciousExpression]:
    """Those that occur in all copies of a text that is instantiated for the members of a group.

    Arithmetic that fails in one copy is wrong, too.
    """
    if not found:
        return
    copies = Counter(_written(text, node) for text in every for node in walk(text.expr))
    alike = Counter(_written(part.text, part.expr) for part in found)
    for part in found:
        key = _written(part.text, part.expr)
        if alike[key] >= copies[key] or part.kind.startswith("fails"):
            yield part


def _written(text: ExpressionText, node: Expr) -> tuple[Place, str, Offsets, type]:
    return text.part, text.key, node.span, type(node)


def _picks(expr: Expr) -> int:
    """-1 for a minimum of numbers, 1 for a maximum, 0 for anything else."""
    return FUNCTIONS[expr.name].picks if isinstance(expr, Builtin) else 0
