"""Faults in the plant's bindings and in the task."""

from __future__ import annotations

from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.sheet import Edit, Sheet, misspelt
from specc.source import Route

_NAMED = ("actuators", "joints", "sensors")


def _bindings(sheet: Sheet) -> list[Route]:
    return sheet.entries(("plant", "bind"))


def _listed(sheet: Sheet, kind: str) -> Iterator[Seed]:
    for binding in _bindings(sheet):
        for route in sheet.entries((*binding, kind)):
            node = sheet.at(route)
            yield seed(sheet.replaced(node, misspelt(str(sheet.get(route)))))


def _actuators(sheet: Sheet) -> Iterator[Seed]:
    yield from _listed(sheet, "actuators")


def _joints(sheet: Sheet) -> Iterator[Seed]:
    yield from _listed(sheet, "joints")


def _sensors(sheet: Sheet) -> Iterator[Seed]:
    yield from _listed(sheet, "sensors")


def _cameras(sheet: Sheet) -> Iterator[Seed]:
    for binding in _bindings(sheet):
        if sheet.has((*binding, "camera")):
            yield seed(sheet.replaced(sheet.at((*binding, "camera")), "kinetc"))


def _elements(sheet: Sheet) -> Iterator[Seed]:
    for binding in _bindings(sheet):
        key = sheet.key(binding)
        for wrong in (f"{binding[-1]}x", "nobody.E.m.x"):
            yield seed(sheet.replaced(key, wrong))


def _unbound(sheet: Sheet) -> Iterator[Seed]:
    for binding in _bindings(sheet):
        agent, group, device, element = str(binding[-1]).split(".")
        real = {"E": "real_effectors", "R": "real_receptors"}[group]
        found = ("agents", agent, real, device)
        buffers = [b for b in ("x", "y") if sheet.has((*found, b, element))]
        places = [sheet.key((*found, b, element)).start for b in buffers]
        plant = [sheet.key(("plant",)).start, sheet.key(("plant", "bind")).start]
        yield seed(sheet.removed(binding), *plant, elsewhere=places)


def _sizes(sheet: Sheet) -> Iterator[Seed]:
    """One name too many, where no function stands in between."""
    for binding in _bindings(sheet):
        if sheet.has((*binding, "through")) or sheet.has((*binding, "noise")):
            continue
        for kind in _NAMED:
            for route in sheet.entries((*binding, kind)):
                extra = "belt_angle" if kind == "sensors" else "gate_drive"
                node = sheet.at(route)
                if sheet.get(route) != extra:
                    yield seed(Edit(node.end, node.end, f", {extra}"))


def _noises(sheet: Sheet) -> Iterator[Seed]:
    for binding in _bindings(sheet):
        route: Route = (*binding, "noise")
        if sheet.has(route):
            yield seed(sheet.replaced(sheet.at(route), '["1[N]", "1[N]", "1[N]"]'))
            yield seed(sheet.replaced(sheet.at(route), '"-1[N]"'))


def _rates(sheet: Sheet) -> Iterator[Seed]:
    for binding in _bindings(sheet):
        if sheet.has((*binding, "rate")):
            for wrong in ("7 Hz", "300 Hz"):
                yield seed(sheet.replaced(sheet.at((*binding, "rate")), wrong))


def _kinds(sheet: Sheet) -> Iterator[Seed]:
    """Depth for colour, a command measured, a measurement commanded."""
    for binding in _bindings(sheet):
        image = (*binding, "image")
        if sheet.has(image):
            other = "rgb" if sheet.get(image) == "depth" else "depth"
            yield seed(sheet.replaced(sheet.at(image), other))
        elif sheet.has((*binding, "sensors")) and not sheet.has((*binding, "noise")):
            text = "{camera: overview, image: rgb}"
            yield seed(sheet.replaced(sheet.at(binding), text), sheet.key(binding).start)
        elif _is_command(sheet, binding) and not sheet.has((*binding, "joints")):
            node = sheet.key((*binding, "actuators"))
            yield seed(sheet.replaced(node, "joints"), sheet.key(binding).start)


def _driven_twice(sheet: Sheet) -> Iterator[Seed]:
    """The actuator of another element, beside or instead of the element's own."""
    commanded = [b for b in _bindings(sheet) if _is_command(sheet, b)]
    for one in commanded:
        for other in commanded:
            if one != other:
                first = sheet.get((*other, "actuators"))[0]
                node = sheet.at((*one, "actuators", 0))
                places = [sheet.key(other).start]
                yield seed(sheet.replaced(node, first), elsewhere=places)


def _is_command(sheet: Sheet, binding: Route) -> bool:
    agent, group, device, element = str(binding[-1]).split(".", 3)
    return group == "E" and sheet.has(("agents", agent, "real_effectors", device, "x", element))


def _tasks(sheet: Sheet) -> Iterator[Seed]:
    for key in ("of", "from", "to"):
        route: Route = ("task", "cycle", key)
        if sheet.has(route):
            yield seed(sheet.replaced(sheet.at(route), f"{sheet.get(route)}_"))
    for route in sheet.entries(("task", "watch")):
        yield seed(sheet.replaced(sheet.at(route), "nothing"))


FAULTS = (
    fault("wrong actuator in the binding", "E0502", _actuators),
    fault("wrong joint in the binding", "E0502", _joints),
    fault("wrong sensor in the binding", "E0502", _sensors),
    fault("wrong camera in the binding", "E0502", _cameras),
    fault("binding of an unknown element", "E0503", _elements, {Follows.TO_DO: "O0502"}),
    fault("element without a binding", "E0504 O0502", _unbound),
    fault("binding of the wrong size", "E0507", _sizes, {Follows.BOTH: "E0508"}),
    fault("binding of the wrong kind", "E0505", _kinds),
    fault("noise that does not fit", "E0506 E0510", _noises),
    fault("rate of a sensor that does not fit", "E0509", _rates),
    fault("actuator driven twice", "E0508", _driven_twice),
    fault("task about what does not exist", "E0201 E0217 E0220", _tasks),
)
