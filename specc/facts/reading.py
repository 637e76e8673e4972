"""Which inputs an expression reads although they may have no value."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from specc.facts.visits import Visits
from specc.model.expr import (
    Choice,
    Expr,
    Fresh,
    Input,
    LetRef,
    Logic,
    Present,
    Unary,
    Unknown,
    children,
)
from specc.model.system import Let, Subsystem
from specc.proof import InputName

Names = frozenset[InputName]
_NONE: Names = frozenset()


@dataclass(frozen=True, slots=True)
class Reading:
    """An input that is read, in the text of `let` or, without one, of the expression itself."""

    input: Input
    let: Let | None

    @property
    def name(self) -> InputName:
        """Peer and element."""
        return self.input.peer, self.input.element


@dataclass(slots=True)
class Readings:
    """Follows the expressions of a subsystem; `close` adds what is sent together (see Arrivals)."""

    subsystem: Subsystem
    close: Callable[[Names], Names]
    _lets: dict[str, Let] = field(init=False)
    _everything: Names = field(init=False)
    _told: dict[tuple[str, bool], Names] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._lets = {item.name: item for item in self.subsystem.lets}
        self._everything = frozenset(
            (port.peer, element.name)
            for port in self.subsystem.ports
            if port.direction == "x"
            for element in port.elements
        )

    def unguarded(self, expr: Expr, present: Names) -> Iterator[Reading]:
        """What `expr` may read in vain where only `present` is sure; tests in it are heeded."""
        yield from self._read(expr, present, None, Visits(present))

    def told(self, expr: Expr, holds: bool) -> Names:
        """Inputs that must have a value where a condition holds, or where it does not.

        What is unknown may be about any input.
        """
        match expr:
            case Unknown():
                return self._everything
            case Fresh(input=element) | Present(input=element) if holds:
                return frozenset(((element.peer, element.element),))
            case Unary(op="not", operand=operand):
                return self.told(operand, not holds)
            case Logic(op=op, operands=operands):
                parts = [self.told(part, holds) for part in operands]
                every = (op == "and") == holds
                return _NONE.union(*parts) if every else frozenset.intersection(*parts)
            case Choice(test=test, then=then, otherwise=otherwise):
                one = self.told(test, True) | self.told(then, holds)
                return one & (self.told(test, False) | self.told(otherwise, holds))
            case LetRef(name=name) if name in self._lets:
                key = name, holds
                if key not in self._told:
                    self._told[key] = self.told(self._lets[name].value, holds)
                return self._told[key]
        return _NONE

    def _read(
        self, expr: Expr, present: Names, let: Let | None, seen: Visits[InputName]
    ) -> Iterator[Reading]:
        match expr:
            case Input(peer=peer, element=element):
                if (peer, element) not in present:
                    yield Reading(expr, let)
            case Fresh() | Present():
                pass
            case LetRef(name=name) if name in self._lets:
                known = seen.knowing(name, present)
                if known is not None:
                    inner = self._lets[name]
                    yield from self._read(inner.value, known, inner, seen)
            case Logic(op=op, operands=operands):
                for part in operands:
                    yield from self._read(part, present, let, seen)
                    present = self.close(present | self.told(part, op == "and"))
            case Choice(test=test, then=then, otherwise=otherwise):
                yield from self._read(test, present, let, seen)
                for branch, holds in ((then, True), (otherwise, False)):
                    there = self.close(present | self.told(test, holds))
                    yield from self._read(branch, there, let, seen)
            case _:
                for child in children(expr):
                    yield from self._read(child, present, let, seen)
