"""Faults in interfaces, rows of several states, `otherwise`, what stands in place, and points."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import (
    CAUSES,
    OTHERWISE,
    Machine,
    given_agents,
    lost_without,
    machines,
    of_interface,
)
from bench.seeding.sheet import Sheet, misspelt
from specc.source import Route, TextNode

_POSITION = re.compile(r"\bposition\(([\w.]+)\)")
_MOVED = re.compile(r"\b(X_\w+) @ ")
_POINT = re.compile(r"\bpoint\[(\w+)\]")
_READS = "E0701 E0702 E0705 W0415 W0416"
_TYPES = "E0310 E0311 E0312 E0313 E0315 E0316 E0317 E0318 E0201"


def _named(sheet: Sheet) -> Iterator[tuple[Route, TextNode, str]]:
    """Buffers that name an interface, with the place and the text of what they name."""
    for machine in machines(sheet):
        for buffer in [*machine.entries("x"), *machine.entries("y")]:
            route = sheet.scalar(buffer, "is")
            if isinstance(text := sheet.get(route), str):
                yield buffer, sheet.at(route), text


def _misspelt(sheet: Sheet) -> Iterator[Seed]:
    for _, node, text in _named(sheet):
        name = text.partition("[")[0]
        yield seed(sheet.replaced(node, sheet.raw(node).replace(name, misspelt(name), 1)))


def _exchanged(sheet: Sheet) -> Iterator[Seed]:
    """The interface of another buffer: what the two ends have is not the same."""
    every = list(dict.fromkeys(text for _, _, text in _named(sheet)))
    for buffer, node, text in _named(sheet):
        for other in [other for other in every if other != text][:1]:
            uses = _uses(sheet, rf"{buffer[-2]}\.{buffer[-1]}\.")
            written = f'"{other}"' if "[" in other else other
            yield seed(sheet.replaced(node, written), elsewhere=uses)


def _frames(sheet: Sheet) -> Iterator[Seed]:
    """A frame too few, or one too many."""
    for _, node, text in _named(sheet):
        name, _, given = text.partition("[")
        frame = given.rstrip("]") or next(iter(sheet.get(("frames",), {"W": ""})))
        for wrong in (name, f"{name}[{frame}, {frame}]") if given else (f"{name}[{frame}]",):
            yield seed(sheet.replaced(node, f'"{wrong}"'))


def _of_interfaces(sheet: Sheet) -> Iterator[Route]:
    for interface in sheet.get(("interfaces",), {}):
        yield from of_interface(sheet, interface)


def _uses(sheet: Sheet, text: str) -> list[int]:
    """Expressions and targets in which a pattern is found."""
    found = []
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            found += [node.start + m.start() for m in re.finditer(text, sheet.raw(node))]
        for function in machine.functions():
            keys = [sheet.key(route) for route in machine.targets_of(function).values()]
            found += [key.start for key in keys if re.search(text, sheet.raw(key))]
    return found


def _element_uses(sheet: Sheet, element: Route) -> list[int]:
    return _uses(sheet, rf"\b[xy]\.\w+\.{element[-1]}\b")


def _gone(sheet: Sheet) -> Iterator[Seed]:
    for element in _of_interfaces(sheet):
        yield seed(sheet.removed(element), elsewhere=_element_uses(sheet, element))


def _renamed(sheet: Sheet) -> Iterator[Seed]:
    for element in _of_interfaces(sheet):
        edit = sheet.replaced(sheet.key(element), f"{element[-1]}x")
        yield seed(edit, elsewhere=_element_uses(sheet, element))


def _other_types(sheet: Sheet) -> Iterator[Seed]:
    for element in _of_interfaces(sheet):
        node = sheet.at(sheet.scalar(element, "type"))
        yield seed(sheet.replaced(node, "text"), elsewhere=_element_uses(sheet, element))


def _unused(sheet: Sheet) -> Iterator[Seed]:
    for interface in sheet.entries(("interfaces",)) if sheet.has(("system",)) else ():
        yield seed(sheet.beside(interface, "Spare: {n: int}"), sheet.key(interface).start)


def _ends(sheet: Sheet) -> Iterator[tuple[Machine, str, str]]:
    """The states with the causes that end them."""
    for machine in machines(sheet):
        for state in machine.get("states"):
            for cause in CAUSES:
                if machine.ends(machine.behaviour_of(state), cause) != "False":
                    yield machine, state, cause


def _second_otherwise(sheet: Sheet) -> Iterator[Seed]:
    for machine, state, cause in _ends(sheet):
        for row in machine.rows_of(state, cause):
            others = [other for other in machine.get("states") if other != row.target]
            for target in others[:1] if row.condition == OTHERWISE else ():
                text = f"[{state}, {cause}, {OTHERWISE}, {target}]"
                yield seed(sheet.beside(row.route, text), sheet.at(row.route).start)


def _nothing_left(sheet: Sheet) -> Iterator[Seed]:
    """`otherwise` beside rows that have every case."""
    for machine, state, cause in _ends(sheet):
        for row in machine.rows_of(state, cause)[:1]:
            if not machine.has_otherwise(state, cause):
                text = f"[{state}, {cause}, {OTHERWISE}, {state}]"
                yield seed(sheet.beside(row.route, text))


def _listed_twice(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for row in machine.rows():
            if row.source[:-1] != row.route:
                yield seed(sheet.beside(row.source, row.state))


def _not_listed(sheet: Sheet) -> Iterator[Seed]:
    """A state that is missing in a row of several."""
    for machine in machines(sheet):
        for row in machine.rows():
            others = {other.condition for other in machine.rows_of(row.state, row.cause)}
            if row.source[:-1] != row.route and not lost_without(machine, row):
                absorbed = OTHERWISE in others and row.condition != OTHERWISE
                yield seed(machine.without(row), machine.place_of(row.state), absorbable=absorbed)


def _written_in_place(sheet: Sheet) -> Iterator[Seed]:
    """A function in place that assigns what another function of the behaviour assigns."""
    for machine in machines(sheet):
        for behaviour in machine.entries("behaviours"):
            listed = sheet.entries((*behaviour, "functions"))
            for function in machine.functions_of(str(behaviour[-1])):
                for route in machine.targets_of(function).values():
                    value = sheet.raw(sheet.at(route))
                    if sheet.one_line(route) and (
                        value[0] in "{\"'" or not set(value) & set(",[]")
                    ):
                        edit = sheet.beside(listed[0], f"{{{sheet.entry(route)}}}")
                        yield seed(edit, edit.start, sheet.at(listed[0]).start)


def _ends_in_place(sheet: Sheet, cause: str, when: str) -> Iterator[Seed]:
    """Another end of behaviours, which stands in place."""
    for machine in machines(sheet):
        for behaviour in machine.entries("behaviours"):
            route = (*behaviour, cause)
            if machine.ends(str(behaviour[-1]), cause) not in ("True", "False"):
                edit = sheet.replaced(sheet.at(route), f'{{when: "{when}"}}')
                yield seed(edit, sheet.key(route).start)


def _never_ends(sheet: Sheet) -> Iterator[Seed]:
    yield from _ends_in_place(sheet, "terminal", "elapsed > 1[s] and not elapsed > 1[s]")


def _fails_at_once(sheet: Sheet) -> Iterator[Seed]:
    yield from _ends_in_place(sheet, "error", "elapsed >= 0[s]")


def _typed(sheet: Sheet) -> Iterator[Route]:
    """Constants and lets, in their long form."""
    routes = sheet.entries(("constants",))
    routes += [route for machine in machines(sheet) for route in machine.entries("let")]
    yield from (route for route in routes if isinstance(sheet.get(route), dict))


def _other_values(sheet: Sheet) -> Iterator[Seed]:
    """A value that is not of the type that is said of it."""
    for route in _typed(sheet):
        if sheet.has((*route, "type")):
            for wrong in ("True", '"not True"'):
                yield seed(sheet.replaced(sheet.at((*route, "is")), wrong))
        else:
            yield seed(sheet.beside((*route, "is"), "type: text"), sheet.at((*route, "is")).start)


def _other_points(sheet: Sheet) -> Iterator[Seed]:
    """A pose the other way round, by which a point is in another frame."""
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            for pattern in (_POSITION, _MOVED):
                for found in pattern.finditer(sheet.raw(node)):
                    start, end = (node.start + place for place in found.span(1))
                    yield seed(sheet.inside(route, start, end, f"inverse({found[1]})"))


def _frames_of_points(sheet: Sheet) -> Iterator[Seed]:
    """Memory and lets that are points in another frame: found where they are filled or used."""
    frames = list(sheet.get(("frames",), {"D": ""}))
    for machine in machines(sheet):
        for route in [*machine.entries("memory"), *machine.entries("let")]:
            text = sheet.get((*route, "type"), "")
            if found := _POINT.search(text):
                node = sheet.at((*route, "type"))
                other = next(frame for frame in [*frames, "D"] if frame != found[1])
                wrong = sheet.raw(node).replace(found[0], f"point[{other}]")
                filled = (*route, "init" if sheet.has((*route, "init")) else "is")
                uses = _uses(sheet, rf"(?<![\w.]){route[-1]}\b")
                yield seed(sheet.replaced(node, wrong), elsewhere=[sheet.at(filled).start, *uses])


def _no_agents(sheet: Sheet) -> Iterator[Seed]:
    for route in given_agents(sheet):
        for wrong in (misspelt(sheet.get(route)), '"5[kg]"', '"[1, 2]"'):
            yield seed(sheet.replaced(sheet.at(route), wrong))


FAULTS = (
    fault("misspelt interface", "E0201", _misspelt),
    fault(
        "another interface at one end",
        "E0404 E0405 E0201",
        _exchanged,
        several=Follows.EVERY_USE,
        abroad=True,
    ),
    fault("wrong number of frames of an interface", "E0237", _frames),
    fault(
        "element missing in an interface",
        "E0201",
        _gone,
        several=Follows.EVERY_USE,
        abroad=True,
    ),
    fault(
        "element of an interface renamed",
        "E0201",
        _renamed,
        several=Follows.EVERY_USE,
        abroad=True,
    ),
    fault(
        "wrong type in an interface",
        f"E0405 {_TYPES}",
        _other_types,
        several=Follows.EVERY_USE,
        abroad=True,
    ),
    fault("interface that nobody uses", "W0240", _unused),
    fault("second `otherwise`", "E0602", _second_otherwise, {Follows.WAY: _READS}),
    fault("`otherwise` that has nothing left", "W0605", _nothing_left),
    fault("state twice in a row of several", "E0602", _listed_twice),
    fault("state missing in a row of several", "E0601 E0603 O0605", _not_listed),
    fault("target of a function in place that has a writer", "E0608", _written_in_place),
    fault(
        "end in place that never holds",
        "W0604 W0613",
        _never_ends,
        {Follows.ONLY_USE: "W0240 W0412 W0611 W0615"},
    ),
    fault(
        "end in place that holds at once",
        "W0613 W0618",
        _fails_at_once,
        {Follows.ONLY_USE: "W0240 W0412 W0611 W0615"},
    ),
    fault("value of another type than is said", _TYPES, _other_values),
    fault("point in another frame", _TYPES, _other_points, several=Follows.EACH),
    fault(
        "frame error in the type of a point", _TYPES, _frames_of_points, several=Follows.EVERY_USE
    ),
    fault("agent that is none", "E0201", _no_agents),
)
