"""Faults by which something is read before it has a value."""

from __future__ import annotations

from collections.abc import Iterator

from bench.seeding.fault import Seed, seed
from bench.seeding.machine import OTHERWISE, Machine, elements, machines
from bench.seeding.sheet import Sheet
from specc.source import Route


def no_initial_values(sheet: Sheet) -> Iterator[Seed]:
    """An input that is read from the first period on loses its initial value."""
    for machine in machines(sheet):
        for element in machine.elements("x"):
            if sheet.has((*element, "init")):
                name = f"x.{element[-2]}.{element[-1]}"
                uses = [
                    sheet.at(route).start
                    for _, route in machine.expressions()
                    if name in sheet.raw(sheet.at(route))
                ]
                place = sheet.key(element).start
                yield seed(sheet.removed((*element, "init")), place, elsewhere=uses)


def entered_unprepared(sheet: Sheet) -> Iterator[Seed]:
    """A row that asks for nothing new leads to a state that reads what may not have come."""
    for machine in machines(sheet):
        for state in machine.get("states"):
            reads = _event_reads(machine, state)
            for row in machine.rows_of(str(machine.get("initial_state")), "terminal"):
                idle = row.condition == OTHERWISE
                idle = idle or machine.text_of("initial", row.condition).startswith("not fresh")
                if reads and idle and row.target != state:
                    edit = sheet.replaced(sheet.at((*row.route, 3)), state)
                    yield seed(edit, elsewhere=reads)


def _event_reads(machine: Machine, state: str) -> list[int]:
    """Places in expressions of a state's behaviour that read inputs from `c` without `init`."""
    sheet = machine.sheet
    inputs = {
        f"x.c.{element[-1]}"
        for element in elements(sheet, machine.below("x", "c"))
        if not sheet.has((*element, "init"))
    }
    routes = {
        route[-1] if route[-1] != "is" else route[-2]: route
        for kind, route in machine.expressions()
        if kind == "let"
    }
    waiting = [
        sheet.scalar(route, "is")
        for function in machine.functions_of(machine.behaviour_of(state))
        for route in machine.targets_of(function).values()
    ]
    seen: list[Route] = []
    while waiting:
        route = waiting.pop()
        seen.append(route)
        called = [str(word.scalar) for word in sheet.words(route, {str(name) for name in routes})]
        waiting += [routes[name] for name in called if routes[name] not in (*seen, *waiting)]
    reads = [route for route in seen if any(name in sheet.raw(sheet.at(route)) for name in inputs)]
    return [sheet.at(route).start for route in (seen if reads else ())]
