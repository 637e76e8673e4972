"""Phrases of messages."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction


def listed(names: Iterable[str], word: str) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *most, last = names
    return f"{', '.join(most)} {word} {last}" if most else last


def counted(count: int, noun: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def ms(seconds: Fraction) -> str:
    """A length of time in milliseconds."""
    return f"{float(1000 * seconds):.6g} ms"
