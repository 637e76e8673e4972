"""Phrases of messages."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction


def listed(names: Iterable[str], word: str) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *most, last = names
    return f"{', '.join(most)} {word} {last}" if most else last


def ms(seconds: Fraction) -> str:
    """A length of time in milliseconds."""
    return f"{float(1000 * seconds):.6g} ms"
