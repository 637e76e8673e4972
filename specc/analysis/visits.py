"""Visits of lets, each with what is known when an expression comes to it."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")
MOST_VISITS = 16
"""Of one let with different knowledge; further ones are made with the least that is known."""


class Visits(Generic[T]):
    """Remembers with which knowledge each let was visited, so that lets that double end.

    Knowledge only grows along a walk, and what is found with less of it covers what more finds.
    """

    def __init__(self, least: frozenset[T] = frozenset()) -> None:
        self._least = least
        self._known: dict[str, list[frozenset[T]]] = {}

    def knowing(self, let: str, known: frozenset[T]) -> frozenset[T] | None:
        """What to take as known in a visit; None if earlier ones covered it."""
        earlier = self._known.setdefault(let, [])
        if len(earlier) >= MOST_VISITS:
            known = self._least
        if any(other <= known for other in earlier):
            return None
        earlier.append(known)
        return known
