"""Departures from what a specification follows: tables of a Markdown file such as docs/errata.md.

A row has three cells: where (numbers of equations are found in it), what is wrong, what was chosen.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_HEAD = ("where", "what is wrong", "what was chosen")
_ROW = re.compile(r"^\|(.*)\|\s*$")
_RANGE = re.compile(r"(?<![\w.])(?:eqs?\.? )?\(?(\d+)\)?(?: to \(?(\d+)\)?)?(?![\w.])")
_MOST = 10_000
"""Rows, and characters of one."""


@dataclass(frozen=True, slots=True)
class Departure:
    """A row: `equations` are the numbers that its first cell names."""

    where: str
    wrong: str
    chosen: str

    @property
    def equations(self) -> tuple[int, ...]:
        """The equations that are concerned; sections and tables are none."""
        text = re.sub(r"(?:Tables?|Figs?\.?|sections?) [\d, ]+|\b\d+\.\d+", "", self.where)
        found: dict[int, None] = {}
        for first, last in _RANGE.findall(text):
            low, high = int(first), int(last or first)
            found |= dict.fromkeys(range(low, min(high, low + 200) + 1))
        return tuple(found)


def departures_in(text: str) -> list[Departure]:
    """The rows of all tables with the three heads."""
    return list(_rows(text.splitlines()))


def _rows(lines: list[str]) -> Iterator[Departure]:
    inside, count = False, 0
    for line in lines:
        found = _ROW.match(line[:_MOST])
        if not found:
            inside = False
            continue
        cells = [_plain(cell) for cell in re.split(r"(?<!\\)\|", found[1])]
        if tuple(cell.lower() for cell in cells) == _HEAD:
            inside = True
        elif inside and len(cells) == len(_HEAD) and not set("".join(cells)) <= set("-: "):
            count += 1
            if count <= _MOST:
                yield Departure(*cells)


def _plain(cell: str) -> str:
    """A cell without the signs of Markdown."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", cell.strip())
    return re.sub(r"`|\*\*", "", text).replace("\\|", "|")
