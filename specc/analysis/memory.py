"""What is known of memory from all that is ever written to it: some literals, or a count."""

from __future__ import annotations

from collections.abc import Iterator

from specc.lang.builtins import FUNCTIONS
from specc.lang.kinds import kind
from specc.model.expr import (
    Among,
    Binary,
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
from specc.reachable import reachable

_MOST_VALUES = 8
_Literal = Truth | Member | Number


def known_of_memory(subsystem: Subsystem) -> dict[str, Expr]:
    """Of memory that functions write what always holds of it, by name, as conditions."""
    leaves = {m.name: list(_leaves(m.init)) for m in subsystem.memory}
    written: set[str] = set()
    for (peer, name), by_behaviour in subsystem.written.items():
        if not peer and name in leaves:
            written.add(name)
            values = (value for values in by_behaviour.values() for value in values)
            leaves[name] += [leaf for value in values for leaf in _leaves(value)]
    found: dict[str, Expr] = {}
    for item in subsystem.memory:
        if item.name in written and kind(item.type).sort != "other":
            memory = MemoryRef(item.name, type=item.type)
            known = _one_of(memory, leaves) or _bound(memory, leaves[item.name])
            found |= {item.name: known} if known else {}
    return found


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


def _bound(memory: MemoryRef, leaves: list[Expr]) -> Expr | None:
    """Where memory begins that gets literals, or itself with literals added of one sign."""
    starts: list[float] = []
    steps: list[float] = []
    for leaf in leaves:
        match leaf:
            case Number(value=value):
                starts.append(value)
            case Binary(op="+", left=Number(value=value), right=other) if other == memory:
                steps.append(value)
            case Binary(op="+", left=other, right=Number(value=value)) if other == memory:
                steps.append(value)
            case Binary(op="-", left=other, right=Number(value=value)) if other == memory:
                steps.append(-value)
            case _ if leaf != memory:
                return None
    if not starts or (min(steps, default=0) < 0 < max(steps, default=0)):
        return None
    if min(steps, default=0) >= 0:
        return Compare(">=", memory, Number(min(starts), type=memory.type), type=Bool())
    return Compare("<=", memory, Number(max(starts), type=memory.type), type=Bool())
