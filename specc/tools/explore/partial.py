"""Partial evaluation: the residual expression after all known values are filled in.

Known values are literals, expressions themselves. Subexpressions without unknown values are
computed by `specc.lang.evaluate`. The others stay as they are, with their lets expanded.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import islice
from typing import Any, Final, TypeGuard

from specc.analysis.failures import asked_parts, failure
from specc.lang.bounds import bounded, operation_of
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import Environment, evaluate
from specc.lang.kinds import kind
from specc.lang.ranges import Range
from specc.lang.signs import SIGNS
from specc.limits import MAX_EXPRESSION_PARTS
from specc.model import expr as m
from specc.model.logic import joined, negation, truth
from specc.model.system import Subsystem, System
from specc.model.types import (
    Int,
    OptionalOf,
    Type,
    Vector,
)
from specc.proof import InputName
from specc.proof.clock import TurningPoints
from specc.tools.explore.lines import EXACT, Line, lined
from specc.tools.explore.regions import Region, Within, is_number, leaves

SOME: Final = "some"
"""An unknown value that is present (not None)."""
AbstractValue = m.Expr | Region | Within | Line | str
"""A literal, a region or line of numbers, what unknown ones lie within, or SOME."""


@dataclass(eq=False, slots=True)
class Known:
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
    times: int = 0
    """How many values of lines are meant: what is filled in holds for all of them."""
    _lets: dict[str | int, m.Expr] = field(default_factory=dict)
    """What is made of lets, by name, and of conditions, by identity."""

    def value_of(self, leaf: m.Expr) -> AbstractValue | None:
        """The known value of an input or of memory."""
        if isinstance(leaf, m.Input):
            return self.inputs.get((leaf.peer, leaf.element))
        return self.memory.get(leaf.name) if isinstance(leaf, m.MemoryRef) else None

    def fill_in(self, condition: m.Expr) -> m.Expr:
        """A condition with all known values filled in, remembered until the time is set."""
        key = id(condition)
        if key not in self._lets:
            self._lets[key] = filled(condition, self)
        return self._lets[key]

    def line_of(self, expr: m.Expr) -> Line | None:
        """The line on which an expression runs, if it does."""

        def leaf(part: m.Expr) -> Line | None:
            value = self.value_of(part)
            return value if isinstance(value, Line) else None

        return lined(expr, leaf, self.times) if self.times else None

    def range_of(self, expr: m.Expr) -> Range | None:
        """The known region of an input or of memory, or the range of a line, if any."""
        value = self.value_of(expr)
        if isinstance(value, (Region, Within)):
            return value.low, value.high
        if self.times and isinstance(expr, m.Compare):  # two lines may never meet
            return self._compared(expr)
        line = self.line_of(expr)
        return None if line is None else line.over(self.times, whole=isinstance(expr.type, Int))

    def _compared(self, expr: m.Compare) -> Range | None:
        left, right = self.line_of(expr.left), self.line_of(expr.right)
        operation = operation_of(expr)
        if left is None or right is None or operation is None:
            return None
        apart = Line(left.base - right.base, left.slope - right.slope)
        return operation(apart.over(self.times), (0, 0))

    def runs(self, expr: m.Expr) -> bool:
        """Whether it reads an input or memory that runs on a line."""
        leaf = leaves(expr) if self.times else ()
        return any(isinstance(self.value_of(each), Line) for each in leaf)

    def is_unclear(self, expr: m.Expr) -> bool:
        """Whether it reads an input or memory of which only the region is known."""
        return self._reads(expr, Region)

    def is_ranged(self, expr: m.Expr) -> bool:
        """Whether it reads an input or memory of which a range is known, and not the value."""
        return self._reads(expr, (Region, Within))

    def _reads(self, expr: m.Expr, kind: type | tuple[type, ...]) -> bool:
        values = (*self.inputs.values(), *self.memory.values())
        return any(isinstance(value, kind) for value in values) and any(
            isinstance(self.value_of(leaf), kind) for leaf in leaves(expr)
        )


def static(subsystem: Subsystem, system: System) -> Known:
    """The values of a subsystem that are known at all times."""
    known = Known({item.name: item.value for item in subsystem.lets}, {}, 1 / subsystem.rate_hz)
    constants: dict[str, m.Expr] = {}
    for constant in (*system.constants, *subsystem.constants):  # each names only those before it
        constants[constant.name] = filled(constant.value, replace(known, constants=constants))
    return replace(known, constants=constants)


def is_literal(expr: m.Expr) -> bool:
    """Whether an expression is a literal that a run represents exactly."""
    if isinstance(expr, m.Items):
        return all(map(is_literal, expr.items))
    if isinstance(expr, m.Number) and isinstance(expr.value, int):
        return abs(expr.value) <= EXACT
    return isinstance(expr, _LITERALS)


def is_known(value: AbstractValue | None) -> TypeGuard[m.Expr]:
    """Whether the value itself is known, not only its presence or region."""
    return value is not None and not isinstance(value, (Region, Within, Line, str))


_LITERALS = (m.Number, m.Truth, m.TextLiteral, m.Member, m.Nothing, m.Unused)


def literal(value: Any, type_: Type) -> m.Expr | None:
    """A value as an expression; None for values that have no literals."""
    return kind(type_).literal(type_, value, lambda part, item: literal(item, part))


def filled(expr: m.Expr, known: Known) -> m.Expr:
    """Fill in all known values: the result is a literal, or the residual expression."""
    if known.periods and id(expr) in known.turns:
        _, turns = known.turns[id(expr)]
        return truth(turns.first != sum(turn <= known.periods for turn in turns.at) % 2)
    rule = _RULES.get(type(expr))
    if rule is not None:
        return rule(expr, known)
    return _computed(m.mapped(expr, lambda part: filled(part, known)))


def _computed(expr: m.Expr) -> m.Expr:
    """The value of an expression whose parts are values; unchanged if evaluating it fails."""
    if not isinstance(expr, _COMPUTABLE) or not all(map(is_literal, m.children(expr))):
        return expr
    try:
        made = literal(evaluate(expr, Environment()), expr.type)
    except (ArithmeticError, ValueError, TypeError, LookupError):
        return expr
    return expr if made is None else made


def may_fail(expr: m.Expr, lets: Collection[str]) -> bool:
    """Whether a part of an expression has no result for some numbers, or is one of these lets."""
    return any(
        (isinstance(node, m.Binary) and SIGNS[node.op].may_fail)
        or (isinstance(node, m.Builtin) and FUNCTIONS[node.name].may_fail)
        or (isinstance(node, m.LetRef) and node.name in lets)
        for node in m.walk(expr)
    )


def fails(expr: m.Expr) -> bool:
    """Whether what filling in left surely has no result, as a division by zero has none."""
    if is_number(expr) and failure(expr, _number):
        return True
    return any(map(fails, asked_parts(expr, lambda condition: "settled")))


def _number(expr: m.Expr) -> float | None:
    return expr.value if isinstance(expr, m.Number) and is_literal(expr) else None


_COMPUTABLE = (m.Unary, m.Binary, m.Compare, m.Among, m.Builtin)


# One rule for each kind of node that can be decided without all of its parts.


def _named(values: Mapping[Any, AbstractValue], key: Any, expr: m.Expr) -> m.Expr:
    value = values.get(key, SOME)
    return value if is_known(value) else expr


def _let(expr: m.LetRef, known: Known) -> m.Expr:
    """The value of a let; the let itself where its value, written out, is too large."""
    if expr.name not in known._lets:
        made = filled(known.lets[expr.name], known)
        known._lets[expr.name] = expr if has_more(made, MAX_EXPRESSION_PARTS) else made
    return known._lets[expr.name]


def has_more(expr: m.Expr, parts: int) -> bool:
    """Whether an expression has more than `parts` parts; stops counting there."""
    return next(islice(m.walk(expr), parts, None), None) is not None


def _constant(expr: m.ConstantRef, known: Known) -> m.Expr:
    value = known.constants.get(expr.name)
    return value if value is not None and is_literal(value) else expr


def _asked(answers: Mapping[InputName, bool], expr: m.Fresh | m.Present) -> m.Expr:
    answer = answers.get((expr.input.peer, expr.input.element))
    return expr if answer is None else truth(answer)


def _clock(expr: m.Clock, known: Known) -> m.Expr:
    if expr.name == "period":
        return m.Number(float(known.period_s), type=expr.type)
    if known.periods is not None and expr.name == "entered":
        return truth(known.periods == 0)
    return m.Number(0.0, type=expr.type) if known.periods == 0 else expr


def _ranged(expr: m.Compare | m.Builtin, known: Known) -> m.Expr:
    """A comparison, or whole number, that is the same wherever in their ranges values lie."""
    made = _computed(m.mapped(expr, lambda part: filled(part, known)))
    if isinstance(made, (m.Compare, m.Builtin)) and (known.is_ranged(made) or known.runs(made)):
        least, greatest = bounded(made, known.range_of)
        if least == greatest and isinstance(made, m.Compare):
            return truth(bool(least))
        if least == greatest and isinstance(made.type, Int) and abs(least) <= EXACT:
            return m.Number(int(least), type=made.type)
    return made


def _unary(expr: m.Unary, known: Known) -> m.Expr:
    operand = filled(expr.operand, known)
    return negation(operand) if expr.op == "not" else _computed(replace(expr, operand=operand))


def _logic(expr: m.Logic, known: Known) -> m.Expr:
    end, parts = expr.op == "or", list[m.Expr]()
    for operand in expr.operands:
        part = filled(operand, known)
        if not isinstance(part, m.Truth):
            parts.append(part)
        elif part.value == end and not (parts and fails(parts[0])):
            return part
    return joined(expr.op, parts)


def _choice(expr: m.Choice, known: Known) -> m.Expr:
    test = filled(expr.test, known)
    if isinstance(test, m.Truth):
        return filled(expr.then if test.value else expr.otherwise, known)
    then, otherwise = filled(expr.then, known), filled(expr.otherwise, known)
    is_same = then == otherwise and not fails(test)
    return then if is_same else replace(expr, test=test, then=then, otherwise=otherwise)


def _is_none(expr: m.IsNone, known: Known) -> m.Expr:
    value = filled(expr.value, known)
    if isinstance(value, m.Nothing):
        return m.TRUE
    return m.FALSE if is_some(value, known) else replace(expr, value=value)


def is_some(value: m.Expr, known: Known) -> bool:
    """Whether the result of filling in is surely present (not None)."""
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
    items = over.items if isinstance(over, m.Items) and expr.kind in ("all", "any") else None
    if items is None or _times(expr.body, known) * len(items) > MAX_EXPRESSION_PARTS:
        return replace(expr, over=over, body=filled(expr.body, known))
    each = tuple(m.instance(expr.body, expr.variable, item) for item in items)
    return _logic(m.Logic("and" if expr.kind == "all" else "or", each, type=expr.type), known)


def _times(body: m.Expr, known: Known) -> int:
    """The size of the body of a quantifier after the quantifiers in it are expanded."""
    if not isinstance(body, m.Quantifier):
        return 1 + sum(_times(part, known) for part in m.children(body))
    over = body.over
    over = known.constants.get(over.name, over) if isinstance(over, m.ConstantRef) else over
    size = over.type.size if isinstance(over.type, Vector) else 1
    size = len(over.items) if isinstance(over, m.Items) else size
    return size * _times(body.body, known)


_RULES: dict[type, Callable[[Any, Known], m.Expr]] = {
    m.Input: lambda e, known: _named(known.inputs, (e.peer, e.element), e),
    m.MemoryRef: lambda e, known: _named(known.memory, e.name, e),
    m.LetRef: _let,
    m.ConstantRef: _constant,
    m.Fresh: lambda e, known: _asked(known.fresh, e),
    m.Present: lambda e, known: _asked(known.present, e),
    m.Lag: lambda e, known: e,
    m.Clock: _clock,
    m.Compare: _ranged,
    m.Builtin: _ranged,
    m.Unary: _unary,
    m.Logic: _logic,
    m.Choice: _choice,
    m.IsNone: _is_none,
    m.Sure: _sure,
    m.Component: _component,
    m.Quantifier: _quantifier,
}
