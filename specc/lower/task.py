"""The task of a system: what a run counts, begins with and goes through."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.lower.module import memory_names
from specc.lower.names import call, given, literal
from specc.model.system import System
from specc.model.task import VERBS, Deed, Draw, Task, Verb


def task_arguments(system: System, task: Task) -> Iterator[str]:
    """Arguments of `Task`, but for the disturbances."""
    names = ("subsystem", "source", "target", "scene", "judge")
    yield from given(
        {name: getattr(task, name) for name in names} | {"watch": _watched(system, task)}
    )
    if task.starts:
        yield f"starts=({_draws(task.starts)})"


def disturbances(task: Task) -> Iterator[str]:
    """Calls of `Disturbance`."""
    triggers = 0
    for each in task.disturbances:
        told = [literal(each.because)]
        told += [f"{draw.name}={_draw(draw)}" for draw in each.times]
        if each.when is not None:
            told.append(f"when={triggers}")
            triggers += 1
        for verb in sorted(VERBS.values(), key=lambda verb: verb.numbers == "none"):
            items = " ".join(_done(verb, deed) for deed in each.deeds if deed.verb == verb.name)
            told += [f"{verb.name}=({items})"] if items else []
        yield call("Disturbance", told)


def _done(verb: Verb, deed: Deed) -> str:
    """An item of a tuple: a name, a number, which has one, or a name with its numbers."""
    if verb.numbers in ("none", "one"):
        return _draws(deed.numbers) or f"{literal(deed.name)},"
    return f"({literal(deed.name)}, ({_draws(deed.numbers)})),"


def _draws(draws: Iterable[Draw]) -> str:
    """Items of a tuple."""
    return " ".join(f"{_draw(draw)}," for draw in draws)


def _draw(draw: Draw) -> str:
    told = literal(draw.name), literal(tuple(value for value, _ in draw.values))
    return call("Draw", (*told, *given({"between": draw.between})))


def _watched(system: System, task: Task) -> tuple[str, ...]:
    """Attributes of the watched memory elements."""
    subsystem = next((s for s in system.subsystems if s.qualified_name == task.subsystem), None)
    names = memory_names(subsystem) if subsystem else {}
    return tuple(names[name] for name in task.watch if name in names)
