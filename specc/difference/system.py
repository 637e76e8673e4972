"""Changes between two systems, agent by agent."""

from __future__ import annotations

from collections.abc import Iterable

from specc.difference.machine import compare_behaviours, compare_conditions, compare_states
from specc.difference.meaning import Constants, Meaning, Version
from specc.difference.plant import compare_plants, compare_tasks
from specc.difference.record import Book, Comparison, Difference, Pairs, paired
from specc.difference.rows import compare_axioms, compare_rows
from specc.difference.types import compare_types, type_text
from specc.difference.values import (
    compare_buffers,
    compare_elements,
    compare_functions,
    compare_lets,
    compare_memory,
    compare_parameters,
)
from specc.expr import show
from specc.model.system import Agent, Device, Operator, Subsystem, System


def compare(old: System, new: System) -> Comparison:
    """All changes from `old` to `new`; neither has errors in it."""
    book = Book()
    book.changed("system", "", "name", old.name, new.name)
    book.remark("system", "", "title", old.title, new.title)
    _texts("frame", old.frames, new.frames, book, semantic=False)
    _texts("file", old.files, new.files, book, semantic=True)
    _constants(old, new, book)
    compare_types(old, new, book)
    _operators(old.operators, new.operators, book)
    changes = book.changes
    agents = paired(old.agents, new.agents, lambda a: a.name)
    for name, agent in agents.removed.items():
        book.removed("agent", name, agent.title)
    for name, agent in agents.added.items():
        book.added("agent", name, agent.title)
    for name, (before, after) in agents.both.items():
        changes += _agent(name, (old, before), (new, after))
    plant = Book()
    compare_plants(old, new, plant)
    compare_tasks(old.task, new.task, plant)
    return Comparison((*changes, *plant.changes))


def _texts(
    part: str,
    old: Iterable[tuple[str, str]],
    new: Iterable[tuple[str, str]],
    book: Book,
    *,
    semantic: bool,
) -> None:
    pairs = paired(old, new, lambda item: item[0])
    for name, item in pairs.removed.items():
        book.removed(part, name, item[1], semantic=False)
    for name, item in pairs.added.items():
        book.added(part, name, item[1], semantic=False)
    for name, (before, after) in pairs.both.items():
        book.changed(part, name, "", before[1], after[1], semantic=semantic)


def _constants(old: System, new: System, book: Book) -> None:
    """A constant matters where it is used, so one that comes or goes alone changes nothing."""
    values = Constants(old, new)
    pairs = paired(old.constants, new.constants, lambda c: c.name)
    for name, constant in pairs.removed.items():
        book.removed("constant", name, show(constant.value), semantic=False)
    for name, constant in pairs.added.items():
        book.added("constant", name, show(constant.value), semantic=False)
    for name, (before, after) in pairs.both.items():
        texts = show(before.value), show(after.value)
        book.equality("constant", name, "value", texts, values.same(before.value, after.value))
        book.remark("constant", name, "title", before.title, after.title)


def _operators(old: Iterable[Operator], new: Iterable[Operator], book: Book) -> None:
    pairs = paired(old, new, lambda o: o.name)
    for name, operator in pairs.removed.items():
        book.removed("operator", name, _signature(operator), semantic=False)
    for name, operator in pairs.added.items():
        book.added("operator", name, _signature(operator), semantic=False)
    for name, (before, after) in pairs.both.items():
        book.changed("operator", name, "signature", _signature(before), _signature(after))
        book.changed("operator", name, "function", before.python, after.python)
        book.words("operator", name, before, after)


def _signature(operator: Operator) -> str:
    """Without the names of parameters, which only their reader needs."""
    parameters = ", ".join(type_text(type) for _, type in operator.parameters)
    return f"({parameters}) -> {type_text(operator.result)}"


def _agent(name: str, old: tuple[System, Agent], new: tuple[System, Agent]) -> list[Difference]:
    book = Book(name)
    (old_system, before), (new_system, after) = old, new
    book.remark("agent", name, "kind", before.kind, after.kind)
    book.remark("agent", name, "title", before.title, after.title)
    changes = book.changes
    devices = paired(before.devices, after.devices, lambda d: d.qualified_name)
    _whole("device", devices, book)
    for first, second in devices.both.values():
        changes += _device(first, second)
    subsystems = paired(before.subsystems, after.subsystems, lambda s: s.qualified_name)
    _whole("subsystem", subsystems, book)
    for one, other in subsystems.both.values():
        changes += _subsystem(Version(old_system, one), Version(new_system, other))
    return changes


def _whole(part: str, pairs: Pairs[Device] | Pairs[Subsystem], book: Book) -> None:
    for name, thing in pairs.removed.items():
        book.removed(part, name, thing.kind.replace("_", " "))
    for name, thing in pairs.added.items():
        book.added(part, name, thing.kind.replace("_", " "))


def _device(old: Device, new: Device) -> list[Difference]:
    book = Book(old.qualified_name)
    name = old.qualified_name
    book.words("device", name, old, new)
    before, after = (
        [(f"{side}.{e.name}", e) for side in ("x", "y") for e in getattr(device, side)]
        for device in (old, new)
    )
    compare_elements(before, after, lambda a, b: a == b, book)
    return book.changes


def _subsystem(old: Version, new: Version) -> list[Difference]:
    before, after = old.subsystem, new.subsystem
    name = before.qualified_name
    book, meaning = Book(name), Meaning(old, new)
    book.changed("subsystem", name, "kind", before.kind, after.kind)
    book.changed("subsystem", name, "rate", f"{before.rate_hz} Hz", f"{after.rate_hz} Hz")
    book.words("subsystem", name, before, after)
    for part in (
        compare_buffers, compare_parameters, compare_memory, compare_lets, compare_conditions,
        compare_functions, compare_behaviours, compare_states, compare_rows, compare_axioms,
    ):  # fmt: skip
        part(before, after, meaning, book)
    return book.changes
