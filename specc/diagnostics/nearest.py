"""Names that a mistyped one was probably meant to be."""

from collections.abc import Iterable
from difflib import get_close_matches

MOST = 3
_LONGEST = 80


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
