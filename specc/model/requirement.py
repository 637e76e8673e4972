"""Requirements on every run of a system: formulas of temporal logic over its values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from specc.model.expr import Expr, Node, Offsets
from specc.model.types import Type
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Reading:
    """A value that requirements name: state, memory, a sent value, a measurement, ground truth.

    `element` is a memory element, or peer and element of a buffer of `subsystem`; ground truth of
    the plant (`observe`) has no subsystem. `initial` is the input whose initial value counts until
    a value is sent: its subsystem, peer and element.
    """

    name: str
    """The text in the specification: `rover.c.n`, `state(rover.c)`, `present(rover.c.x.m.v)`."""
    kind: Literal["state", "memory", "sent", "reported", "observed"]
    subsystem: str
    element: tuple[str, ...]
    type: Type
    place: Place
    initial: tuple[str, str, str] | None = None
    asks_presence: bool = False


@dataclass(frozen=True, slots=True)
class TickCondition:
    """A condition on the values of one tick."""

    that: Expr


@dataclass(frozen=True, slots=True)
class BoolOp:
    """`not`, `and`, `or` of formulas; `p implies q` is `not p or q` with a `premise`."""

    op: Literal["not", "and", "or"]
    operands: tuple[TemporalFormula, ...]
    at: Offsets = field(default=(0, 0), compare=False)
    """Where it stands in its text."""
    premise: TemporalFormula | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Temporal:
    """An operator over ticks; all but `since` reach over `span_s` seconds."""

    op: Literal["within", "throughout", "once", "historically", "since"]
    operands: tuple[TemporalFormula, ...]
    span_s: Fraction = Fraction(0)
    span: Expr | None = None
    """The span as written, with constants."""
    at: Offsets = field(default=(0, 0), compare=False)
    """Where it stands in its text."""

    @property
    def is_future(self) -> bool:
        """Whether it is about ticks that are to come."""
        return self.op in ("within", "throughout")


@dataclass(frozen=True, slots=True)
class Stays:
    """`stays(v, T)`: a value has not changed for `span_s` seconds.

    At a tick t with t >= T it is equal at all ticks from t - T to t; before that this is false.
    """

    value: Expr
    span_s: Fraction
    span: Expr | None = None
    """The span as written, with constants."""
    at: Offsets = field(default=(0, 0), compare=False)
    """Where it stands in its text."""

    @property
    def operands(self) -> tuple[TemporalFormula, ...]:
        """No formulas: it is about a value."""
        return ()


TemporalFormula = TickCondition | BoolOp | Temporal | Stays


@dataclass(frozen=True, slots=True)
class Requirement:
    """A formula of the first tick, or of every tick if it `holds_always`; `text` is as written."""

    text: str
    because: str
    formula: TemporalFormula
    holds_always: bool
    readings: tuple[Reading, ...]
    place: Place
    name: str = ""
    names: frozenset[str] = frozenset()
    """The `let` names that its text uses."""
    device: str = ""
    """The device whose contract it is; a contract is called `device.name`."""

    @property
    def that(self) -> str:
        """The text on one line, after the name of a contract: several devices have one text."""
        return f"{self.name}: " * bool(self.device) + " ".join(self.text.split())

    def is_named(self, part: TemporalFormula | Expr) -> bool:
        """Whether the text has a `let` name in the place of this part."""
        return self.part(part) in self.names

    def part(self, formula: TemporalFormula | Expr) -> str:
        """The text of a part."""
        start, end = formula.span if isinstance(formula, Node) else span_of(formula)
        return " ".join(self.text[start:end].split())


@dataclass(frozen=True, slots=True)
class FormulaLet:
    """A `let` beside requirements: it has a formula or a value.

    `names` are the other names that it uses.
    """

    name: str
    formula: Requirement | None
    value: Expr | None
    names: frozenset[str]
    place: Place


def expressions_in(formula: TemporalFormula) -> Iterator[Expr]:
    """The conditions and spans in a formula."""
    if isinstance(formula, TickCondition):
        yield formula.that
        return
    if isinstance(formula, Stays):
        yield formula.value
    if isinstance(formula, Temporal | Stays) and formula.span:
        yield formula.span
    for operand in formula.operands:
        yield from expressions_in(operand)


def horizon_s(formula: TemporalFormula) -> Fraction:
    """The time in s after a tick when the truth of the formula at that tick is known."""
    if isinstance(formula, TickCondition):
        return Fraction(0)
    own_s = formula.span_s if isinstance(formula, Temporal) and formula.is_future else Fraction(0)
    return own_s + max(map(horizon_s, formula.operands), default=Fraction(0))


def span_of(formula: TemporalFormula) -> Offsets:
    """The columns of a formula in its text."""
    if isinstance(formula, TickCondition):
        return formula.that.span
    return formula.at


def antecedent(formula: TemporalFormula) -> TemporalFormula | None:
    """The condition without which a formula holds vacuously at a tick.

    None if it is asked at every tick.
    """
    match formula:
        case BoolOp(operands=(_, conclusion), premise=premise) if premise is not None:
            more = antecedent(conclusion)
            return premise if more is None else BoolOp("and", (premise, more))
        case BoolOp(op="and", operands=operands):
            parts = tuple(map(antecedent, operands))
            known = tuple(part for part in parts if part is not None)
            return BoolOp("or", known) if len(known) == len(parts) else None
        case Temporal(op="within" | "throughout", operands=(operand,)):
            return _at_some_time("within", formula, operand)
        case Temporal(op="once" | "historically", operands=(operand,)):
            return _at_some_time("once", formula, operand)
    return None


def _at_some_time(
    op: Literal["within", "once"], formula: Temporal, operand: TemporalFormula
) -> TemporalFormula | None:
    inner = antecedent(operand)
    return None if inner is None else Temporal(op, (inner,), formula.span_s, formula.span)


def has_future(formula: TemporalFormula) -> bool:
    """Whether a formula, or a part of it, is about ticks that are to come."""
    if isinstance(formula, TickCondition):
        return False
    is_ahead = isinstance(formula, Temporal) and formula.is_future
    return is_ahead or any(map(has_future, formula.operands))


def is_timeless(formula: TemporalFormula) -> bool:
    """Whether a formula is about the values of one tick alone."""
    if isinstance(formula, TickCondition):
        return True
    return isinstance(formula, BoolOp) and all(map(is_timeless, formula.operands))
