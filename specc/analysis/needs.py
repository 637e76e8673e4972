"""Where an expression needs what may be missing: an optional value, or an item of a list."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from specc.analysis.guards import Guards, negation, there
from specc.frozen import frozen
from specc.model.expr import (
    Bound,
    Clock,
    Expr,
    Fresh,
    Input,
    LetRef,
    Logic,
    MemoryRef,
    Present,
    Quantifier,
    Sure,
    Unary,
    children,
)
from specc.model.system import Let, Subsystem
from specc.model.types import ListOf


class Need(NamedTuple):
    """A value that has to be there, in the text of `let` or, without one, of the expression itself.

    `guards` hold wherever the expression comes to it.
    """

    sure: Sure
    guards: tuple[Expr, ...]
    let: Let | None

    @property
    def fact(self) -> Expr:
        """The condition that it is there."""
        return there(self.sure.value)


@frozen
class Sources:
    """What the value of an expression depends on."""

    memory: frozenset[str] = frozenset()
    lasts: bool = True
    """It changes with the memory only: no input, clock or variable of a quantifier is in it."""
    clock: bool = False


class Needs:
    """Follows the expressions of a subsystem through its lets."""

    def __init__(self, subsystem: Subsystem) -> None:
        self._guards = Guards({item.name: item for item in subsystem.lets}, _behind)
        self._sources: dict[str, Sources] = {}
        for item in subsystem.lets:
            self._sources[item.name] = self.sources(item.value)

    def of(self, expr: Expr) -> Iterator[Need]:
        """What an evaluation of `expr` may need, each with the tests that stand before it."""
        for part in self._guards.parts(expr, ()):
            if isinstance(part.expr, Sure):
                yield Need(part.expr, part.known, part.let)

    def sources(self, expr: Expr) -> Sources:
        """What `expr` depends on, directly or through lets."""
        match expr:
            case MemoryRef(name=name):
                return Sources(frozenset((name,)))
            case Clock(name="elapsed" | "entered"):
                return Sources(lasts=False, clock=True)
            case Input() | Fresh() | Present() | Bound():
                return Sources(lasts=False)
            case LetRef(name=name) if name in self._sources:
                return self._sources[name]
        parts = [self.sources(child) for child in children(expr)]
        memory = frozenset[str]().union(*(part.memory for part in parts))
        return Sources(memory, all(p.lasts for p in parts), any(p.clock for p in parts))


def _behind(guards: tuple[Expr, ...], test: Expr, holds: bool) -> tuple[Expr, ...]:
    return (*guards, test if holds else negation(test))


def with_items(conditions: Iterable[Expr]) -> list[Expr]:
    """Conditions with what they say of lists: where some item passes a test, there is one."""
    found: list[Expr] = []
    for condition in conditions:
        found.append(condition)
        match condition:
            case Logic(op="and", operands=operands):
                found += with_items(operands)
            case (
                Quantifier(kind="any", over=over) | Unary(operand=Quantifier(kind="all", over=over))
            ) if isinstance(over.type, ListOf):
                found.append(there(over))
    return found
