"""What the scene of a task says of joints fits the model of the plant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from specc.analysis import Facts
from specc.analysis.plant import FREE, coordinate, plant_kind, unit_of_coordinate
from specc.diagnostics import Diagnostic, nearest, surely_meant
from specc.mjcf import Model
from specc.model.system import Start
from specc.model.units import DIMENSIONLESS
from specc.resolve.context import rename, suggestion


def starts_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0502, E0516."""
    task, plant = facts.system.task, facts.system.plant
    for start in task.starts if task else ():
        if isinstance(facts.model, Model):
            yield from _start(start, facts.model)
        elif plant_kind(plant) == "python":
            message = f"`{start.joint}` is for MuJoCo models; the plant in Python knows no joints"
            help = "let a class set the scene up: `scene: package.module:Class`"
            yield Diagnostic("E0516", message, start.place, help=help)


def _start(start: Start, model: Model) -> Iterator[Diagnostic]:
    joint, which = coordinate(start.joint, model)
    unit = unit_of_coordinate(joint, which, model)
    kind = model.joint_kind(joint)
    if joint not in model.joints:
        if model.complete:
            yield _unknown(start, joint, which, model)
    elif unit is None and kind:
        message = f"a {kind} joint has no coordinate `{which}`"
        help = f"write `{joint}`"
        if not which:
            message = f"`{joint}` is a {kind} joint, which one number does not place"
            help = "a scene places hinges, slides and free joints"
        if kind == "free":
            help = f"write {', '.join(f'`{joint}.{one}`' for one in FREE)}"
        yield Diagnostic("E0516", message, start.place, help=help)
    elif unit is not None:
        for value, given in start.positions:
            if given != unit and not (value == 0 and given == DIMENSIONLESS):
                message = f"`{start.joint}` is in {unit}, not in {given}"
                help = f"write a number with that unit, e.g. `0.3[{unit}]`"
                yield Diagnostic("E0516", message, replace(start.place, part="value"), help=help)
                return


def _unknown(start: Start, joint: str, which: str, model: Model) -> Diagnostic:
    meant = surely_meant(joint, nearest(joint, model.joints))
    name = f"{meant}.{which}" if meant and which else meant
    message, help = f"the model has no joint `{joint}`", suggestion(joint, list(model.joints))
    return Diagnostic("E0502", message, start.place, help=help, fix=rename(start.place, name))


CHECKS = (starts_fit,)
