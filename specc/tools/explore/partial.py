"""Partial evaluation: the residual expression after all known values are filled in.

Known values are literals, expressions themselves. Subexpressions without unknown values are
computed by `specc.lang.evaluate`. The others stay as they are, with their lets expanded.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import islice
from sys import float_info
from typing import Any, Final, TypeGuard

from specc.analysis.suspicious_expressions import evaluated_parts, failure
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import Environment, evaluate, range_of
from specc.lang.kinds import kind
from specc.lang.ranges import Range
from specc.lang.values import SIGNS
from specc.limits import MAX_EXPRESSION_PARTS
from specc.model import expr as m
from specc.model.expr import junction, negation, truth
from specc.model.system import Subsystem, System
from specc.model.types import (
    Int,
    OptionalOf,
    Type,
    Vector,
)
from specc.proof import InputName
from specc.proof.clock import TurningPoints
from specc.tools.explore.regions import BoundedUnknown, Region, is_number, value_leaves

MAX_FLOAT = float_info.max
MAX_EXACT = 2**53
"""Up to it integers equal floats; beyond it, integers and reals differ."""
SOME: Final = "some"
"""An unknown value that is present (not None)."""
AbstractValue = m.Expr | Region | BoundedUnknown | str
"""A literal, a region of numbers, bounds of an unknown one, or SOME."""


@dataclass(eq=False, slots=True)
class KnownValues:
    """The known values for evaluating expressions of a subsystem; missing ones are unknown."""

    lets: Mapping[str, m.Expr]
    constants: Mapping[str, m.Expr]
    period_s: Fraction
    inputs: Mapping[InputName, AbstractValue] = field(default_factory=dict)
    memory: Mapping[str, AbstractValue] = field(default_factory=dict)
    fresh: Mapping[InputName, bool] = field(default_factory=dict)
    present: Mapping[InputName, bool] = field(default_factory=dict)
    periods: int | None = None
    """Periods since the state was entered; only expressions in `turns` depend on it."""
    turns: dict[int, tuple[m.Expr, TurningPoints]] = field(default_factory=dict)
    """The periods at which an expression that time alone decides turns, by its identity."""
    _residuals: dict[str | int, m.Expr] = field(default_factory=dict)
    """The residuals of lets, by name, and of conditions, by identity."""

    def value_of(self, leaf: m.Expr) -> AbstractValue | None:
        """The known value of an input or of memory."""
        if isinstance(leaf, m.Input):
            return self.inputs.get((leaf.peer, leaf.element))
        return self.memory.get(leaf.name) if isinstance(leaf, m.MemoryRef) else None

    def cached_residual(self, condition: m.Expr) -> m.Expr:
        """A condition with all known values filled in, remembered until the time is set."""
        key = id(condition)
        if key not in self._residuals:
            self._residuals[key] = residual(condition, self)
        return self._residuals[key]

    def range_of(self, expr: m.Expr) -> Range | None:
        """The known region of an input or of memory, if any."""
        value = self.value_of(expr)
        return (value.low, value.high) if isinstance(value, (Region, BoundedUnknown)) else None

    def reads_region(self, expr: m.Expr) -> bool:
        """Whether it reads an input or memory of which only the region is known."""
        return self._reads(expr, Region)

    def reads_range(self, expr: m.Expr) -> bool:
        """Whether it reads an input or memory of which a range is known, and not the value."""
        return self._reads(expr, (Region, BoundedUnknown))

    def _reads(self, expr: m.Expr, kind: type | tuple[type, ...]) -> bool:
        values = (*self.inputs.values(), *self.memory.values())
        return any(isinstance(value, kind) for value in values) and any(
            isinstance(self.value_of(leaf), kind) for leaf in value_leaves(expr)
        )


def static_values(subsystem: Subsystem, system: System) -> KnownValues:
    """The values of a subsystem that are known at all times."""
    known = KnownValues(
        {item.name: item.value for item in subsystem.lets}, {}, 1 / subsystem.rate_hz
    )
    constants: dict[str, m.Expr] = {}
    for constant in (*system.constants, *subsystem.constants):  # each names only those before it
        constants[constant.name] = residual(constant.value, replace(known, constants=constants))
    return replace(known, constants=constants)


def is_literal(expr: m.Expr) -> bool:
    """Whether an expression is a literal that a run represents exactly."""
    if isinstance(expr, m.Items):
        return all(map(is_literal, expr.items))
    if isinstance(expr, m.Number) and isinstance(expr.value, int):
        return abs(expr.value) <= MAX_EXACT
    return isinstance(expr, _LITERALS)


def is_known(value: AbstractValue | None) -> TypeGuard[m.Expr]:
    """Whether the value itself is known, not only its presence or region."""
    return value is not None and not isinstance(value, (Region, BoundedUnknown, str))


_LITERALS = (m.Number, m.Truth, m.TextLiteral, m.Member, m.Nothing, m.Unused)


def literal(value: Any, type_: Type) -> m.Expr | None:
    """A value as an expression; None for values that have no literals."""
    return kind(type_).literal(type_, value, lambda part, item: literal(item, part))


def residual(expr: m.Expr, known: KnownValues) -> m.Expr:
    """Fill in all known values: the result is a literal, or the residual expression."""
    if known.periods and id(expr) in known.turns:
        _, turns = known.turns[id(expr)]
        return truth(turns.first != sum(turn <= known.periods for turn in turns.at) % 2)
    rule = _RULES.get(type(expr))
    if rule is not None:
        return rule(expr, known)
    return _evaluated(m.map_children(expr, lambda part: residual(part, known)))


def _evaluated(expr: m.Expr) -> m.Expr:
    """The value of an expression whose parts are values; unchanged if evaluating it fails."""
    if not isinstance(expr, _COMPUTABLE) or not all(map(is_literal, m.children(expr))):
        return expr
    try:
        value = literal(evaluate(expr, Environment()), expr.type)
    except (ArithmeticError, ValueError, TypeError, LookupError):
        return expr
    return expr if value is None else value


def may_fail(expr: m.Expr, lets: Collection[str]) -> bool:
    """Whether a part of an expression has no result for some numbers, or is one of these lets."""
    return any(
        (isinstance(node, m.Binary) and SIGNS[node.op].may_fail and not _has_safe_operand(node))
        or (isinstance(node, m.Builtin) and FUNCTIONS[node.name].may_fail)
        or (isinstance(node, m.LetRef) and node.name in lets)
        for node in m.walk(expr)
    )


def _has_safe_operand(expr: m.Binary) -> bool:
    """Whether its right operand is a constant with which no number fails, as a divisor but 0.

    Where zero and the least and greatest numbers do not fail, neither do those between them.
    """
    if not isinstance(expr.right, m.Number):
        return False
    extremes = (replace(expr.right, value=number) for number in (-MAX_FLOAT, 0.0, MAX_FLOAT))
    return not any(failure(replace(expr, left=left), _number) for left in extremes)


def surely_fails(expr: m.Expr) -> bool:
    """Whether a residual expression surely has no result, as a division by zero."""
    if is_number(expr) and failure(expr, _number):
        return True
    return any(map(surely_fails, evaluated_parts(expr, lambda condition: "settled")))


def _number(expr: m.Expr) -> float | None:
    return expr.value if isinstance(expr, m.Number) and is_literal(expr) else None


_COMPUTABLE = (m.Unary, m.Binary, m.Compare, m.IsOneOf, m.Builtin)


# One rule for each kind of node that can be decided without all of its parts.


def _known_value(values: Mapping[Any, AbstractValue], key: Any, expr: m.Expr) -> m.Expr:
    value = values.get(key, SOME)
    return value if is_known(value) else expr


def _let(expr: m.LetRef, known: KnownValues) -> m.Expr:
    """The value of a let; the let itself where its value, written out, is too large."""
    if expr.name not in known._residuals:
        value = residual(known.lets[expr.name], known)
        known._residuals[expr.name] = expr if is_larger_than(value, MAX_EXPRESSION_PARTS) else value
    return known._residuals[expr.name]


def is_larger_than(expr: m.Expr, parts: int) -> bool:
    """Whether an expression has more than `parts` parts; stops counting there."""
    return next(islice(m.walk(expr), parts, None), None) is not None


def _constant(expr: m.ConstantRef, known: KnownValues) -> m.Expr:
    value = known.constants.get(expr.name)
    if expr.is_live and value is not None:
        return residual(value, known)
    return value if value is not None and is_literal(value) else expr


def _known_answer(answers: Mapping[InputName, bool], expr: m.Fresh | m.Present) -> m.Expr:
    answer = answers.get((expr.input.peer, expr.input.element))
    return expr if answer is None else truth(answer)


def _clock(expr: m.Clock, known: KnownValues) -> m.Expr:
    if expr.name == "period":
        return m.Number(float(known.period_s), type=expr.type)
    if known.periods is not None and expr.name == "entered":
        return truth(known.periods == 0)
    return m.Number(0.0, type=expr.type) if known.periods == 0 else expr


def _fold_by_range(expr: m.Compare | m.Builtin, known: KnownValues) -> m.Expr:
    """The expression, or its value if ranges decide it."""
    value = _evaluated(m.map_children(expr, lambda part: residual(part, known)))
    if isinstance(value, (m.Compare, m.Builtin)) and (known.reads_range(value) or m.is_live(value)):
        least, greatest = range_of(value, known.range_of)
        if least == greatest and isinstance(value, m.Compare):
            return truth(bool(least))
        if least == greatest and isinstance(value.type, Int) and abs(least) <= MAX_EXACT:
            return m.Number(int(least), type=value.type)
    return value


def _unary(expr: m.Unary, known: KnownValues) -> m.Expr:
    operand = residual(expr.operand, known)
    return negation(operand) if expr.op == "not" else _evaluated(replace(expr, operand=operand))


def _logic(expr: m.Logic, known: KnownValues) -> m.Expr:
    end, parts = expr.op == "or", list[m.Expr]()
    for operand in expr.operands:
        part = residual(operand, known)
        if not isinstance(part, m.Truth):
            parts.append(part)
        elif part.value == end and not (parts and surely_fails(parts[0])):
            return part
    return junction(expr.op, parts)


def _choice(expr: m.Choice, known: KnownValues) -> m.Expr:
    test = residual(expr.test, known)
    if isinstance(test, m.Truth):
        return residual(expr.then if test.value else expr.otherwise, known)
    then, otherwise = residual(expr.then, known), residual(expr.otherwise, known)
    is_same = then == otherwise and not surely_fails(test)
    return then if is_same else replace(expr, test=test, then=then, otherwise=otherwise)


def _is_none(expr: m.IsNone, known: KnownValues) -> m.Expr:
    value = residual(expr.value, known)
    if isinstance(value, m.Nothing):
        return m.TRUE
    return m.FALSE if is_some(value, known) else replace(expr, value=value)


def is_some(value: m.Expr, known: KnownValues) -> bool:
    """Whether a residual expression is surely present (not None)."""
    if not isinstance(value.type, OptionalOf):
        return not isinstance(value, m.Nothing)
    match value:
        case m.Input(peer=peer, element=element):
            return (peer, element) in known.inputs
        case m.MemoryRef(name=name):
            return name in known.memory
    return False


def _sure(expr: m.Unwrap, known: KnownValues) -> m.Expr:
    value = residual(expr.value, known)
    return value if is_literal(value) else replace(expr, value=value)


def _component(expr: m.Component, known: KnownValues) -> m.Expr:
    value = residual(expr.value, known)
    if isinstance(value, m.Items) and expr.index < len(value.items):
        return value.items[expr.index]
    return replace(expr, value=value)


def _quantifier(expr: m.Quantifier, known: KnownValues) -> m.Expr:
    over = residual(expr.over, known)
    items = over.items if isinstance(over, m.Items) and expr.kind in ("all", "any") else None
    if items is None or _expanded_size(expr.body, known) * len(items) > MAX_EXPRESSION_PARTS:
        return replace(expr, over=over, body=residual(expr.body, known))
    each = tuple(m.instantiate(expr.body, expr.variable, item) for item in items)
    return _logic(m.Logic("and" if expr.kind == "all" else "or", each, type=expr.type), known)


def _expanded_size(body: m.Expr, known: KnownValues) -> int:
    """The size of the body of a quantifier after the quantifiers in it are expanded."""
    if not isinstance(body, m.Quantifier):
        return 1 + sum(_expanded_size(part, known) for part in m.children(body))
    over = body.over
    over = known.constants.get(over.name, over) if isinstance(over, m.ConstantRef) else over
    size = over.type.size if isinstance(over.type, Vector) else 1
    size = len(over.items) if isinstance(over, m.Items) else size
    return size * _expanded_size(body.body, known)


_RULES: dict[type, Callable[[Any, KnownValues], m.Expr]] = {
    m.Input: lambda e, known: _known_value(known.inputs, (e.peer, e.element), e),
    m.MemoryRef: lambda e, known: _known_value(known.memory, e.name, e),
    m.LetRef: _let,
    m.ConstantRef: _constant,
    m.Fresh: lambda e, known: _known_answer(known.fresh, e),
    m.Present: lambda e, known: _known_answer(known.present, e),
    m.Lag: lambda e, known: e,
    m.Clock: _clock,
    m.Compare: _fold_by_range,
    m.Builtin: _fold_by_range,
    m.Unary: _unary,
    m.Logic: _logic,
    m.Choice: _choice,
    m.IsNone: _is_none,
    m.Unwrap: _sure,
    m.Component: _component,
    m.Quantifier: _quantifier,
}
