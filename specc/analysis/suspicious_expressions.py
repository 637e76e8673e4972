"""Expressions that are well typed and cannot be meant, for what is known of their numbers.

Known numbers are those that are written down, also through lets, constants, parameters, and memory
that nothing writes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

from specc.analysis.failures import Answer, failure, is_asked
from specc.analysis.reads import Dependences, ExpressionText, text_of, texts, texts_of_system
from specc.lang import ranges
from specc.lang.bounds import bounded
from specc.lang.builtins import FUNCTIONS
from specc.lang.ranges import Range
from specc.lang.row import BuiltinFunction
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
    LetRef,
    Logic,
    MemoryRef,
    Offsets,
    Quantifier,
    Unary,
    children,
    has_unknown,
    walk,
)
from specc.model.fsm import Assignment
from specc.model.system import Constant, Let, Memory, Subsystem, System
from specc.model.types import Real, Vector
from specc.model.units import RADIAN
from specc.proof import Depths, Numbering
from specc.source import Place

UNIT_LENGTH_WITHIN = 1e-3
"""How far the length of a quaternion may be from 1."""
_ONE = -1
"""Stands for what is known in a sum."""
_ROUNDING = 1e-9
_ANGLE_OF_ALL = math.pi * (1 - 1e-12)
"""No two orientations are further apart."""
_WHOLE_TURN = 2 * _ANGLE_OF_ALL


@dataclass(frozen=True, slots=True)
class SuspiciousExpression:
    """`expr` in a text cannot be meant because of its parts `because`; `number` is what they are.

    `origin` is where the first of these parts was written down; `why` it fails, if it does.
    """

    kind: Literal[
        "tolerance", "angle", "turn", "quaternion", "bounds", "itself", "unchanged", "fails"
    ]
    expr: Expr
    text: ExpressionText
    because: tuple[Expr, ...]
    origin: tuple[ExpressionText, Expr]
    number: float = 0.0
    why: str = ""


class SuspiciousExpressions:
    """Finds them in one subsystem, or in the constants of a system."""

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
        writing: list[Assignment] = []
        if isinstance(owner, Subsystem):
            writing = [a for f in owner.functions for a in f.assignments if not a.peer]
            written = {item.name for item in writing}
            self._named |= {(LetRef, item.name): item for item in owner.lets}
            self._named |= {
                (MemoryRef, item.name): item for item in owner.memory if item.name not in written
            }
        self._constants = {constant.place for constant in owner.constants}
        self._lets = {item.place for item in owner.lets} if isinstance(owner, Subsystem) else set()
        every = texts(owner) if isinstance(owner, Subsystem) else tuple(texts_of_system(owner))
        asked = (text for text in every if not isinstance(text.expr, LITERALS))
        found = [m for text in asked for m in self._in(text, text.expr, {})]
        self.found = tuple(_in_all_copies([*found, *self._unchanged_memory(writing)], every))
        self._at = {id(part.expr) for part in self.found}
        self._spoilt: set[str] = set()
        for item in owner.lets if isinstance(owner, Subsystem) else ():
            if self.within(item.value):
                self._spoilt.add(item.name)

    def within(self, expr: Expr) -> bool:
        """Whether an expression has one, itself or in a let."""
        return bool(self._at) and any(
            id(node) in self._at or (isinstance(node, LetRef) and node.name in self._spoilt)
            for node in walk(expr)
        )

    def _in(
        self, text: ExpressionText, expr: Expr, bound: Depths
    ) -> Iterator[SuspiciousExpression]:
        if isinstance(expr, Builtin):
            yield from self._of_call(text, expr, FUNCTIONS[expr.name])
        if isinstance(expr, Compare):
            yield from self._difference(text, expr)
        if (why := failure(expr, self._value)) and self._is_surely_asked(text, expr):
            yield SuspiciousExpression("fails", expr, text, (expr,), (text, expr), why=why)
        yield from self._itself(text, expr, bound)
        for child in children(expr):
            inside = bound
            if isinstance(expr, Quantifier) and child is expr.body:
                inside = {**bound, expr.variable: len(bound)}
            yield from self._in(text, child, inside)

    def _of_call(
        self, text: ExpressionText, call: Builtin, function: BuiltinFunction
    ) -> Iterator[SuspiciousExpression]:
        if function.compares:
            yield from self._tolerances(text, call, call.args[2:])
        if function.direction is not None:
            yield from self._quaternion(text, call, call.args[function.direction])
        if function.picks:
            yield from self._clamp(text, call) or self._computed_clamp(text, call)
        if function.limits is not None:
            yield from self._crossed(text, call, function.limits)
        if function.neutral is not None:
            place, value, _ = function.neutral
            if self._value(call.args[place]) == value:
                yield SuspiciousExpression("unchanged", call, text, call.args[:1], (text, call))

    def _is_surely_asked(self, text: ExpressionText, part: Expr) -> bool:
        """Whether no constant decides that a part of a text is left out.

        Constants without a value, also those that stand in a text by name, are told of elsewhere. A
        let may be asked for in a branch.
        """
        begin, end = part.span
        by_name = any(each.span[0] < begin or each.span[1] > end for each in children(part))
        if text.part in self._constants or by_name:
            return False
        if text.part in self._lets:
            return not self._rests_on_constants(part)
        return is_asked(text.expr, part, self._answer)

    def _rests_on_constants(self, expr: Expr) -> bool:
        """Also through lets, and on memory that nothing writes."""
        on = self._dependences.of(expr)
        return bool(on.constants) or any((MemoryRef, name) in self._named for name in on.memory)

    def _answer(self, test: Expr) -> Answer:
        """Whether a condition holds, as far as constants decide it."""
        value = self._numbering.constant_value(self._numbering.number(test))
        least, greatest = bounded(test, self._known)
        if isinstance(value, bool) or least == greatest:
            return "yes" if (value if isinstance(value, bool) else least) else "no"
        return "settled" if self._rests_on_constants(test) else "some"

    def _unchanged_memory(self, writing: Iterable[Assignment]) -> Iterator[SuspiciousExpression]:
        """Memory that is given the value that it has."""
        number = self._numbering.number
        for item in writing:
            value, memory = item.value, MemoryRef(item.name, type=item.value.type)
            if number(value) == number(memory):
                text = text_of(item)
                yield SuspiciousExpression("unchanged", value, text, (memory,), (text, value))

    def _tolerances(
        self, text: ExpressionText, near: Builtin, limits: tuple[Expr, ...]
    ) -> Iterator[SuspiciousExpression]:
        for limit, is_angle in zip(limits, (False, True), strict=False):
            value = self._value(limit)
            if value is not None and value <= 0:
                yield SuspiciousExpression(
                    "tolerance", near, text, (limit,), self._origin(text, limit), value
                )
            elif value is not None and is_angle and value >= _ANGLE_OF_ALL:
                yield SuspiciousExpression(
                    "angle", near, text, (limit,), self._origin(text, limit), value
                )
            elif not is_angle:
                yield from self._turn(text, near, near.args[0], limit)

    def _turn(
        self, text: ExpressionText, asked: Expr, compared: Expr, limit: Expr
    ) -> Iterator[SuspiciousExpression]:
        """A difference of angles that is compared with a whole turn or more."""
        value, of = self._value(limit), compared.type
        unit = of.element if isinstance(of, Vector) else of
        is_angle = isinstance(unit, Real) and unit.unit == RADIAN
        if is_angle and value is not None and value >= _WHOLE_TURN:
            yield SuspiciousExpression(
                "turn", asked, text, (limit,), self._origin(text, limit), value
            )

    def _difference(self, text: ExpressionText, asked: Compare) -> Iterator[SuspiciousExpression]:
        """`abs(a - b) < 360[deg]`, or of a component of a difference."""
        through = self._numbering.resolve
        for side, limit in ((asked.left, asked.right), (asked.right, asked.left)):
            size = through(side)
            if isinstance(size, Builtin) and FUNCTIONS[size.name].is_size:
                difference = through(size.args[0])
                if isinstance(difference, Component):
                    difference = through(difference.value)
                if isinstance(difference, Binary) and difference.op == "-":
                    yield from self._turn(text, asked, difference, limit)

    def _quaternion(
        self, text: ExpressionText, pose: Expr, quaternion: Expr
    ) -> Iterator[SuspiciousExpression]:
        origin = self._origin(text, quaternion)
        if not isinstance(origin[1], Items):
            return
        parts = [part for item in origin[1].items if (part := self._value(item)) is not None]
        length = math.hypot(*parts)
        if len(parts) == 4 and not abs(length - 1) <= UNIT_LENGTH_WITHIN:
            yield SuspiciousExpression("quaternion", pose, text, (quaternion,), origin, length)

    def _clamp(self, text: ExpressionText, outer: Builtin) -> list[SuspiciousExpression]:
        """`min(max(a, 2), 1)` is 1, and `max(min(a, 1), 2)` is 2."""
        known = [(value, arg) for arg in outer.args if (value := self._value(arg)) is not None]
        if not known:
            return []
        is_least = _picks(outer) < 0
        tightest = min if is_least else max
        value, limit = tightest(known, key=lambda pair: pair[0])
        for inner in outer.args:
            whole = self._origin(text, inner)[1]
            if _picks(whole) != -_picks(outer):
                continue
            if self._value(inner) is not None:
                continue
            least, most = bounded(whole, self._known)
            if least > value if is_least else most < value:
                because = limit, inner
                return [
                    SuspiciousExpression(
                        "bounds", outer, text, because, self._origin(text, limit), value
                    )
                ]
        return []

    def _crossed(
        self, text: ExpressionText, call: Builtin, limits: tuple[int, int]
    ) -> Iterator[SuspiciousExpression]:
        """`clamp(a, 2, 1)` is 1."""
        low, high = (call.args[place] for place in limits)
        if self._exceeds(low, high):
            value = self._value(high)
            origin = (text, call) if value is None else self._origin(text, high)
            yield SuspiciousExpression("bounds", call, text, (high, low), origin, value or 0.0)

    def _computed_clamp(self, text: ExpressionText, outer: Builtin) -> list[SuspiciousExpression]:
        """`min(max(a, b + 1), b)` is b."""
        sign = -_picks(outer)
        for inner in outer.args:
            if not isinstance(inner, Builtin) or _picks(inner) != -_picks(outer):
                continue
            for limit, other in product(outer.args, inner.args):
                if limit is inner:
                    continue
                lower, upper = (other, limit) if sign > 0 else (limit, other)
                if self._exceeds(lower, upper):
                    return [
                        SuspiciousExpression("bounds", outer, text, (limit, other), (text, outer))
                    ]
        return []

    def _exceeds(self, one: Expr, other: Expr) -> bool:
        """Whether an expression is surely greater than another one, by the same each time."""
        apart = self._sum(one, 1)
        for part, times in self._sum(other, -1).items():
            apart[part] = apart.get(part, 0.0) + times
        left = {part: times for part, times in apart.items() if abs(times) > _ROUNDING}
        return left.keys() == {_ONE} and left[_ONE] > 0

    def _sum(self, expr: Expr, times: float) -> dict[int, float]:
        """An expression as a sum of multiples of what is not known, by its number."""
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

    def _known(self, expr: Expr) -> Range | None:
        value = self._value(expr)
        return None if value is None else ranges.of_value(value)

    def _itself(
        self, text: ExpressionText, expr: Expr, bound: Depths
    ) -> Iterator[SuspiciousExpression]:
        match expr:
            case Compare(left=left, right=right) | Binary(op="-" | "/", left=left, right=right):
                pairs = [(left, right)]
            case Builtin(name=name, args=args) if FUNCTIONS[name].alike:
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
                yield SuspiciousExpression("itself", expr, text, (one, other), (text, at))
                return

    def _alike(self, args: tuple[Expr, ...], bound: Depths) -> Iterator[tuple[Expr, Expr]]:
        """Arguments that have one value, each with the first of them."""
        first: dict[int, Expr] = {}
        for arg in args:
            earlier = first.setdefault(self._numbering.number(arg, bound), arg)
            if earlier is not arg:
                yield earlier, arg

    def _same(self, one: Expr, other: Expr, bound: Depths) -> bool:
        """Whether two expressions have one value, and not by what constants happen to be."""
        if self._numbering.number(one, bound) != self._numbering.number(other, bound):
            return False
        return self.varies(one) or (one == other and _refers(one))

    def varies(self, expr: Expr) -> bool:
        """Whether an expression is known, and depends on more than constants."""
        on = self._dependences.of(expr)
        written = any((MemoryRef, name) not in self._named for name in on.memory)
        return not has_unknown(expr) and (written or not on.lasts)

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
    """Those that are there in all copies of what is written once, for the members of a group.

    Arithmetic that fails in one of them is wrong, too.
    """
    if not found:
        return
    copies = Counter(_written(text, node) for text in every for node in walk(text.expr))
    alike = Counter(_written(part.text, part.expr) for part in found)
    for part in found:
        key = _written(part.text, part.expr)
        if alike[key] >= copies[key] or part.kind == "fails":
            yield part


def _written(text: ExpressionText, node: Expr) -> tuple[Place, str, Offsets, type]:
    return text.part, text.key, node.span, type(node)


def _picks(expr: Expr) -> int:
    """-1 for the least of some numbers, 1 for the greatest, 0 for what is neither."""
    return FUNCTIONS[expr.name].picks if isinstance(expr, Builtin) else 0


def _refers(expr: Expr) -> bool:
    return any(isinstance(node, (ConstantRef, MemoryRef, LetRef)) for node in walk(expr))
