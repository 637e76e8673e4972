"""Names that a mistyped one was probably meant to be."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

MOST = 3
_LONGEST = 80
# In shorter names one letter is most of the meaning: q_d and q_c, S1 and S2.
_LONG_ENOUGH = 4


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """The known names closest to `name`, best first, at most three; case is no difference."""
    by_folded: dict[str, list[str]] = {}
    for candidate in dict.fromkeys(known):
        by_folded.setdefault(candidate.casefold(), []).append(candidate)
    if len(name) > _LONGEST:
        return []
    close = get_close_matches(name.casefold(), by_folded, n=MOST)
    return [candidate for match in close for candidate in by_folded[match]][:MOST]


def surely_meant(name: str, close: Sequence[str]) -> str:
    """The only one of the close names that is a slip of one letter away; else nothing.

    A slip adds, drops, changes or swaps letters, or is one of case, which alone counts in a short
    name; numbers are no slips.
    """
    slips = [other for other in close if _is_slip(name, other)]
    if len(slips) != 1:
        return ""
    long = min(len(name), len(slips[0])) >= _LONG_ENOUGH
    return slips[0] if long or name.casefold() == slips[0].casefold() else ""


def _is_slip(one: str, other: str) -> bool:
    one, other = one.casefold(), other.casefold()
    start = _common(one, other)
    one, other = one[start:], other[start:]
    end = _common(one[::-1], other[::-1])
    one, other = one[: len(one) - end], other[: len(other) - end]
    if any(char.isdigit() for char in one + other):
        return False
    return max(len(one), len(other)) <= 1 or (len(one) == 2 and one == other[::-1])


def _common(one: str, other: str) -> int:
    """Number of letters that both begin with."""
    pairs = zip(one, other, strict=False)
    return next((n for n, (a, b) in enumerate(pairs) if a != b), min(len(one), len(other)))
