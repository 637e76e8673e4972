"""Names that a mistyped one was probably meant to be."""

import re
from collections.abc import Iterable, Sequence

from specc.limits import spend
from specc.reachable import grouped

MOST = 3
_LONGEST = 80
_LONG_ENOUGH = 4


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """The known names closest to `name`, best first, at most three; case does not count.

    No names for a very long one, and once a run has made all the comparisons that it may make.
    """
    from difflib import get_close_matches  # most specifications have nothing misspelt

    by_folded = grouped((candidate.casefold(), candidate) for candidate in dict.fromkeys(known))
    if len(name) > _LONGEST or not spend("names compared", len(by_folded)):
        return []
    close = get_close_matches(name.casefold(), by_folded, n=MOST)
    # In `is` for `si` half of the letters are wrong, but nothing else can be meant.
    close += [
        n for n in by_folded if n not in close and _is_swap(*difference(name.casefold(), n)[1:])
    ]
    return [candidate for match in close for candidate in by_folded[match]][:MOST]


def suggestion(name: str, known: Iterable[str]) -> str:
    """A help text for an unknown name: the nearest known names, or all of them."""
    known = list(known)
    close = " or ".join(nearest(name, known))
    return f"did you mean {close}?" if close else f"there are {', '.join(known)}"


def sole_correction(name: str, close: Sequence[str], long_enough: int = 4) -> str:
    """The only close name that is one letter away; empty if there are none or several.

    A slip adds, drops, changes or swaps letters, or is one of case, which alone counts in a name
    that is not long enough: there one letter is most of the meaning, as in q_d and q_c, S1 and S2.
    Numbers are no slips.
    """
    slips = [other for other in close if _is_one_edit_apart(name, other)]
    if len(slips) != 1:
        return ""
    long = min(len(name), len(slips[0])) >= long_enough
    return slips[0] if long or name.casefold() == slips[0].casefold() else ""


def is_typo(name: str, known: Iterable[str]) -> bool:
    """Whether a name is one letter away from a known one, which was probably meant.

    What is farther away may be the name of something that is not there yet. So may be a name with
    another number, S1 beside S2, or with another letter in a short part, q_d beside q_c.
    """
    names = list(known)
    if len(name) > _LONGEST or not spend("names compared", len(names)):
        return False
    return any(_is_likely_typo(name, other) for other in names)


def _is_likely_typo(name: str, other: str) -> bool:
    if name.casefold() == other.casefold():
        return True
    start, one, two = difference(name, other)
    if any(char.isdigit() for char in one + two):
        return False
    if len(one) + len(two) == 1:
        return True
    if _is_swap(one, two):
        return min(len(name), len(other)) >= _LONG_ENOUGH - 1
    parts = (_part_at(name, start), _part_at(other, start))
    return len(one) == len(two) == 1 and min(map(len, parts)) >= _LONG_ENOUGH


def _part_at(name: str, offset: int) -> str:
    """The part of a name, between dots and underscores, in which a letter stands."""
    parts = re.finditer(r"[^._]+", name)
    return next((part[0] for part in parts if part.start() <= offset < part.end()), "")


def _is_one_edit_apart(one: str, other: str) -> bool:
    _, one, other = difference(one.casefold(), other.casefold())
    if any(char.isdigit() for char in one + other):
        return False
    return max(len(one), len(other)) <= 1 or _is_swap(one, other)


def _is_swap(one: str, other: str) -> bool:
    return len(one) == 2 and one == other[::-1]


def difference(one: str, other: str) -> tuple[int, str, str]:
    """Strip what both names begin and end with; returns the rests and where they begin."""
    start = common_prefix_length(one, other)
    end = common_prefix_length(one[start:][::-1], other[start:][::-1])
    return start, one[start : len(one) - end], other[start : len(other) - end]


def common_prefix_length(one: Sequence[object], other: Sequence[object]) -> int:
    """The number of letters, or parts of names, with which both begin."""
    pairs = zip(one, other, strict=False)
    return next((n for n, (a, b) in enumerate(pairs) if a != b), min(len(one), len(other)))
