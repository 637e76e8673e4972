"""What is known of memory from all that is ever written to it: some literals, or bounds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

from specc.analysis.memory_bounds import MemoryBounds
from specc.lang.builtins import FUNCTIONS
from specc.lang.kinds import kind
from specc.lang.ranges import Range
from specc.model.expr import (
    Among,
    Builtin,
    Choice,
    Compare,
    Expr,
    Member,
    MemoryRef,
    Number,
    Truth,
)
from specc.model.logic import joined, negation
from specc.model.system import Subsystem
from specc.model.types import Bool, Enum
from specc.proof import Numbering
from specc.reachable import reachable

_MOST_VALUES = 8
_Literal = Truth | Member | Number


class MemoryFacts:
    """What always holds of the memory that functions of one subsystem write."""

    def __init__(self, subsystem: Subsystem, numbering: Numbering) -> None:
        """`numbering` knows lets and constants."""
        given = {item.name: [item.init] for item in subsystem.memory}
        for (peer, name), by_behaviour in subsystem.written.items():
            if not peer and name in given:
                given[name] += chain(*by_behaviour.values())
        self.bounds = MemoryBounds(subsystem, given, numbering)
        leaves = {name: [*chain(*map(_leaves, values))] for name, values in given.items()}
        self.conditions: dict[str, Expr] = {}
        """By the name of the element."""
        for item in subsystem.memory:
            if len(given[item.name]) > 1 and kind(item.type).sort != "other":
                memory = MemoryRef(item.name, type=item.type)
                known = _one_of(memory, leaves) or _counted(memory, self.bounds.of(memory))
                self.conditions |= {item.name: known} if known else {}


def _counted(memory: MemoryRef, range_: Range) -> Expr | None:
    """From where memory goes on for ever; None if it ends, as it may be meant to."""
    for op, end, other in ((">=", *range_), ("<=", *range_[::-1])):
        if math.isfinite(end) and math.isinf(other):
            return Compare(op, memory, Number(end, type=memory.type), type=Bool())  # type: ignore[arg-type]  # one of two
    return None


def _leaves(expr: Expr) -> Iterator[Expr]:
    """The values that an expression may have: one of several, or its own."""
    match expr:
        case Choice(then=then, otherwise=otherwise):
            yield from (*_leaves(then), *_leaves(otherwise))
        case Builtin(name=name, args=args) if FUNCTIONS[name].chooses:
            yield from (leaf for arg in args for leaf in _leaves(arg))
        case _:
            yield expr


def _one_of(memory: MemoryRef, leaves: dict[str, list[Expr]]) -> Expr | None:
    """That memory has one of the literals that it, or memory whose value it gets, is given."""

    def others(name: str) -> Iterator[str]:
        return (leaf.name for leaf in leaves.get(name, ()) if isinstance(leaf, MemoryRef))

    found = reachable([memory.name], others)
    behind = [leaf for name in found for leaf in leaves.get(name, [None])]
    values = sorted({leaf for leaf in behind if isinstance(leaf, _Literal)}, key=repr)
    known = all(isinstance(leaf, _Literal | MemoryRef) for leaf in behind)
    if not known or len(values) > _MOST_VALUES:
        return None
    if isinstance(memory.type, Enum):
        members = frozenset(value.name for value in values if isinstance(value, Member))
        return Among(memory, members, type=Bool())
    each: list[Expr] = []
    for value in values:
        if isinstance(value, Truth):
            each.append(memory if value.value else negation(memory))
        else:
            each.append(Compare("==", memory, value, type=Bool()))
    return joined("or", each)
