"""Faults in the plant's bindings and in the task."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import machines
from bench.seeding.sheet import Edit, Sheet, misspelt
from specc.source import Route

_NAMED = ("actuators", "joints", "sensors")


def bindings(sheet: Sheet) -> list[Route]:
    """Routes of the bindings of the plant, for agents that the sheet itself describes."""
    found = sheet.entries(("plant", "bind"))
    agents = sheet.get(("agents",), {})
    return [b for b in found if "use" not in agents.get(str(b[-1]).partition(".")[0], {"use"})]


def _listed(sheet: Sheet, kind: str) -> Iterator[Seed]:
    for binding in bindings(sheet):
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
    for binding in bindings(sheet):
        if sheet.has((*binding, "camera")):
            yield seed(sheet.replaced(sheet.at((*binding, "camera")), "kinetc"))


def _elements(sheet: Sheet) -> Iterator[Seed]:
    for binding in bindings(sheet):
        key = sheet.key(binding)
        for wrong in (f"{binding[-1]}x", "nobody.E.m.x"):
            yield seed(sheet.replaced(key, wrong))


def _unbound(sheet: Sheet) -> Iterator[Seed]:
    for binding in bindings(sheet):
        agent, group, device, element = str(binding[-1]).split(".")
        real = {"E": "real_effectors", "R": "real_receptors"}[group]
        found = ("agents", agent, real, device)
        buffers = [b for b in ("x", "y") if sheet.has((*found, b, element))]
        places = [sheet.key((*found, b, element)).start for b in buffers]
        plant = [sheet.key(("plant",)).start, sheet.key(("plant", "bind")).start]
        yield seed(sheet.removed(binding), *plant, elsewhere=places)


def _sizes(sheet: Sheet) -> Iterator[Seed]:
    """One name too many, where no function stands in between."""
    for binding in bindings(sheet):
        if sheet.has((*binding, "through")) or sheet.has((*binding, "noise")):
            continue
        for kind in _NAMED:
            for route in sheet.entries((*binding, kind)):
                extra = "belt_angle" if kind == "sensors" else "gate_drive"
                node = sheet.at(route)
                if sheet.get(route) != extra:
                    yield seed(Edit(node.end, node.end, f", {extra}"))


def _noises(sheet: Sheet) -> Iterator[Seed]:
    for binding in bindings(sheet):
        route: Route = (*binding, "noise")
        if sheet.has(route):
            yield seed(sheet.replaced(sheet.at(route), '["1[N]", "1[N]", "1[N]"]'))
            yield seed(sheet.replaced(sheet.at(route), '"-1[N]"'))


def _noise_units(sheet: Sheet) -> Iterator[Seed]:
    """Amperes, or the unit of the sensor beside it."""
    for binding in bindings(sheet):
        route: Route = (*binding, "noise")
        one = sheet.get(route)
        if isinstance(one, list):
            for index, other in enumerate(reversed(one)):
                if other != one[index]:
                    yield seed(sheet.replaced(sheet.at((*route, index)), f'"{other}"'))
        elif isinstance(one, str) and "[" in one:
            yield seed(sheet.replaced(sheet.at(route), '"0.1[A]"'))


def _other_sensors(sheet: Sheet) -> Iterator[Seed]:
    """A sensor that another element has, which is of another kind."""
    plain = [b for b in bindings(sheet) if not sheet.has((*b, "through"))]
    every = [(b, r) for b in plain for r in sheet.entries((*b, "sensors"))]
    for binding, route in every:
        for other, _ in [(r, b) for b, r in every if b != binding]:
            yield seed(sheet.replaced(sheet.at(route), str(sheet.get(other))))


def _other_actuators(sheet: Sheet) -> Iterator[Seed]:
    """The servos of two elements changed round."""
    plain = [b for b in bindings(sheet) if not sheet.has((*b, "through"))]
    commanded = [b for b in plain if is_command(sheet, b)]
    for first, second in itertools.pairwise(commanded):
        routes = [(*binding, "actuators", 0) for binding in (first, second)]
        names = [str(sheet.get(route)) for route in routes]
        edits = [sheet.replaced(sheet.at(r), n) for r, n in zip(routes, names[::-1], strict=True)]
        yield seed(edits, *(edit.start for edit in edits))


def _joints_twice(sheet: Sheet) -> Iterator[Seed]:
    for binding in bindings(sheet):
        routes = sheet.entries((*binding, "joints"))
        for route, other in itertools.pairwise(routes):
            edit = sheet.replaced(sheet.at(other), str(sheet.get(route)))
            yield seed(edit)


def _disordered(sheet: Sheet) -> Iterator[Seed]:
    """Two joints changed round, beside the actuators that drive them."""
    for binding in bindings(sheet):
        routes = sheet.entries((*binding, "joints")) if sheet.has((*binding, "actuators")) else []
        for one, other in itertools.pairwise(routes):
            edits = [
                sheet.replaced(sheet.at(one), str(sheet.get(other))),
                sheet.replaced(sheet.at(other), str(sheet.get(one))),
            ]
            yield seed(edits, *(edit.start for edit in edits))


def _rates(sheet: Sheet) -> Iterator[Seed]:
    for binding in bindings(sheet):
        if sheet.has((*binding, "rate")):
            for wrong in ("7 Hz", "300 Hz"):
                yield seed(sheet.replaced(sheet.at((*binding, "rate")), wrong))


def _kinds(sheet: Sheet) -> Iterator[Seed]:
    """Depth for colour, a command measured, a measurement commanded."""
    for binding in bindings(sheet):
        image = (*binding, "image")
        if sheet.has(image):
            other = "rgb" if sheet.get(image) == "depth" else "depth"
            yield seed(sheet.replaced(sheet.at(image), other))
        elif sheet.has((*binding, "sensors")) and not sheet.has((*binding, "noise")):
            text = "{camera: overview, image: rgb}"
            yield seed(sheet.replaced(sheet.at(binding), text), sheet.key(binding).start)
        elif is_command(sheet, binding) and not sheet.has((*binding, "joints")):
            node = sheet.key((*binding, "actuators"))
            yield seed(sheet.replaced(node, "joints"), sheet.key(binding).start)


def _driven_twice(sheet: Sheet) -> Iterator[Seed]:
    """The actuator of another element, beside or instead of the element's own."""
    commanded = [b for b in bindings(sheet) if is_command(sheet, b)]
    for one in commanded:
        for other in commanded:
            if one != other:
                first = sheet.get((*other, "actuators"))[0]
                node = sheet.at((*one, "actuators", 0))
                taken = sheet.at((*other, "actuators", 0)).start
                yield seed(sheet.replaced(node, first), elsewhere=[taken])


def is_command(sheet: Sheet, binding: Route) -> bool:
    """Whether a binding is about what a device accepts."""
    agent, group, device, element = str(binding[-1]).split(".", 3)
    return group == "E" and sheet.has(("agents", agent, "real_effectors", device, "x", element))


def _tasks(sheet: Sheet) -> Iterator[Seed]:
    for key in ("of", "from", "to"):
        route: Route = ("task", "cycle", key)
        if sheet.has(route):
            yield seed(sheet.replaced(sheet.at(route), f"{sheet.get(route)}_"))
    for route in sheet.entries(("task", "watch")):
        yield seed(sheet.replaced(sheet.at(route), "nothing"))


def _cycles(sheet: Sheet) -> Iterator[Seed]:
    """A cycle between states that no row joins."""
    cycle = ("task", "cycle")
    for machine in machines(sheet):
        whole = [
            *machine.route[1:2],
            {"control": "c"}.get(str(machine.route[-1]), machine.route[-1]),
        ]
        if ".".join(map(str, whole)) != sheet.get((*cycle, "of")):
            continue
        source = sheet.get((*cycle, "from"))
        joined = {row.target for row in machine.rows() if row.state == source}
        for state in machine.get("states"):
            if state not in joined:
                yield seed(sheet.replaced(sheet.at((*cycle, "to")), state))


FAULTS = (
    fault("wrong actuator in the binding", "E0502", _actuators),
    fault("wrong joint in the binding", "E0502", _joints),
    fault("wrong sensor in the binding", "E0502", _sensors),
    fault("wrong camera in the binding", "E0502", _cameras),
    fault("binding of an unknown element", "E0502", _elements, {Follows.TO_DO: "O0502"}),
    fault("element without a binding", "E0504 O0502", _unbound),
    fault("binding of the wrong size", "E0507", _sizes, {Follows.BOTH: "E0508"}),
    fault("binding of the wrong kind", "E0505", _kinds),
    fault("noise that does not fit", "E0505", _noises),
    fault("noise in another unit", "E0505", _noise_units),
    fault("sensor of another kind", "E0511", _other_sensors, {Follows.BOTH: "W0526"}),
    fault(
        "servo of another kind",
        "E0511",
        _other_actuators,
        {Follows.BOTH: "W0525"},
        several=Follows.EACH,
    ),
    fault("joint twice in a binding", "E0505", _joints_twice),
    fault("joints in another order than actuators", "W0513", _disordered),
    fault("rate of a sensor that does not fit", "E0505", _rates),
    fault("actuator driven twice", "E0508", _driven_twice, {Follows.BOTH: "E0511 W0525"}),
    fault("task about what does not exist", "E0201", _tasks),
    fault("cycle that no row ends", "E0514", _cycles),
)
