"""Faults in what flows: values that nobody reads or writes, readers that are too slow."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import Machine, elements, machines
from bench.seeding.sheet import Sheet
from specc.source import Route

_FRESH = re.compile(r"fresh\(x\.(\w+)\.(\w+)\)")


def _spare_at_both_ends(sheet: Sheet) -> Iterator[Seed]:
    """An element that both ends of a connection have and neither uses."""
    for machine in machines(sheet):
        control = (*machine.agent, "control")
        for direction, other in ("xy", "yx"):
            here = machine.below(direction, "c")
            there: Route = (*control, other, machine.route[-1])
            if machine.is_control or not (sheet.has(here) and sheet.has(there)):
                continue
            firsts = dict.fromkeys(elements(sheet, buffer)[0] for buffer in (here, there))
            edits = [sheet.beside(first, "spare: int") for first in firsts]
            yield seed(edits, *(sheet.key(first).start for first in firsts))


def _not_written(sheet: Sheet) -> Iterator[Seed]:
    """An output whose only assignment is gone."""
    for machine in machines(sheet):
        every = [
            route
            for function in machine.functions()
            for route in machine.targets_of(function).values()
        ]
        for route in every:
            name, mates = str(route[-1]), [other for other in every if other[-1] == route[-1]]
            others = [entry for entry in sheet.entries(route[:-1]) if entry in every]
            if name.startswith("y.c.") and len(mates) == 1 and len(others) > 1:
                _, peer, element = name.split(".")
                place = machine.element("y", peer, element)
                assert place is not None
                yield seed(sheet.removed(route), sheet.key(place).start)


def _memory_not_read(sheet: Sheet) -> Iterator[Seed]:
    """A second memory element that is written like the first, and never read."""
    for machine in machines(sheet):
        for function in machine.functions():
            for name, route in machine.targets_of(function).items():
                memory = machine.below("memory", name)
                if not name.startswith("y.") and sheet.one_line(memory):
                    edits = [
                        sheet.beside(memory, f"spare_{sheet.entry(memory)}"),
                        sheet.beside(route, f"spare_{sheet.entry(route)}"),
                    ]
                    yield seed(edits, sheet.key(memory).start)


def _slow_readers(sheet: Sheet) -> Iterator[Seed]:
    """A subsystem that reacts to fresh values less often than anybody sends them."""
    for machine in machines(sheet):
        route = machine.below("rate")
        asked = _asked(machine)
        if asked and sheet.has(route):
            node = sheet.at(route)
            yield seed(sheet.replaced(node, "2 Hz"), elsewhere=asked)


def _asked(machine: Machine) -> list[int]:
    """Elements that expressions ask `fresh` of."""
    sheet = machine.sheet
    found = []
    for _, route in machine.expressions():
        for peer, element in _FRESH.findall(sheet.raw(sheet.at(route))):
            entry = machine.element("x", peer, element)
            if entry and peer != "R":
                found += [sheet.key(entry).start, sheet.key(machine.below("x", peer)).start]
    return found


FAULTS = (
    fault(
        "element that nobody reads or writes",
        "W0412 W0413",
        _spare_at_both_ends,
        several=Follows.EACH,
    ),
    fault(
        "output that is no longer written",
        "W0413 E0701 E0702",
        _not_written,
        several=Follows.EVERY_USE,
        abroad=True,
    ),
    fault("memory that is never read", "W0615", _memory_not_read),
    fault(
        "reader that is too slow",
        "W0414",
        _slow_readers,
        {Follows.LATE: "E0410 E0701 E0702 W0336"},
        several=Follows.EACH,
    ),
)
