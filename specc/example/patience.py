"""How much is tried until a search gives up, counted so that it always ends in the same place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class Patience:
    """A number of situations that may still be looked at."""

    def __init__(self, situations: int) -> None:
        self.left = situations

    def spend(self, situations: int) -> bool:
        """Whether any were left before these."""
        had = self.left > 0
        self.left -= situations
        return had

    @contextmanager
    def some(self, most: int) -> Iterator[Patience]:
        """A part of it; what is spent of it is spent of the whole."""
        given = max(0, min(most, self.left))
        part = Patience(given)
        yield part
        self.left -= given - part.left
