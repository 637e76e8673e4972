"""Phrases of messages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

from specc.diagnostics.nearest import common_prefix_length


def join_words(names: Iterable[str], word: str) -> str:
    """Join words: `a`, `a and b`, `a, b and c`."""
    *most, last = names
    return f"{', '.join(most)} {word} {last}" if most else last


def with_article(noun: str) -> str:
    """A noun with its article: `an action`, `a service`."""
    return f"{'an' if noun[0] in 'aeio' else 'a'} {noun}"


def counted(count: int, noun: str) -> str:
    """A count with its noun: `1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def join_some(names: Sequence[str], most: int, between: str = ", ") -> str:
    """Join names; of more than `most` only the first ones: `a, b and 3 more`."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return between.join(names[:most]) + more


def common_stem(names: Sequence[str]) -> str:
    """What names of copies begin with, without numbers; the first one if that is nothing."""
    first, last = min(names), max(names)
    shared = first[: common_prefix_length(first, last)].rstrip("_0123456789")
    return names[0] if first == last else shared or names[0]


def truncate(text: str, most: int) -> str:
    """Shorten a long text to at most `most` characters."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def in_ms(seconds: Fraction) -> str:
    """Format a duration in milliseconds."""
    return f"{float(1000 * seconds):.6g} ms"
