"""Where a text of a moment ago stands in the present one.

While a line is being typed the file often is no YAML. Then the last text that could be understood
answers, and offsets are carried over the one stretch that changed. A mended text has blanks where
there are errors, and everything else in its place (`specc.lsp.mending`).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Shift:
    """The stretch in which two texts differ: `old_end` and `new_end` are behind it."""

    start: int
    old_end: int
    new_end: int

    @property
    def size(self) -> int:
        """Characters that the longer of the two stretches has."""
        return max(self.old_end, self.new_end) - self.start

    def to_new(self, offset: int) -> int | None:
        """The offset in the present text; None if what was there has changed."""
        return _moved(offset, self.start, self.old_end, self.new_end)

    def to_old(self, offset: int) -> int | None:
        """The offset in the earlier text; None inside what has changed."""
        return _moved(offset, self.start, self.new_end, self.old_end)


def shift(old: str, new: str) -> Shift:
    """Where the characters of an earlier or mended text stand in the present one."""
    if len(old) == len(new) and (old == new or _blanked(old, new)):
        return Shift(len(old), len(old), len(new))
    return difference(old, new)


def difference(old: str, new: str) -> Shift:
    """What lies between the common beginning and the common end of two texts."""
    start = _common(old, new)
    rest = min(len(old), len(new)) - start
    ending = _common(old[len(old) - rest :][::-1], new[len(new) - rest :][::-1])
    return Shift(start, len(old) - ending, len(new) - ending)


def _blanked(old: str, new: str) -> bool:
    """Whether the texts differ only in characters that are blank in the old one."""
    return all(a == b or a == " " for a, b in zip(old, new, strict=True))


def _common(a: str, b: str) -> int:
    """Length of the common beginning, found by halving: comparing slices is fast."""
    low, high = 0, min(len(a), len(b))
    while low < high:
        middle = (low + high + 1) // 2
        if a[low:middle] == b[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def _moved(offset: int, start: int, end: int, other_end: int) -> int | None:
    if offset <= start:
        return offset
    return offset - end + other_end if offset >= end else None
