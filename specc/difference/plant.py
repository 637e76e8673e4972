"""Changes of the plant and of the task: what surrounds the agents."""

from __future__ import annotations

from dataclasses import fields

from specc.difference.record import Book, paired
from specc.model.system import Binding, System, Task


def compare_plants(old: System, new: System, book: Book) -> None:
    """The model and what stands behind the devices."""
    if old.plant is None or new.plant is None:
        if old.plant is not None:
            book.removed("plant", "", old.plant.model)
        if new.plant is not None:
            book.added("plant", "", new.plant.model)
        return
    book.changed("plant", "", "model", old.plant.model, new.plant.model)
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
        if item.name != "place":
            before, after = getattr(old, item.name), getattr(new, item.name)
            book.changed(part, name, item.name, _shown(before), _shown(after))


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "none"
    return "none" if value is None or value == "" else str(value)
