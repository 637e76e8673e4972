"""Repairs as edits of the text: what is not edited stays as it is, to the last blank."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from specc.diagnostics.report import Change, Repair
from specc.frozen import frozen


@frozen
class Repaired:
    """A text after repairs, those that were made, and those that could not be."""

    text: str
    made: tuple[Repair, ...]
    refused: tuple[Repair, ...]


def repaired(text: str, repairs: Iterable[Repair], accepts: Callable[[str], bool]) -> Repaired:
    """Make the repairs that do not touch each other and after which `accepts` takes the text.

    Of two that touch each other the first is made; the other may fit once the file is read again.
    """
    made: list[Repair] = []
    refused: list[Repair] = []
    for repair in sorted(repairs, key=_first):
        if not _touches(repair, made) and accepts(_edited(text, [*made, repair])):
            made.append(repair)
        else:
            refused.append(repair)
    return Repaired(_edited(text, made), tuple(made), tuple(refused))


def _first(repair: Repair) -> tuple[int, int, str]:
    return min((change.start, change.end, change.text) for change in repair.changes)


def _touches(repair: Repair, made: Iterable[Repair]) -> bool:
    return any(
        change.start <= other.end and other.start <= change.end
        for change in repair.changes
        for earlier in made
        for other in earlier.changes
    )


def _edited(text: str, repairs: Iterable[Repair]) -> str:
    changes = [change for repair in repairs for change in repair.changes]
    for change in sorted(changes, key=_start, reverse=True):
        text = text[: change.start] + change.text + text[change.end :]
    return text


def _start(change: Change) -> int:
    return change.start
