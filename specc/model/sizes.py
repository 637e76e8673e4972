"""Sizes of vectors and images that parameters are to give."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from zlib import crc32


def marks() -> Iterator[int]:
    """Those of parameters, in their order: large numbers whose sums and products all differ."""
    return (2**32 + crc32(str(number).encode()) for number in count())


class OpenSize(int):
    """A size that a parameter is to give: a small example of it, spelt as the parameter is.

    It equals no number, and another such size if both are computed alike: `mark` is the value that
    it has if each parameter is a large number that nobody writes.
    """

    name: str
    mark: int

    def __new__(cls, mark: int, name: str) -> OpenSize:
        made = super().__new__(cls, 11 + mark % 7)
        made.mark, made.name = mark, name
        return made

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OpenSize) and self.mark == other.mark

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = int.__hash__

    def __repr__(self) -> str:
        return f"{self.name}: {self.mark}"

    def __str__(self) -> str:
        return self.name
