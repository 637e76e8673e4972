"""Ways in which a condition comes to hold, as sets of inputs that must be fresh for it.

Other questions are left out, so that a condition has rather too many ways than too few.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product

from specc.model.expr import Expr, Fresh, LetRef, Logic, Truth, Unary
from specc.model.system import Subsystem
from specc.proof import InputName

Way = frozenset[InputName]
Ways = tuple[Way, ...]
FREE: Ways = (frozenset(),)
_MOST = 64


@dataclass(slots=True)
class Conditions:
    """The ways of the conditions of a subsystem."""

    subsystem: Subsystem
    _lets: dict[str, Expr] = field(init=False)
    _known: dict[tuple[str, bool], Ways] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._lets = {item.name: item.value for item in self.subsystem.lets}

    def ways(self, expr: Expr, holds: bool = True) -> Ways:
        """Ways in which a condition comes to hold, or not to hold."""
        match expr:
            case Truth(value=value):
                return FREE if value == holds else ()
            case Fresh(input=element) if holds:
                return (frozenset(((element.peer, element.element),)),)
            case Unary(op="not", operand=operand):
                return self.ways(operand, not holds)
            case LetRef(name=name) if name in self._lets:
                if (name, holds) not in self._known:
                    self._known[name, holds] = self.ways(self._lets[name], holds)
                return self._known[name, holds]
            case Logic(op=op, operands=operands):
                parts = [self.ways(part, holds) for part in operands]
                return (
                    all_of(parts)
                    if (op == "and") == holds
                    else least(way for p in parts for way in p)
                )
        return FREE


def all_of(parts: Iterable[Ways]) -> Ways:
    """Ways in which several things come to hold at once."""
    found = FREE
    for part in parts:
        found = least(one | other for one, other in product(found, part))
    return found


def least(ways: Iterable[Way]) -> Ways:
    """Without ways that ask for more than another one does; too many count as a free one."""
    found: list[Way] = []
    for way in sorted(set(ways), key=lambda w: (len(w), sorted(w))):
        if not any(other <= way for other in found):
            found.append(way)
    return tuple(found) if len(found) <= _MOST else FREE
