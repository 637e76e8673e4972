"""What is required of a whole system in every run: formulas of temporal logic over its values."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Literal

from specc.frozen import frozen
from specc.model.expr import Expr
from specc.model.types import Type
from specc.source import Place


@frozen
class Reading:
    """A value that requirements name: the state, memory, what was sent or what a device reported.

    `element` is a memory element, or peer and element of a buffer of `subsystem`; what is observed
    of the plant has no subsystem. `initial` is the
    input that has an initial value before anything is sent: its subsystem, peer and element.
    """

    name: str
    """As it is written: `rover.c.n`, `state(rover.c)`, `present(rover.c.x.m.v)`."""
    kind: Literal["state", "memory", "sent", "reported", "observed"]
    subsystem: str
    element: tuple[str, ...]
    type: Type
    place: Place
    initial: tuple[str, str, str] | None = None
    asks_presence: bool = False


@frozen
class Atom:
    """A condition on the values of one tick."""

    that: Expr


@frozen
class Junction:
    """`not`, `and`, `or` of formulas."""

    op: Literal["not", "and", "or"]
    operands: tuple[Formula, ...]


@frozen
class Temporal:
    """An operator over ticks; all but `since` reach over `span_s` seconds."""

    op: Literal["within", "throughout", "once", "historically", "since"]
    operands: tuple[Formula, ...]
    span_s: Fraction = Fraction(0)
    span: Expr | None = None
    """As it is written, with constants."""


Formula = Atom | Junction | Temporal


@frozen
class Requirement:
    """`formula` holds at the first tick, or at every tick if it `lasts`; `that` is its text."""

    that: str
    because: str
    formula: Formula
    lasts: bool
    readings: tuple[Reading, ...]
    place: Place


def expressions(formula: Formula) -> Iterator[Expr]:
    """The conditions and spans in a formula."""
    if isinstance(formula, Atom):
        yield formula.that
        return
    if isinstance(formula, Temporal) and formula.span:
        yield formula.span
    for operand in formula.operands:
        yield from expressions(operand)


def reach_s(formula: Formula) -> Fraction:
    """How long after a tick it is known what the formula says of it."""
    if isinstance(formula, Atom):
        return Fraction(0)
    ahead = isinstance(formula, Temporal) and formula.op in ("within", "throughout")
    own_s = formula.span_s if isinstance(formula, Temporal) and ahead else Fraction(0)
    return own_s + max(map(reach_s, formula.operands))


def is_timeless(formula: Formula) -> bool:
    """Whether a formula is about the values of one tick alone."""
    if isinstance(formula, Atom):
        return True
    return not isinstance(formula, Temporal) and all(map(is_timeless, formula.operands))
