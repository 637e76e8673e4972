"""What can be reached: the one search of graphs that are too small for a library to be loaded."""

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


def grouped(pairs: Iterable[tuple[T, S]]) -> dict[T, list[S]]:
    """The second of each pair by the first, such as the edges of a graph by where they begin."""
    found: dict[T, list[S]] = {}
    for one, other in pairs:
        found.setdefault(one, []).append(other)
    return found
