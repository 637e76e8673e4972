"""Faults in what is written once for many, and in what is said of events."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import machines
from bench.seeding.sheet import Edit, Sheet, misspelt
from specc.source import Route, TextNode

_RANGE = re.compile(r"(\d+)\.\.(\d+)")
_BRACES = re.compile(r"\{(\w+)\}")
_NO_INDEX = (("for",), ("symbol",))


def _routes(node: TextNode, route: Route = ()) -> Iterator[tuple[Route, TextNode]]:
    yield route, node
    for step, inner in node.values.items():
        yield from _routes(inner, (*route, step))


def _ranges(sheet: Sheet) -> Iterator[tuple[Route, TextNode, str, str]]:
    """Each range of a `for`: route, place, first and last value."""
    for route, node in _routes(sheet.root):
        if len(route) > 1 and route[-2] == "for" and (found := _RANGE.fullmatch(sheet.raw(node))):
            yield route, node, found[1], found[2]


def _no_ranges(sheet: Sheet) -> Iterator[Seed]:
    """Words in place of the dots, and the ends the wrong way round."""
    for _, node, first, last in _ranges(sheet):
        for wrong in (f"{first} to {last}", f"{last}..{first}"):
            yield seed(sheet.replaced(node, wrong))


def _negative(sheet: Sheet) -> Iterator[Seed]:
    for route, node, _, last in _ranges(sheet):
        if route[0] == "agents" and len(route) == 4:
            yield seed(sheet.replaced(node, f"-1..{last}"))


def _one_more(sheet: Sheet) -> Iterator[Seed]:
    """One more than there are of what the copies are about."""
    for route, node, first, last in _ranges(sheet):
        edit = sheet.replaced(node, f"{first}..{int(last) + 1}")
        yield seed(edit, sheet.key(route[:-2]).start, elsewhere=(node.start,))


def _indices(sheet: Sheet) -> Iterator[Seed]:
    """Another name between the braces of a name or a text; a symbol has others."""
    for route, node in _routes(sheet.root):
        keys = [node.keys[step] for step in node.keys]
        for place in (node, *keys) if not node.values else keys:
            text = sheet.raw(place)
            for found in _BRACES.finditer(text) if route[-1:] not in _NO_INDEX else ():
                start = place.start + found.start(1)
                yield seed(Edit(start, start + len(found[1]), misspelt(found[1] + "ndex")))


def _not_events(sheet: Sheet) -> Iterator[Seed]:
    """A state that ignores what is a signal, or no input at all."""
    for machine in machines(sheet):
        for route in machine.entries("states"):
            name = sheet.get(route)
            if isinstance(name, str):
                wrong = f"{{behaviour: {name}, ignores: [x.peer.element]}}"
                yield seed(sheet.replaced(sheet.at(route), wrong))


FAULTS = (
    fault("what is no range", "E0108", _no_ranges),
    fault("negative index in a name", "E0108", _negative),
    fault(
        "range with one more than there are",
        "O0205 O0502 E0502 E0201",
        _one_more,
        several=Follows.EACH,
        abroad=True,
    ),
    fault("index that is not there", "E0108 E0502", _indices),
    fault("ignored element that is no event", "E0201", _not_events),
)
