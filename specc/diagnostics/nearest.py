"""Names that a mistyped one was probably meant to be."""

from collections.abc import Iterable, Sequence
from difflib import SequenceMatcher, get_close_matches

MOST = 3
_LONGEST = 80
_SAFE = 0.75


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """The known names closest to `name`, best first, at most three; case is no difference."""
    by_folded: dict[str, str] = {}
    for candidate in known:
        by_folded.setdefault(candidate.casefold(), candidate)
    if len(name) > _LONGEST:
        return []
    folded = name.casefold()
    # In a short name letters that changed places are half of it, and too far for the measure.
    swapped = [one for one in by_folded if sorted(one) == sorted(folded) and one != folded]
    close = dict.fromkeys([*swapped[:MOST], *get_close_matches(folded, by_folded, n=MOST)])
    return [by_folded[match] for match in close][:MOST]


def surely_meant(name: str, close: Sequence[str]) -> str:
    """The single close name if it differs by no more than a typing error; else nothing.

    Good enough to rename without asking: one in four letters may differ.
    """
    if len(close) != 1:
        return ""
    alike = SequenceMatcher(None, name.casefold(), close[0].casefold()).ratio()
    return close[0] if alike >= _SAFE else ""
