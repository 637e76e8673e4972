"""Which inputs the value of an expression is computed from, in the very period that computes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from specc.facts.visits import MOST_VISITS
from specc.model.expr import (
    Choice,
    Expr,
    Fresh,
    Input,
    LetRef,
    Logic,
    Present,
    Unary,
    children,
)
from specc.model.system import Let, Subsystem
from specc.proof import InputName

Names = frozenset[InputName]
_NONE: Names = frozenset()


class Read(NamedTuple):
    """An input whose value counts, with `on_arrival` only in periods that find it fresh."""

    input: InputName
    on_arrival: bool


@dataclass(slots=True)
class Flow:
    """Follows the expressions of a subsystem through its lets; memory is not followed."""

    subsystem: Subsystem
    _lets: dict[str, Let] = field(init=False)
    _found: dict[str, dict[Names, frozenset[Read]]] = field(default_factory=dict)
    _asked: dict[tuple[str, bool], Names] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._lets = {item.name: item for item in self.subsystem.lets}

    def reads(self, expr: Expr, fresh: Names = _NONE) -> frozenset[Read]:
        """What the value of `expr` depends on where the elements in `fresh` are fresh."""
        return frozenset(self._reads(expr, fresh))

    def asked(self, expr: Expr, holds: bool) -> Names:
        """Inputs that must be fresh where a condition holds, or where it does not."""
        match expr:
            case Fresh(input=element) if holds:
                return frozenset(((element.peer, element.element),))
            case Unary(op="not", operand=operand):
                return self.asked(operand, not holds)
            case Logic(op=op, operands=operands):
                parts = [self.asked(part, holds) for part in operands]
                every = (op == "and") == holds
                return _NONE.union(*parts) if every else frozenset.intersection(*parts)
            case LetRef(name=name) if name in self._lets:
                key = name, holds
                if key not in self._asked:
                    self._asked[key] = self.asked(self._lets[name].value, holds)
                return self._asked[key]
        return _NONE

    def _reads(self, expr: Expr, fresh: Names) -> Iterator[Read]:
        match expr:
            case Input(peer=peer, element=element):
                yield Read((peer, element), (peer, element) in fresh)
            case Fresh() | Present():
                pass
            case LetRef(name=name) if name in self._lets:
                found = self._found.setdefault(name, {})
                known = fresh if len(found) < MOST_VISITS else _NONE
                if known not in found:
                    found[known] = self.reads(self._lets[name].value, known)
                yield from found[known]
            case Logic(op=op, operands=operands):
                for part in operands:
                    yield from self._reads(part, fresh)
                    fresh |= self.asked(part, op == "and")
            case Choice(test=test, then=then, otherwise=otherwise):
                yield from self._reads(test, fresh)
                for branch, holds in ((then, True), (otherwise, False)):
                    yield from self._reads(branch, fresh | self.asked(test, holds))
            case _:
                for child in children(expr):
                    yield from self._reads(child, fresh)
