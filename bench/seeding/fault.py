"""What a class of faults is, and one fault that was seeded."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from bench.seeding.sheet import Edit, Sheet


@dataclass(frozen=True, slots=True)
class Seed:
    """A fault: edits of one text, and offsets in the unedited text where it may be reported.

    A place that an edit takes away stands for the place where it was.
    """

    edits: tuple[Edit, ...]
    places: tuple[int, ...]

    def text(self, sheet: Sheet) -> str:
        """The text with the fault."""
        text = sheet.text
        for start, end, new in sorted(self.edits, reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def lines(self, sheet: Sheet) -> frozenset[int]:
        """Lines of the edited text, counted from 1, where the fault may be reported."""
        text = self.text(sheet)
        return frozenset(text.count("\n", 0, self._moved(place)) + 1 for place in self.places)

    def _moved(self, place: int) -> int:
        offset = place
        for start, end, new in self.edits:
            if end <= place and start < place:
                offset += len(new) - (end - start)
            elif start < place < end:
                offset -= place - start
        return offset


def seed(edits: Edit | Iterable[Edit], *places: int) -> Seed:
    """A fault that may be reported at the places, or else where its first edit is."""
    made = (edits,) if isinstance(edits, Edit) else tuple(edits)
    return Seed(made, places or (made[0].start,))


@dataclass(frozen=True, slots=True)
class Fault:
    """A class of faults.

    One of `codes` has to be reported. `with_` are codes of what follows from the fault and is true
    as well; any other finding is an extra complaint. If `alone`, so is a second finding.
    """

    name: str
    codes: frozenset[str]
    seeds: Callable[[Sheet], Iterable[Seed]]
    with_: frozenset[str] = frozenset()
    alone: bool = False


def fault(
    name: str,
    codes: str,
    seeds: Callable[[Sheet], Iterable[Seed]],
    with_: str = "",
    **options: bool,
) -> Fault:
    """A class of faults; codes are separated by spaces."""
    return Fault(name, frozenset(codes.split()), seeds, frozenset(with_.split()), **options)
