"""Simultaneous assignment in sequence: in which order memory may change within a period."""

from __future__ import annotations

from collections.abc import Iterable

from specc.lower.flow import Work
from specc.lower.terms import Term, Terms


def memory_order(works: Iterable[Work], known: Terms) -> tuple[list[Work], list[Work]]:
    """Memory elements to compute beforehand, and the rest in an order in which they may change.

    Who needs an old value comes before who changes it. Only where elements need each other's old
    values, one of them must be computed beforehand. The terms `known` have a local already.
    """
    left = {work: _reads(work.value, known) for work in works if not work.assignment.peer}
    before: list[Work] = []
    ordered: list[Work] = []
    while left:
        free = (work for work in left if not _is_read(work, left))
        work = next(free, None)
        if work is not None:
            ordered.append(work)
        else:
            work = next(iter(left))
            before.append(work)
        del left[work]
    return before, ordered


def _is_read(work: Work, left: dict[Work, frozenset[str]]) -> bool:
    name = work.assignment.name
    return any(name in reads for other, reads in left.items() if other is not work)


def _reads(term: Term, known: Terms) -> frozenset[str]:
    """Memory elements that a value still reads when the terms `known` have a local."""
    if term in known or not term.memory:
        return frozenset()
    if not term.args:
        return term.memory
    return frozenset[str]().union(*(_reads(arg, known) for arg in term.args))
