"""Faults in when samples come, in plants in Python, and in what devices get when a run ends."""

from __future__ import annotations

from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.plant_faults import bindings, is_command
from bench.seeding.sheet import Sheet
from specc.source import Route


def _measured(sheet: Sheet) -> list[Route]:
    return [binding for binding in bindings(sheet) if not is_command(sheet, binding)]


def _with(sheet: Sheet, binding: Route, *texts: str) -> Seed:
    """More keys of a binding."""
    first = sheet.entries(binding)[0]
    edits = [sheet.beside(first, text) for text in texts]
    return seed(edits, sheet.key(binding).start, sheet.key(first).start)


def _samples(sheet: Sheet) -> Iterator[Seed]:
    """What is said of sporadic samples where it does not go."""
    for binding in bindings(sheet):
        if is_command(sheet, binding) or sheet.has((*binding, "rate")):
            yield _with(sheet, binding, "sporadic: true")
        else:
            yield _with(sheet, binding, "max_gap: 100 ms")


def _no_times(sheet: Sheet) -> Iterator[Seed]:
    wrong = ("100", "100 m", "0 ms", "-5 ms", "soon")
    for route in sheet.walk():
        if route[-1:] == ("max_age",):
            yield from (seed(sheet.replaced(sheet.at(route), text)) for text in wrong)
    for binding in _measured(sheet):
        if not sheet.has((*binding, "rate")):
            yield from (_with(sheet, binding, "sporadic: true", f"max_gap: {t}") for t in wrong)


def _limited(sheet: Sheet) -> list[tuple[Route, list[Route]]]:
    """Elements of devices whose age is limited, with the bindings of what the device reports."""
    found = []
    for route in sheet.walk():
        if route[-1:] == ("max_age",) and route[2:3] == ("real_effectors",):
            device = f"{route[1]}.E.{route[3]}."
            found.append((route, [b for b in _measured(sheet) if str(b[-1]).startswith(device)]))
    return found


def _too_old(sheet: Sheet) -> Iterator[Seed]:
    """A limit that the rates do not allow, and samples that stay out for longer."""
    for limit, listed in _limited(sheet):
        yield seed(sheet.replaced(sheet.at(limit), "1 ms"))
        for binding in listed:
            late = _with(sheet, binding, "sporadic: true", "max_gap: 200 ms")
            yield Seed(late.edits, late.places, (sheet.at(limit).start,))


def _any_age(sheet: Sheet) -> Iterator[Seed]:
    """Samples that may stay out for any length of time."""
    for limit, listed in _limited(sheet):
        for binding in listed:
            late = _with(sheet, binding, "sporadic: true")
            yield Seed(late.edits, late.places, (sheet.at(limit).start,))


def _in_python(sheet: Sheet) -> Iterator[Seed]:
    """A plant in Python whose bindings are those of a model."""
    route = ("plant", "model")
    if sheet.has(route):
        edits = [sheet.replaced(sheet.key(route), "python")]
        edits.append(sheet.replaced(sheet.at(route), '"robots.arm:Arm"'))
        yield seed(edits, elsewhere=[sheet.key(b).start for b in sheet.entries(("plant", "bind"))])


def _makers(sheet: Sheet) -> Iterator[Seed]:
    """A plant in Python beside the model, and one that Python could not import."""
    route = ("plant", "model")
    if not sheet.has(route):
        return
    key, value = sheet.key(route), sheet.at(route)
    yield seed(
        sheet.beside(route, 'python: "robots.arm:Arm"'), key.start, sheet.key(("plant",)).start
    )
    for wrong in ("robots.arm", "robots.arm:", "class:def", "robots/arm.py:Arm"):
        edits = [sheet.replaced(key, "python"), sheet.replaced(value, f'"{wrong}"')]
        yield seed(edits)


def _devices(sheet: Sheet) -> Iterator[Route]:
    for agent in sheet.entries(("agents",)):
        yield from sheet.entries((*agent, "real_effectors"))


def _unsafe(sheet: Sheet) -> Iterator[Seed]:
    """A safe output that is what was measured last, or computed, without a constant beside it."""
    for device in _devices(sheet):
        reported = {
            sheet.get(sheet.scalar(e, "type")): e[-1] for e in sheet.entries((*device, "y"))
        }
        for element in sheet.entries((*device, "x")):
            safe: Route = (*element, "safe")
            otherwise: Route = (*safe, "otherwise")
            measured = reported.get(type_ := sheet.get(sheet.scalar(element, "type")))
            if sheet.has(otherwise):
                yield seed(sheet.removed(otherwise), sheet.key(safe).start)
            elif sheet.has(safe) and measured:
                yield seed(sheet.replaced(sheet.at(safe), str(measured)))
            elif measured:
                text = f'{{type: "{type_}", safe: {measured}}}'
                yield seed(sheet.replaced(sheet.at(element), text))


FAULTS = (
    fault("what is said of sporadic samples elsewhere", "E0505", _samples),
    fault("what is no length of time", "E0104", _no_times),
    fault("samples that come too late", "E0410", _too_old, several=Follows.LATE),
    fault("samples that may never come", "W0416", _any_age, several=Follows.LATE),
    fault(
        "bindings of a model for a plant in Python", "E0505", _in_python, several=Follows.EVERY_USE
    ),
    fault("what makes no plant", "E0104", _makers),
    fault("safe output that may fail", "E0412", _unsafe),
)
