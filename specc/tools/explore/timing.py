"""The periods in a state at which conditions on time alone change their truth."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.model import expr as m
from specc.model.types import Bool
from specc.proof.clock import Timer, Turns
from specc.proof.numbering import Numbering
from specc.tools.explore.partial import Known


class Timing:
    """Asks the clock of proofs about the expressions of a subsystem."""

    def __init__(self, known: Known) -> None:
        """`known` are the values known at all times; turns that are found are added to it."""
        self._timer = Timer(Numbering(known.lets, known.constants, known.period_s))
        self._found = known.turns
        self._lets: dict[str, frozenset[int]] = {}
        for name, value in known.lets.items():
            self._lets[name] = self.of([value])

    def of(self, exprs: Iterable[m.Expr]) -> frozenset[int]:
        """The periods at which a part of some expressions turns, directly or through lets."""
        return frozenset(turn for expr in exprs for turn in self._of(expr))

    def _of(self, expr: m.Expr) -> Iterator[int]:
        if isinstance(expr, m.LetRef):
            yield from self._lets.get(expr.name, ())
        elif (found := self._turns(expr)) is not None:
            yield from found.at
        else:
            for part in m.children(expr):
                yield from self._of(part)

    def _turns(self, expr: m.Expr) -> Turns | None:
        if not isinstance(expr.type, Bool) or isinstance(expr, (m.Truth, m.ConstantRef)):
            return None
        found = self._timer.turns(expr)
        if found is not None:
            self._found[id(expr)] = expr, found
        return found
