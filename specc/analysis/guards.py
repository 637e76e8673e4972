"""What is known where a part of an expression is evaluated: the tests that stand before it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, NamedTuple, TypeVar

from specc.analysis.graph import CAUSES
from specc.model.expr import (
    Builtin,
    Choice,
    Compare,
    Expr,
    Fresh,
    IsNone,
    LetRef,
    Logic,
    Number,
    Present,
    Quantifier,
    Unary,
    children,
)
from specc.model.fsm import Cause, Condition, State, Transition
from specc.model.system import Let
from specc.model.types import Bool, Int, OptionalOf

T = TypeVar("T", bound=Hashable)
K = TypeVar("K", bound=Collection[Hashable])
"""What is known: it grows from test to test."""
MOST_VISITS = 16
"""Of one let with different knowledge; further visits assume only the least knowledge."""


class Part(NamedTuple, Generic[K]):
    """A part of an expression, in the text of `let` or, without one, of the expression itself."""

    expr: Expr
    known: K
    let: Let | None


@dataclass(slots=True)
class Guards(Generic[K]):
    """Follows expressions through the lets of a subsystem.

    `learn` gives what is known behind a test that held, or did not. Of a let that is visited again
    only what was `covered` by no earlier visit counts: what is found where less is known covers
    what is found where more is.
    """

    lets: Mapping[str, Let]
    learn: Callable[[K, Expr, bool], K]
    covered: Callable[[frozenset[Hashable], frozenset[Hashable]], bool] = frozenset.issubset

    def parts(self, expr: Expr, known: K) -> list[Part[K]]:
        """The parts of an expression and of the lets that it names, where `known` is known."""
        walk = _Walk(self, known)
        walk.follow(expr, known, None)
        return walk.found


@dataclass(slots=True)
class _Walk(Generic[K]):
    guards: Guards[K]
    least: K
    found: list[Part[K]] = field(default_factory=list)
    _visits: dict[str, list[frozenset[Hashable]]] = field(default_factory=dict)

    def follow(self, expr: Expr, known: K, let: Let | None) -> None:
        self.found.append(Part(expr, known, let))
        learn = self.guards.learn
        match expr:
            case Fresh() | Present():
                pass
            case LetRef(name=name) if name in self.guards.lets:
                self._visit(self.guards.lets[name], known)
            case Logic(op=op, operands=operands):
                for part in operands:
                    self.follow(part, known, let)
                    known = learn(known, part, op == "and")
            case Choice(test=test, then=then, otherwise=otherwise):
                self.follow(test, known, let)
                self.follow(then, learn(known, test, True), let)
                self.follow(otherwise, learn(known, test, False), let)
            case Quantifier(over=over, body=body):
                self.follow(over, known, let)
                self.follow(body, learn(known, there(over), True), let)
            case _:
                for child in children(expr):
                    self.follow(child, known, let)

    def _visit(self, let: Let, known: K) -> None:
        earlier = self._visits.setdefault(let.name, [])
        if len(earlier) >= MOST_VISITS:
            known = self.least
        now = frozenset(known)
        if not any(self.guards.covered(other, now) for other in earlier):
            earlier.append(now)
            self.follow(let.value, known, let)


@dataclass(slots=True)
class Implied(Generic[T]):
    """Facts that follow from conditions; `told` gives those that one without operands tells."""

    lets: Mapping[str, Let]
    told: Callable[[Expr, bool], frozenset[T]]
    _of_lets: dict[tuple[str, bool], frozenset[T]] = field(default_factory=dict)

    def by(self, expr: Expr, holds: bool) -> frozenset[T]:
        """What must be so where a condition holds, or where it does not."""
        match expr:
            case Unary(op="not", operand=operand):
                return self.by(operand, not holds)
            case Logic(op=op, operands=operands):
                parts = [self.by(part, holds) for part in operands]
                every = (op == "and") == holds
                return frozenset[T]().union(*parts) if every else frozenset.intersection(*parts)
            case Choice(test=test, then=then, otherwise=otherwise):
                one = self.by(test, True) | self.by(then, holds)
                return one & (self.by(test, False) | self.by(otherwise, holds))
            case LetRef(name=name) if name in self.lets:
                key = name, holds
                if key not in self._of_lets:
                    self._of_lets[key] = self.by(self.lets[name].value, holds)
                return self._of_lets[key]
        return self.told(expr, holds)


Tests = tuple[tuple[Expr, bool], ...]
"""Conditions, and whether they held."""


def ended(error: Condition, terminal: Condition, cause: Cause) -> Tests:
    """What is true when a state ends by a cause; the error has priority (2.4)."""
    if cause == "error":
        return ((error.when, True),)
    return (terminal.when, True), (error.when, False)


def asked(state: State, rows: Sequence[Transition]) -> Iterator[tuple[Tests, list[Condition]]]:
    """The conditions that may end a state, after what is true when they are asked."""
    error, terminal = state.behaviour.error, state.behaviour.terminal
    yield (), [error]
    yield ((error.when, False),), [terminal]
    for cause in CAUSES:
        yield ended(error, terminal, cause), [r.condition for r in rows if r.cause == cause]


def said(tests: Tests) -> tuple[Expr, ...]:
    """Tests as conditions that hold."""
    return tuple(test if holds else negation(test) for test, holds in tests)


def there(value: Expr) -> Expr:
    """`value is not None`, or `len(value) != 0`."""
    if isinstance(value.type, OptionalOf):
        return negation(IsNone(value, type=Bool()))
    length = Builtin("len", (value,), type=Int())
    return Compare("!=", length, Number(0, type=Int()), type=Bool())


def negation(condition: Expr) -> Expr:
    """`not condition`."""
    return Unary("not", condition, type=Bool())
