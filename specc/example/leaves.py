"""What a witness is about: the inputs, memory, time and operators that its answers depend on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from specc.model import expr as m
from specc.model.types import Bool


def leaves(asked: Iterable[m.Expr], lets: Mapping[str, m.Expr]) -> Iterator[m.Expr]:
    """The parts of expressions that a situation has values for, through lets, each once.

    Of a record its field; arguments of an operator do not count, its result does.
    """
    seen = set[str]()
    return iter(dict.fromkeys(leaf for expr in asked for leaf in _leaves(expr, lets, seen)))


def _leaves(expr: m.Expr, lets: Mapping[str, m.Expr], seen: set[str]) -> Iterator[m.Expr]:
    match expr:
        case m.Call():
            if not any(isinstance(node, m.Bound) for node in m.walk(expr)):
                yield expr
        case m.LetRef(name=name) if name in lets:
            if name not in seen:
                seen.add(name)
                yield from _leaves(lets[name], lets, seen)
        case m.FieldOf() if _is_path(expr):
            yield expr
        case m.Input() | m.MemoryRef() | m.Fresh() | m.Present() | m.Clock(name="elapsed"):
            yield expr
        case _:
            yield from (leaf for part in m.children(expr) for leaf in _leaves(part, lets, seen))


def says_all(asked: m.Expr) -> bool:
    """Whether the answer to a question is the value of all that it is about."""
    match asked:
        case m.Fresh() | m.Present():
            return True
        case m.Among(item=item, members=members):
            return len(members) == 1 and _is_path(item)
        case m.Compare(op="==", left=left, right=m.Member()):
            return _is_path(left)
    return isinstance(asked.type, Bool) and (_is_path(asked) or isinstance(asked, m.Call))


def _is_path(expr: m.Expr) -> bool:
    """Whether an expression is an element of a buffer or memory, or a field of one."""
    while isinstance(expr, m.FieldOf):
        expr = expr.value
    return isinstance(expr, (m.Input, m.MemoryRef))
