"""Faults in what is required of runs."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Seed, fault, seed
from bench.seeding.sheet import UNIT, Edit, Sheet, misspelt

_STATE = re.compile(r"state\((\w+)\.\w+\) == (\w+)")
_ELEMENT = re.compile(r"\b\w+\.[ER]\.\w+\.(\w+)")
_BOUND = re.compile(r"\b(?:within|throughout|once)\(([^,()]+), ")
_WHOLE = re.compile(r"\balways\((.*)\)", re.DOTALL)


def _parts(sheet: Sheet, pattern: re.Pattern[str], group: int) -> Iterator[tuple[int, int, str]]:
    """Beginning, end and text of what a pattern finds in the formulas."""
    for route in sheet.entries(("require",)):
        node = sheet.at((*route, "that"))
        for found in pattern.finditer(sheet.raw(node)):
            yield node.start + found.start(group), node.start + found.end(group), found[group]


def _misspelt(sheet: Sheet, pattern: re.Pattern[str], group: int) -> Iterator[Seed]:
    for start, end, text in _parts(sheet, pattern, group):
        yield seed(Edit(start, end, misspelt(text)))


def _agents(sheet: Sheet) -> Iterator[Seed]:
    yield from _misspelt(sheet, _STATE, 1)


def _states(sheet: Sheet) -> Iterator[Seed]:
    yield from _misspelt(sheet, _STATE, 2)


def _elements(sheet: Sheet) -> Iterator[Seed]:
    yield from _misspelt(sheet, _ELEMENT, 1)


def _units(sheet: Sheet) -> Iterator[Seed]:
    for start, end, _ in _parts(sheet, UNIT, 0):
        yield seed(Edit(start, end, "[kg]"))


def _bounds(sheet: Sheet) -> Iterator[Seed]:
    """A bound of another unit, one that is negative, and one that no run waits for."""
    for start, end, _ in _parts(sheet, _BOUND, 1):
        for wrong in ("1[m]", "-1[s]", "700[s]"):
            yield seed(Edit(start, end, wrong))


def _nested(sheet: Sheet) -> Iterator[Seed]:
    """`always` inside of a formula, which no run could decide."""
    for start, end, text in _parts(sheet, _WHOLE, 1):
        yield seed(Edit(start, end, f"not always({text})"))


FAULTS = (
    fault("misspelt agent in a requirement", "E0201", _agents),
    fault("misspelt state in a requirement", "E0201", _states),
    fault("misspelt element in a requirement", "E0201", _elements),
    fault("unit error in a requirement", "E0311", _units),
    fault("wrong bound of time", "E0310 E0335", _bounds),
    fault("`always` inside of a requirement", "E0335", _nested),
)
