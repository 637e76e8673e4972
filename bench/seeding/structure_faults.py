"""Faults in agents, buffers, connections, rates and devices."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Seed, fault, seed
from bench.seeding.machine import Machine, machines
from bench.seeding.sheet import Sheet
from specc.source import Route

_TYPES = "E0310 E0311 E0312 E0313 E0314 E0315 E0316 E0317 E0318 E0319 E0320 E0234"
_NAMES = "E0203 E0204 E0214"
_BESIDE = "E0403 O0403 E0404 E0405 O0404"


def _places_of(sheet: Sheet, element: str, buffer: str = "") -> list[int]:
    """Keys of all elements of a name, and of the buffers that could have one."""
    found = []
    for route in _buffers(sheet):
        for entry in sheet.entries(route):
            if entry[-1] == element or route[-1] == buffer:
                found += [sheet.key(entry).start, sheet.key(route).start]
    return found


def _uses(sheet: Sheet, text: str) -> list[int]:
    """Expressions and targets with a text such as `x.c.T_d`."""
    found = []
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            found += [node.start + m.start() for m in re.finditer(re.escape(text), sheet.raw(node))]
        for function in machine.get("functions"):
            targets = machine.targets_of(function).items()
            found += [sheet.key(route).start for name, route in targets if name.startswith(text)]
    return found


def _buffers(sheet: Sheet) -> Iterator[Route]:
    """Routes of all buffers of subsystems, and of devices."""
    for route in sheet.walk():
        if route[-2:-1] in (("x",), ("y",)) or (
            route[-1:] in (("x",), ("y",)) and _is_device(route)
        ):
            yield route


def _is_device(route: Route) -> bool:
    return route[-3:-2] in (("real_effectors",), ("real_receptors",))


def _missing_elements(sheet: Sheet) -> Iterator[Seed]:
    for route in _buffers(sheet):
        for element in sheet.entries(route):
            if len(sheet.entries(route)) > 1:
                here = [sheet.key(route).start, sheet.removed(element).start]
                if _is_device(route):
                    here.append(sheet.key(route[:-1]).start)
                ends = _places_of(sheet, str(element[-1]), str(route[-1]))
                uses = _uses(sheet, f"{route[-2]}.{route[-1]}.{element[-1]}")
                yield seed(sheet.removed(element), *here, *ends, *uses)


def _missing_buffers(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for direction in "xy":
            for route in machine.entries(direction):
                if len(machine.entries(direction)) > 1:
                    elements = [str(entry[-1]) for entry in sheet.entries(route)]
                    places = [p for name in elements for p in _places_of(sheet, name)]
                    uses = _uses(sheet, f"{direction}.{route[-1]}.")
                    here = sheet.key(route[:-1]).start
                    yield seed(sheet.removed(route), *places, here, *uses)


def _other_types(sheet: Sheet) -> Iterator[Seed]:
    for route in _buffers(sheet):
        for element in sheet.entries(route):
            node = sheet.at(sheet.scalar(element, "type"))
            other = "text" if "text" not in sheet.raw(node) else "int"
            ends = _places_of(sheet, str(element[-1]))
            yield seed(sheet.replaced(node, other), node.start, *ends)


def _short_cuts(sheet: Sheet) -> Iterator[Seed]:
    """A virtual effector or receptor writes to another one, or to another agent."""
    for machine in machines(sheet):
        others = _forbidden_peers(machine)
        if machine.is_control or not machine.get("y"):
            continue
        first = machine.entries("y")[0]
        for other in others:
            yield seed(sheet.beside(first, f"{other}: {{n: int}}"), sheet.key(first).start)


def _forbidden_peers(machine: Machine) -> list[str]:
    sheet = machine.sheet
    agents = list(sheet.get(("agents",), {}))
    if machine.route[0] != "agents":
        return []
    agent = machine.route[:2]
    near = [*sheet.get((*agent, "virtual_effectors"), {})]
    near += [*sheet.get((*agent, "virtual_receptors"), {})]
    devices = machine.get("y").keys() | machine.get("x").keys()
    names = [name for name in near if name != machine.route[-1] and name not in devices]
    return names + [name for name in agents if name != agent[1] and name not in near]


def _kinds(sheet: Sheet) -> Iterator[Seed]:
    kinds = ("C", "CT", "CE", "CR", "CER", "CET", "CRT", "CERT")
    for agent in sheet.entries(("agents",)):
        if sheet.has((*agent, "kind")):
            node = sheet.at((*agent, "kind"))
            for kind in kinds:
                if kind != sheet.get((*agent, "kind")):
                    yield seed(sheet.replaced(node, kind))


def _no_kind(sheet: Sheet) -> Iterator[Seed]:
    for agent in sheet.entries(("agents",)):
        if sheet.has((*agent, "kind")):
            yield seed(sheet.replaced(sheet.at((*agent, "kind")), "CEE"))


def _rates(sheet: Sheet) -> list[Route]:
    return [route for route in sheet.walk() if route[-1:] == ("rate",) and "bind" not in route]


def _odd_rates(sheet: Sheet) -> Iterator[Seed]:
    every = [sheet.at(route).start for route in _rates(sheet)]
    for route in _rates(sheet):
        for rate in ("99.991 Hz", "3.14159 ms"):
            yield seed(sheet.replaced(sheet.at(route), rate), *every)


def _no_rates(sheet: Sheet) -> Iterator[Seed]:
    for route in _rates(sheet):
        for wrong in ("100", "100 m", "0 Hz", "-5 Hz", "fast"):
            yield seed(sheet.replaced(sheet.at(route), wrong))


def _missing_rates(sheet: Sheet) -> Iterator[Seed]:
    for route in _rates(sheet):
        yield seed(sheet.removed(route), sheet.key(route[:-1]).start)


def _no_control(sheet: Sheet) -> Iterator[Seed]:
    for agent in sheet.entries(("agents",)):
        control = (*agent, "control")
        yield seed(sheet.removed(control), sheet.key(agent).start)


def _idle_devices(sheet: Sheet) -> Iterator[Seed]:
    """A device that no subsystem has a buffer to."""
    for agent in sheet.entries(("agents",)):
        for group in ("real_effectors", "real_receptors"):
            for device in sheet.entries((*agent, group)):
                edit = sheet.beside(device, "spare: {y: {n: int}}")
                yield seed(edit, sheet.key(device).start)


def _spare_elements(sheet: Sheet) -> Iterator[Seed]:
    """An element at one end only, which nothing reads or writes."""
    for machine in machines(sheet):
        for direction in "xy":
            for buffer in machine.entries(direction):
                first = sheet.entries(buffer)[0]
                places = [*_places_of(sheet, "", str(buffer[-1])), sheet.key(buffer).start]
                ends = [sheet.key(first).start, *places]
                yield seed(sheet.beside(first, "spare: int"), *ends)


def _use_twice(sheet: Sheet) -> Iterator[Seed]:
    """A virtual effector that works with the device of another one."""
    for agent in sheet.entries(("agents",)):
        effectors = sheet.entries((*agent, "virtual_effectors"))
        for effector in effectors:
            for other in effectors:
                if effector != other and not sheet.has((*effector, "uses")):
                    first = sheet.entries(effector)[0]
                    device = (*agent, "real_effectors", other[-1])
                    used = (effector, other, first, device)
                    places = [sheet.key(item).start for item in used]
                    yield seed(sheet.beside(first, f"uses: [{other[-1]}]"), *places)


def _same_names(sheet: Sheet) -> Iterator[Seed]:
    """A receptor called like an effector of the same agent."""
    for agent in sheet.entries(("agents",)):
        effectors = sheet.entries((*agent, "virtual_effectors"))
        receptors = sheet.entries((*agent, "virtual_receptors"))
        for effector in effectors:
            for receptor in receptors:
                places = [sheet.key(item).start for item in (effector, receptor)]
                edit = sheet.replaced(sheet.key(receptor), str(effector[-1]))
                yield seed(edit, *places)


def _reserved(sheet: Sheet) -> Iterator[Seed]:
    """Memory called like a word of the language, or like a constant."""
    names = ["period", "elapsed", *list(sheet.get(("constants",), {}))[:2]]
    for machine in machines(sheet):
        for route in machine.entries("memory")[:1]:
            for name in names:
                entry = sheet.entry(route)
                text = name + entry[entry.index(":") :]
                yield seed(sheet.beside(route, text), sheet.key(route).start)


FAULTS = (
    fault(
        "buffer element missing at one end",
        "E0404 E0203 E0214",
        _missing_elements,
        f"{_NAMES} E0403 O0403 E0503 O0502 W0611 W0612 W0613",
    ),
    fault(
        "buffer missing at one end",
        "E0403 O0403 E0204 E0203 E0214",
        _missing_buffers,
        f"{_NAMES} E0404",
    ),
    fault("types differ between the two ends", f"E0405 {_TYPES}", _other_types, "E0505 E0507"),
    fault("element that is not at the other end", "E0404", _spare_elements),
    fault("connection that the structure forbids", "E0401", _short_cuts, alone=True),
    fault("wrong kind of agent", "E0407 E0408", _kinds, alone=True),
    fault("kind of agent that does not exist", "E0104 E0407", _no_kind, alone=True),
    fault("agent without control subsystem", "E0402 O0402", _no_control, "E0403 O0403 E0218"),
    fault("device commanded from two sides", "E0406", _use_twice, _BESIDE),
    fault("two subsystems of one name", "E0411", _same_names, "E0403 O0403 E0404 E0218"),
    fault("device that nobody uses", "W0410 O0404", _idle_devices, "E0504 O0502"),
    fault("name with two meanings", "E0221", _reserved, "W0611 E0310 E0311 E0313 E0315"),
    fault("rates that do not divide", "E0409", _odd_rates, "E0509 W0414 E0701 E0702"),
    fault("what is no rate", "E0106", _no_rates, alone=True),
    fault("missing rate", "E0102 O0601", _missing_rates, alone=True),
)
