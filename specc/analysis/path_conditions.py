"""What is known where a part of an expression is evaluated: the tests that stand before it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Generic, NamedTuple, TypeVar

from specc.analysis.reads import ExpressionText, text_of
from specc.model.expr import (
    LENGTH,
    Builtin,
    Choice,
    Compare,
    Expr,
    Fresh,
    IsNone,
    Lag,
    LazyByDependence,
    LetRef,
    Logic,
    Number,
    Present,
    Quantifier,
    Unary,
    children,
    negation,
)
from specc.model.fsm import Axiom, Condition, Function, State, Transition
from specc.model.system import Let, Memory, Subsystem
from specc.model.types import Bool, Int, OptionalOf
from specc.reachable import grouped

# Following an expression through the lets that it names.


T = TypeVar("T", bound=Hashable)
K = TypeVar("K")
"""What is known at a point."""


class GuardedPart(NamedTuple, Generic[K]):
    """A part of an expression, in the text of `let` or, without one, of the expression itself."""

    expr: Expr
    known: K
    let: Let | None


class Guards(Generic[K]):
    """Follows expressions through the lets of a subsystem, each of which is visited once."""

    def __init__(
        self,
        lets: Sequence[Let],
        learn: Callable[[K, Expr, bool], K],
        meet: Callable[[K, K], K],
        without_variables: Callable[[K], K] = lambda known: known,
    ) -> None:
        """`lets` are in order of dependence.

        `learn` adds what follows from a test that held, or did not. `meet` joins what is known at
        two uses of a let. `without_variables` forgets the variables of quantifiers: a let has its
        own, perhaps of the same names.
        """
        self.learn, self.meet, self.without_variables = learn, meet, without_variables
        self._lets = {let.name: let for let in lets}
        self.ranks = {let.name: rank for rank, let in enumerate(lets)}

    def parts(self, expr: Expr, known: K) -> list[GuardedPart[K]]:
        """Find the parts of an expression and its lets, each with what is known where it stands."""
        walk = _Walk(self)
        walk.follow(expr, known, None)
        below = len(self.ranks)
        while walk.named:
            name = max(walk.named, key=self.ranks.__getitem__)
            known = walk.named.pop(name)
            if self.ranks[name] < below:  # a let that names itself is an error of its own
                below = self.ranks[name]
                walk.follow(self._lets[name].value, known, self._lets[name])
        return walk.found


@dataclass(eq=False, slots=True)
class _Walk(Generic[K]):
    guards: Guards[K]
    found: list[GuardedPart[K]] = field(default_factory=list)
    named: dict[str, K] = field(default_factory=dict)
    """Lets that are still to be followed, with what is known wherever they are named."""

    def follow(self, expr: Expr, known: K, let: Let | None) -> None:
        self.found.append(GuardedPart(expr, known, let))
        learn = self.guards.learn
        match expr:
            case Fresh() | Present() | Lag():
                pass
            case LetRef(name=name) if name in self.guards.ranks:
                known = self.guards.without_variables(known)
                met = name in self.named
                self.named[name] = self.guards.meet(self.named[name], known) if met else known
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
                self.follow(body, learn(known, has_value(over), True), let)
            case _:
                for child in children(expr):
                    self.follow(child, known, let)


class ImpliedFacts(Generic[T]):
    """Facts that follow from conditions; `of_atom` gives those of a condition without operands."""

    def __init__(self, lets: Iterable[Let], of_atom: Callable[[Expr, bool], frozenset[T]]) -> None:
        """`lets` are in order of dependence."""
        self._of_atom = of_atom
        values = {let.name: let.value for let in lets}
        self._of_lets = LazyByDependence(
            values, lambda name: (self.of(values[name], False), self.of(values[name], True))
        )

    def of(self, expr: Expr, holds: bool) -> frozenset[T]:
        """The facts that follow from a condition, or from its negation."""
        match expr:
            case Unary(op="not", operand=operand):
                return self.of(operand, not holds)
            case Logic(op=op, operands=operands):
                parts = [self.of(part, holds) for part in operands]
                every = (op == "and") == holds
                return frozenset[T]().union(*parts) if every else frozenset.intersection(*parts)
            case Choice(test=test, then=then, otherwise=otherwise):
                one = self.of(test, True) | self.of(then, holds)
                return one & (self.of(test, False) | self.of(otherwise, holds))
            case LetRef(name=name) if name in self._of_lets:
                return self._of_lets[name][holds]
        return self._of_atom(expr, holds)


# Where expressions are evaluated, and what is true when the conditions of a state are asked.


Tests = tuple[tuple[Expr, bool], ...]
"""Conditions, and whether they held."""


def tested_conditions(
    state: State, rows: Sequence[Transition]
) -> Iterator[tuple[Tests, list[Condition]]]:
    """Yield the conditions that may end a state, each after the tests that precede it."""
    before: Tests = ()
    for _, condition in state.behaviour.endings:
        yield before, [condition]
        before = *before, (condition.when, False)
    for cause in state.behaviour.causes:
        yield state.behaviour.facts_after(cause), [r.condition for r in rows if r.cause == cause]


def as_conditions(tests: Tests) -> tuple[Expr, ...]:
    """Convert tests to conditions that hold."""
    return tuple(test if holds else negation(test) for test, holds in tests)


@dataclass(frozen=True, slots=True)
class Evaluation:
    """An expression that is evaluated, as a part of `owner`.

    Functions and conditions are evaluated in a `state`, these after `tests`; memory is
    initialised in the first period, and assumptions are watched in every later one.
    """

    text: ExpressionText
    owner: Memory | Axiom | Function | Condition
    state: State | None = None
    tests: Tests = ()


def evaluations(subsystem: Subsystem, rows: Iterable[Transition]) -> Iterator[Evaluation]:
    """All expressions that are evaluated if only some rows can be taken."""
    for memory in subsystem.memory:
        yield Evaluation(text_of(memory), memory)
    for axiom in subsystem.axioms:
        yield Evaluation(text_of(axiom), axiom)
    leaving = grouped((row.source, row) for row in rows)
    for state in subsystem.states:
        for function in state.behaviour.functions:
            for item in function.assignments:
                yield Evaluation(text_of(item), function, state)
        for tests, conditions in tested_conditions(state, leaving.get(state.name, ())):
            for condition in conditions:
                yield Evaluation(text_of(condition), condition, state, tests)


# Conditions that say that something is there.


def has_value(value: Expr) -> Expr:
    """`value is not None`, or `len(value) != 0`."""
    if isinstance(value.type, OptionalOf):
        return negation(IsNone(value, type=Bool()))
    length = Builtin(LENGTH, (value,), type=Int())
    return Compare("!=", length, Number(0, type=Int()), type=Bool())
