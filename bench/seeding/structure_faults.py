"""Faults in agents, buffers, connections, rates and devices."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import Machine, elements, machines
from bench.seeding.sheet import Edit, Sheet
from specc.source import Route

_TYPES = "E0310 E0311 E0312 E0313 E0315 E0316 E0317 E0318 E0319 E0201 E0234"


def _other_end(sheet: Sheet, buffer: Route) -> Route | None:
    """The buffer at the other end of one, if it is in the same file."""
    side = "y" if buffer[-2] == "x" else "x"
    if _is_device(buffer):
        return None
    owner, peer, agent = buffer[:-2], str(buffer[-1]), buffer[:2]
    name = str(owner[-1])
    ends: list[Route] = [(*agent, "control", side, name)]
    if peer in "ER":
        real = "real_effectors" if peer == "E" else "real_receptors"
        ends = [(*agent, real, name, side)]
    elif name == "control":
        groups = ("virtual_effectors", "virtual_receptors")
        ends = [(*agent, group, peer, side, "c") for group in groups]
        ends.append(("agents", peer, "control", side, str(agent[-1])))
    return next((end for end in ends if sheet.has(end)), None)


def _named(sheet: Sheet, buffer: Route | None, name: str) -> list[int]:
    """Where an element of a buffer is named, if there are such."""
    listed = elements(sheet, buffer) if buffer else []
    return [sheet.key(route).start for route in listed if route[-1] == name]


def _uses(sheet: Sheet, text: str) -> list[int]:
    """Expressions and targets with a text such as `x.c.T_d`."""
    found = []
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            found += [node.start + m.start() for m in re.finditer(re.escape(text), sheet.raw(node))]
        for function in machine.functions():
            targets = machine.targets_of(function).items()
            found += [sheet.key(route).start for name, route in targets if name.startswith(text)]
    return found


def _buffers(sheet: Sheet) -> Iterator[Route]:
    """Routes of all buffers of subsystems, and of devices."""
    for route in sheet.walk():
        depth = -1 if _is_device(route) else -2
        if route[depth:][:1] in (("x",), ("y",)) and not _is_device(route[:-1]):
            yield route


def _is_device(route: Route) -> bool:
    return route[-3:-2] in (("real_effectors",), ("real_receptors",))


def _missing_elements(sheet: Sheet) -> Iterator[Seed]:
    for route in _buffers(sheet):
        for element in sheet.entries(route):
            if len(sheet.entries(route)) > 1:
                here = [sheet.key(route).start, sheet.removed(element).start]
                uses = _uses(sheet, f"{route[-2]}.{route[-1]}.{element[-1]}")
                yield seed(sheet.removed(element), *here, elsewhere=uses)


def _missing_buffers(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for direction in "xy":
            for route in machine.entries(direction):
                if len(machine.entries(direction)) > 1:
                    here = [sheet.key(route[:-1]).start, sheet.key(machine.route).start]
                    uses = _uses(sheet, f"{direction}.{route[-1]}.")
                    end = _other_end(sheet, route)
                    ends = [sheet.key(end).start] if end else []
                    yield seed(sheet.removed(route), *here, elsewhere=[*ends, *uses])


def _other_types(sheet: Sheet) -> Iterator[Seed]:
    for route in _buffers(sheet):
        for element in sheet.entries(route):
            node = sheet.at(sheet.scalar(element, "type"))
            other = "text" if "text" not in sheet.raw(node) else "int"
            end = _other_end(sheet, route)
            there = _named(sheet, end, str(element[-1]))
            uses = _uses(sheet, f"{route[-2]}.{route[-1]}.{element[-1]}")
            yield seed(sheet.replaced(node, other), node.start, elsewhere=[*there, *uses])


def _other_units(sheet: Sheet) -> Iterator[Seed]:
    yield from _changed_types(sheet, re.compile(r"(?<=real\[)[^\]]+"), "kg")


def _other_frames(sheet: Sheet) -> Iterator[Seed]:
    """`pose[E, B]` for `pose[B, E]`, a wrench in another frame."""
    yield from _changed_types(sheet, re.compile(r"(?<=pose\[)B, E|(?<=wrench\[)[ES]"), "K")
    yield from _changed_types(sheet, re.compile(r"(?<=pose\[)B, E"), "E, B")


def _changed_types(sheet: Sheet, part: re.Pattern[str], other: str) -> Iterator[Seed]:
    """Elements of subsystems with other text for a part of their type."""
    for route in _buffers(sheet):
        for element in sheet.entries(route):
            node = sheet.at(sheet.scalar(element, "type"))
            found = part.search(sheet.raw(node))
            if found and ("," in found[0]) == ("," in other):
                start, end = (node.start + offset for offset in found.span())
                there = _named(sheet, _other_end(sheet, route), str(element[-1]))
                uses = _uses(sheet, f"{route[-2]}.{route[-1]}.{element[-1]}")
                yield seed(Edit(start, end, other), elsewhere=[*there, *uses])


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
    for route in _rates(sheet):
        for rate in ("99.991 Hz", "3.14159 ms"):
            yield seed(sheet.replaced(sheet.at(route), rate))


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
        if sheet.has(control):
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
                end = _other_end(sheet, buffer)
                if isinstance(sheet.get(buffer), str):
                    more = f"{{is: {sheet.raw(sheet.at(buffer))}, spare: int}}"
                    edit, here = sheet.replaced(sheet.at(buffer), more), buffer
                else:
                    here = sheet.entries(buffer)[0]
                    edit = sheet.beside(here, "spare: int")
                yield seed(edit, sheet.key(end if end else here).start)


def _use_twice(sheet: Sheet) -> Iterator[Seed]:
    """A virtual effector that works with the device of another one."""
    for agent in sheet.entries(("agents",)):
        effectors = sheet.entries((*agent, "virtual_effectors"))
        for effector in effectors:
            for other in effectors:
                if effector != other and not sheet.has((*effector, "uses")):
                    first = sheet.entries(effector)[0]
                    yield seed(sheet.beside(first, f"uses: [{other[-1]}]"))


def _same_names(sheet: Sheet) -> Iterator[Seed]:
    """A receptor called like an effector of the same agent."""
    for agent in sheet.entries(("agents",)):
        effectors = sheet.entries((*agent, "virtual_effectors"))
        receptors = sheet.entries((*agent, "virtual_receptors"))
        for effector in effectors:
            for receptor in receptors:
                yield seed(sheet.replaced(sheet.key(receptor), str(effector[-1])))


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
        "E0404 E0201",
        _missing_elements,
        {Follows.EVERY_USE: "E0502"},
        several=Follows.EVERY_USE,
    ),
    fault(
        "buffer missing at one end",
        "E0403 O0403 E0201",
        _missing_buffers,
        several=Follows.EVERY_USE,
    ),
    fault(
        "types differ between the two ends",
        f"E0405 {_TYPES}",
        _other_types,
        {Follows.EVERY_USE: "E0505 E0507"},
        several=Follows.EVERY_USE,
    ),
    fault(
        "wrong unit at one end",
        f"E0405 {_TYPES}",
        _other_units,
        {Follows.EVERY_USE: "E0511"},
        several=Follows.EVERY_USE,
    ),
    fault("wrong frames at one end", f"E0405 {_TYPES}", _other_frames, several=Follows.EVERY_USE),
    fault("element that is not at the other end", "E0404", _spare_elements, several=Follows.EACH),
    fault("connection that the structure forbids", "E0401", _short_cuts),
    fault("wrong kind of agent", "E0407 E0408", _kinds),
    fault("kind of agent that does not exist", "E0104 E0407", _no_kind),
    fault("agent without control subsystem", "E0402 O0402", _no_control),
    fault("device commanded from two sides", "E0406", _use_twice),
    fault("two subsystems of one name", "E0411", _same_names, {Follows.OLD_NAME: "E0201"}),
    fault("device that nobody uses", "W0410 O0404", _idle_devices, {Follows.TO_DO: "O0502"}),
    fault("name with two meanings", "E0221", _reserved, {Follows.BOTH: "W0611"}),
    fault("rates that do not divide", "E0409", _odd_rates),
    fault("what is no rate", "E0104", _no_rates),
    fault("missing rate", "E0102 O0601", _missing_rates),
)
