"""Where an expression needs what may not be there: an optional value, or an item of a list."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from specc.analysis.visits import Visits
from specc.frozen import frozen
from specc.model.expr import (
    Bound,
    Builtin,
    Choice,
    Clock,
    Compare,
    Expr,
    Fresh,
    Input,
    IsNone,
    LetRef,
    Logic,
    MemoryRef,
    Number,
    Present,
    Quantifier,
    Sure,
    Unary,
    children,
    walk,
)
from specc.model.system import Let, Subsystem
from specc.model.types import Bool, Int, ListOf, OptionalOf


@frozen
class Need:
    """A value that has to be there, in the text of `let` or, without one, of the expression itself.

    `guards` hold wherever the expression comes to it.
    """

    sure: Sure
    guards: tuple[Expr, ...]
    let: Let | None

    @property
    def fact(self) -> Expr:
        """The condition that it is there."""
        return there(self.sure)


def there(sure: Sure) -> Expr:
    """`value is not None`, or `len(value) != 0`."""
    if isinstance(sure.value.type, OptionalOf):
        return Unary("not", IsNone(sure.value, type=Bool()), type=Bool())
    length = Builtin("len", (sure.value,), type=Int())
    return Compare("!=", length, Number(0, type=Int()), type=Bool())


@frozen
class Sources:
    """What the value of an expression depends on."""

    memory: frozenset[str] = frozenset()
    lasts: bool = True
    """It changes with the memory only: no input, clock or variable of a quantifier is in it."""
    clock: bool = False


@dataclass(slots=True)
class Needs:
    """Follows the expressions of a subsystem through its lets."""

    subsystem: Subsystem
    _lets: dict[str, Let] = field(init=False)
    _sources: dict[str, Sources] = field(default_factory=dict)
    _needy: set[str] = field(default_factory=set)
    """Lets in which something has to be there."""

    def __post_init__(self) -> None:
        self._lets = {item.name: item for item in self.subsystem.lets}
        for item in self.subsystem.lets:
            self._sources[item.name] = self.sources(item.value)
            if any(self._is_needy(node) for node in walk(item.value)):
                self._needy.add(item.name)

    def of(self, expr: Expr) -> Iterator[Need]:
        """What an evaluation of `expr` may need, each with the tests that stand before it."""
        yield from self._of(expr, (), None, Visits())

    def _is_needy(self, node: Expr) -> bool:
        return isinstance(node, Sure) or (isinstance(node, LetRef) and node.name in self._needy)

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

    def _of(
        self,
        expr: Expr,
        guards: tuple[Expr, ...],
        let: Let | None,
        seen: Visits[Expr],
    ) -> Iterator[Need]:
        match expr:
            case LetRef(name=name):
                if name not in self._needy:
                    return
                known = seen.knowing(name, frozenset(guards))
                if known is not None:
                    inner = self._lets[name]
                    guards = tuple(guard for guard in guards if guard in known)
                    yield from self._of(inner.value, guards, inner, seen)
            case Sure(value=value):
                yield Need(expr, guards, let)
                yield from self._of(value, guards, let, seen)
            case Logic(op=op, operands=operands):
                for part in operands:
                    yield from self._of(part, guards, let, seen)
                    guards = (*guards, part if op == "and" else negation(part))
            case Choice(test=test, then=then, otherwise=otherwise):
                yield from self._of(test, guards, let, seen)
                yield from self._of(then, (*guards, test), let, seen)
                yield from self._of(otherwise, (*guards, negation(test)), let, seen)
            case Quantifier(over=over, body=body):
                yield from self._of(over, guards, let, seen)
                yield from self._of(body, (*guards, there(Sure(over, type=over.type))), let, seen)
            case _:
                for child in children(expr):
                    yield from self._of(child, guards, let, seen)


def with_items(conditions: Iterable[Expr]) -> list[Expr]:
    """Conditions with what they say of lists: where some item passes a test, there is one."""
    found: list[Expr] = []
    pending = list(conditions)[::-1]
    while pending:
        condition = pending.pop()
        found.append(condition)
        match condition:
            case Logic(op="and", operands=operands):
                pending += operands
            case (
                Quantifier(kind="any", over=over) | Unary(operand=Quantifier(kind="all", over=over))
            ) if isinstance(over.type, ListOf):
                found.append(there(Sure(over, type=over.type)))
    return found


def negation(condition: Expr) -> Expr:
    """`not condition`."""
    return Unary("not", condition, type=Bool())
