"""The task of a system: what a run counts, begins with, goes through and is watched for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.lower.module import memory_names
from specc.lower.names import Imports, call, keyword_arguments, literal
from specc.lower.requirements import REQUIREMENTS, TRIGGERS
from specc.model.system import System
from specc.model.task import VERBS, DisturbanceAction, Draw, Task, Verb


def run_parts(system: System, imports: Imports, *, stand_ins: bool) -> dict[str, object]:
    """What a run counts, what happens meanwhile and what it is watched for.

    Stand-ins only begin and count.
    """
    parts: dict[str, object] = {"task": (), "disturbances": (), "requirements": "", "triggers": ""}
    if system.task:
        imports.runtime_name("Task")
        parts["task"] = tuple(_arguments(system, system.task, imports))
    if stand_ins:
        return parts
    if system.task:
        parts["disturbances"] = tuple(_disturbances(system.task, imports))
    if system.requirements:
        parts["requirements"] = imports.runtime_name(REQUIREMENTS)
    if system.triggers:
        parts["triggers"] = imports.runtime_name(TRIGGERS)
        if system.stop_when:
            parts["stop_when"] = len(system.triggers) - 1
    return parts


def _arguments(system: System, task: Task, imports: Imports) -> Iterator[str]:
    """Arguments of `Task`, but for the disturbances."""
    names = ("subsystem", "source", "target", "scene", "judge")
    yield from keyword_arguments(
        {name: getattr(task, name) for name in names} | {"watch": _watched_memory(system, task)}
    )
    if task.starts:
        yield f"starts=({_draws(task.starts, imports)})"


def _disturbances(task: Task, imports: Imports) -> Iterator[str]:
    """Calls of `Disturbance`."""
    triggers = 0
    for each in task.disturbances:
        arguments = [literal(each.because)]
        arguments += [f"{draw.name}={_draw(draw, imports)}" for draw in each.times]
        if each.when is not None:
            arguments.append(f"when={triggers}")
            triggers += 1
        for verb in sorted(VERBS.values(), key=lambda verb: verb.numbers == "none"):
            actions = (deed for deed in each.actions if deed.verb == verb.name)
            items = " ".join(_action(verb, deed, imports) for deed in actions)
            arguments += [f"{verb.name}=({items})"] if items else []
        yield call(imports.runtime_name("Disturbance"), arguments)


def _action(verb: Verb, deed: DisturbanceAction, imports: Imports) -> str:
    """An item of a tuple: a name, a number, which has one, or a name with its numbers."""
    if verb.numbers in ("none", "one"):
        return _draws(deed.numbers, imports) or f"{literal(deed.name)},"
    return f"({literal(deed.name)}, ({_draws(deed.numbers, imports)})),"


def _draws(draws: Iterable[Draw], imports: Imports) -> str:
    """Items of a tuple."""
    return " ".join(f"{_draw(draw, imports)}," for draw in draws)


def _draw(draw: Draw, imports: Imports) -> str:
    first = literal(draw.name), literal(tuple(value for value, _ in draw.values))
    return call(
        imports.runtime_name("Draw"), (*first, *keyword_arguments({"between": draw.is_range}))
    )


def _watched_memory(system: System, task: Task) -> tuple[str, ...]:
    """Attributes of the watched memory elements."""
    subsystem = next((s for s in system.subsystems if s.qualified_name == task.subsystem), None)
    names = memory_names(subsystem) if subsystem else {}
    return tuple(names[name] for name in task.watch if name in names)
