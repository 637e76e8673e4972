"""Changes of the plant and of the task: what surrounds the agents."""

from __future__ import annotations

from dataclasses import fields
from fractions import Fraction

from specc.difference.record import Book, paired
from specc.facts.words import ms
from specc.model.system import Binding, System, Task

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
