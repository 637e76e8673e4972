"""Searches of graphs that are too small for a library to be loaded."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

T = TypeVar("T", bound=Hashable)
S = TypeVar("S")


def reachable(starts: Iterable[T], following: Callable[[T], Iterable[T]]) -> dict[T, None]:
    """The starts and all that follows them, as an ordered set: starts first, then as found."""
    found = dict.fromkeys(starts)
    waiting = list(found)
    while waiting:
        for thing in following(waiting.pop()):
            if thing not in found:
                found[thing] = None
                waiting.append(thing)
    return found


def shortest(start: T, goal: T, following: Callable[[T], Iterable[T]]) -> list[T]:
    """A shortest way from `start` to `goal`, both included; the goal alone if there is none."""
    before = {start: start}
    queue = [start]
    for here in queue:  # it grows
        new = [there for there in following(here) if there not in before]
        before |= dict.fromkeys(new, here)
        queue += dict.fromkeys(new)
    way = [goal]
    while before.get(way[-1], way[-1]) != way[-1]:
        way.append(before[way[-1]])
    return way[::-1]


def fixpoint(nodes: Iterable[T], step: Callable[[T], Iterable[T]]) -> None:
    """Do `step` for each node, and again for those that a step returns, until none is left."""
    waiting = dict.fromkeys(nodes)
    while waiting:
        node = next(iter(waiting))
        del waiting[node]
        waiting |= dict.fromkeys(step(node))


def grouped(pairs: Iterable[tuple[T, S]]) -> dict[T, list[S]]:
    """The second of each pair by the first, such as the edges of a graph by where they begin."""
    found: dict[T, list[S]] = {}
    for one, other in pairs:
        found.setdefault(one, []).append(other)
    return found
