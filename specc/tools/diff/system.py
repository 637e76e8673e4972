"""Differences between two systems: agents, buffers, definitions, plant and task."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from fractions import Fraction

from specc.diagnostics.phrases import ms
from specc.lang import show
from specc.model.system import Agent, Binding, Device, Operator, Subsystem, System, Task
from specc.tools.diff.machine import (
    compare_axioms,
    compare_behaviours,
    compare_conditions,
    compare_rows,
    compare_states,
)
from specc.tools.diff.meaning import Constants, Meaning, Version, compare_types, type_text
from specc.tools.diff.record import Book, Comparison, Difference, Pairs, paired
from specc.tools.diff.values import (
    compare_buffers,
    compare_elements,
    compare_functions,
    compare_lets,
    compare_memory,
    compare_parameters,
)

# Changes of the plant and of the task: what surrounds the agents.


_SPELT = {"rate_hz": "rate", "max_gap_s": "max_gap"}


def compare_plants(old: System, new: System, book: Book) -> None:
    """The model and what stands behind the devices."""
    if old.plant is None or new.plant is None:
        if old.plant is not None:
            book.removed("plant", "", old.plant.model or old.plant.python)
        if new.plant is not None:
            book.added("plant", "", new.plant.model or new.plant.python)
        return
    for key in ("model", "python"):
        before, after = getattr(old.plant, key), getattr(new.plant, key)
        book.changed("plant", "", key, _shown(before), _shown(after))
    pairs = paired(old.plant.bindings, new.plant.bindings, lambda b: f"{b.device}.{b.element}")
    for name in pairs.removed:
        book.removed("binding", name)
    for name in pairs.added:
        book.added("binding", name)
    for name, (before, after) in pairs.both.items():
        _records("binding", name, before, after, book)


def compare_tasks(old: Task | None, new: Task | None, book: Book) -> None:
    """What a run counts and judges."""
    if old is None or new is None:
        if old is not None:
            book.removed("task", "", f"{old.subsystem}: {old.source} to {old.target}")
        if new is not None:
            book.added("task", "", f"{new.subsystem}: {new.source} to {new.target}")
        return
    _records("task", "", old, new, book)


def _records(part: str, name: str, old: Binding | Task, new: Binding | Task, book: Book) -> None:
    for item in fields(old):
        if item.name not in ("place", "noise_units"):
            before, after = getattr(old, item.name), getattr(new, item.name)
            aspect = _SPELT.get(item.name, item.name)
            book.changed(part, name, aspect, _shown(before, aspect), _shown(after, aspect))


def _shown(value: object, aspect: str = "") -> str:
    if isinstance(value, Fraction):
        return ms(value) if aspect == "max_gap" else f"{float(value):g} Hz"
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "none"
    return "none" if value is None or value == "" else str(value)


# Changes between two systems, agent by agent.


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
    """A constant matters where it is used; only adding or removing it changes nothing."""
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
