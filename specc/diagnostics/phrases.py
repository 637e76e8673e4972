"""Phrases of messages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction


def listed(names: Iterable[str], word: str) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *most, last = names
    return f"{', '.join(most)} {word} {last}" if most else last


def counted(count: int, noun: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def few(names: Sequence[str], most: int, between: str = ", ") -> str:
    """All names; of more than so many the first ones: `a, b and 3 more`."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return between.join(names[:most]) + more


def clipped(text: str, most: int) -> str:
    """A text, or as much of a long one as is told."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def ms(seconds: Fraction) -> str:
    """A length of time in milliseconds."""
    return f"{float(1000 * seconds):.6g} ms"
