"""What a class of faults is, and one fault that was seeded."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from enum import StrEnum

from bench.seeding.sheet import Edit, Sheet


class Follows(StrEnum):
    """What a second finding about one fault is, where it is no noise."""

    EVERY_USE = "each place that disagrees with the fault, for it may be the one that is wrong"
    EVERY_STATE = "each state whose rows the fault spoils"
    EACH = "each argument, target, end or cause that is concerned"
    CASE = "the case that the row was for, and that no other row covers"
    WAY = "what may be missing, or is done twice, where the fault leads to"
    ONLY_USE = "what was used nowhere but there"
    OLD_NAME = "what still goes by the old name"
    BOTH = "the second mistake that the edit makes"
    TO_DO = "what is still to be done about it"
    LATE = "what comes too late or is too old by it"


@dataclass(frozen=True, slots=True)
class Seed:
    """A fault: edits of one text, and offsets in the unedited text.

    The fault is at `places`, and may first be seen `elsewhere`. A place that an edit takes away
    stands for the place where it was.
    """

    edits: tuple[Edit, ...]
    places: tuple[int, ...]
    elsewhere: tuple[int, ...] = ()
    absorbable: bool = False
    """Whether a row with `otherwise` applies where the fault leaves a gap, which may be meant."""

    def text(self, sheet: Sheet) -> str:
        """The text with the fault."""
        text = sheet.text
        for start, end, new in sorted(self.edits, reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def lines(self, sheet: Sheet) -> frozenset[int]:
        """Lines of the edited text, counted from 1, where the fault is."""
        return self._lines(sheet, self.places)

    def lines_elsewhere(self, sheet: Sheet) -> frozenset[int]:
        """Lines of the edited text where the fault may be seen first."""
        return self._lines(sheet, self.elsewhere)

    def _lines(self, sheet: Sheet, places: Collection[int]) -> frozenset[int]:
        text = self.text(sheet)
        return frozenset(text.count("\n", 0, self._moved(place)) + 1 for place in places)

    def _moved(self, place: int) -> int:
        offset = place
        for start, end, new in self.edits:
            if end <= place and start < place:
                offset += len(new) - (end - start)
            elif start < place < end:
                offset -= place - start
        return offset


def seed(
    edits: Edit | Iterable[Edit],
    *places: int,
    elsewhere: Iterable[int] = (),
    absorbable: bool = False,
) -> Seed:
    """A fault that is at the places, or else where its first edit is."""
    made = (edits,) if isinstance(edits, Edit) else tuple(edits)
    return Seed(made, places or (made[0].start,), tuple(elsewhere), absorbable)


@dataclass(frozen=True, slots=True)
class Fault:
    """A class of faults.

    One of `codes` has to be reported. `follows` says of other codes why they are reported too and
    are no noise, and `several` why one of `codes` may be reported more than once; any other finding
    is an extra complaint.
    """

    name: str
    codes: frozenset[str]
    seeds: Callable[[Sheet], Iterable[Seed]]
    follows: dict[str, Follows] = field(default_factory=dict, hash=False)
    several: Follows | None = None
    abroad: bool = False
    """Whether a place in another file may be the only right one."""


_MAY_COME = frozenset(
    {
        "E0201",
        "E0502",
    }
)
"""Codes of names that are unknown; where no known one is near, that is an open point."""
_NOT_THERE_YET = "O0205"


def fault(
    name: str,
    codes: str,
    seeds: Callable[[Sheet], Iterable[Seed]],
    follows: dict[Follows, str] | None = None,
    several: Follows | None = None,
    *,
    abroad: bool = False,
) -> Fault:
    """A class of faults; codes are separated by spaces."""
    reasons = {code: why for why, listed in (follows or {}).items() for code in listed.split()}
    for code in sorted(_MAY_COME & reasons.keys()):
        reasons[_NOT_THERE_YET] = reasons[code]
    own = frozenset(codes.split())
    if own & _MAY_COME:
        own |= {_NOT_THERE_YET}
    return Fault(name, own, seeds, reasons, several, abroad)
