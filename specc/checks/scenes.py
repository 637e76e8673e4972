"""What the scene and the disturbances of a task name fits the model of the plant."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace

from specc.analysis import Facts
from specc.analysis.plant import FREE, coordinate, plant_kind, unit_of_coordinate
from specc.diagnostics import Diagnostic, Related, nearest, surely_meant
from specc.mjcf import Model
from specc.model.system import PLANT, Binding
from specc.model.task import Start
from specc.model.units import DIMENSIONLESS
from specc.resolve.context import rename, suggestion
from specc.source import Place


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


# What happens while a run goes on.


def disturbances_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0502, E0503, E0516, E0517; a plant in Python says itself what can happen to it."""
    task, model = facts.system.task, facts.model
    bindings = {
        f"{b.binding.device}.{b.binding.element}": b.binding
        for b in facts.bindings
        if not b.commanded and b.binding.device != PLANT
    }
    for each in task.disturbances if task else ():
        if isinstance(model, Model):
            for start in (*each.moves, *each.shifts):
                yield from _start(start, model)
            bodies = [(name, place) for name, _, place in each.pushes]
            yield from _named("body", bodies, model.bodies, model)
            yield from _named("joint", each.blocked, model.joints, model)
        for name, place in each.silent:
            yield from _silent(name, place, each.lasts, bindings)


def _named(
    kind: str, names: Iterable[tuple[str, Place]], known: Collection[str], model: Model
) -> Iterator[Diagnostic]:
    for name, place in names:
        if name not in known and model.complete:
            help = suggestion(name, sorted(known))
            yield Diagnostic("E0502", f"the model has no {kind} `{name}`", place, help=help)


def _silent(
    name: str, place: Place, lasts: Start | None, bindings: Mapping[str, Binding]
) -> Iterator[Diagnostic]:
    binding = bindings.get(name)
    if binding is None:
        help = suggestion(name, sorted(bindings))
        yield Diagnostic("E0503", f"no device reports `{name}`", place, help=help)
        return
    longest = max(value for value, _ in lasts.positions) if lasts else None
    gap = binding.max_gap_s
    if not binding.sporadic:
        message = f"`{name}` is not sporadic: without a sample a run would stop with a fault"
        related = (Related(binding.place, "bound here"),)
        help = "add `sporadic: true` to its binding, and say in the agent what happens then"
        yield Diagnostic("E0517", message, place, related=related, help=help)
    elif gap is not None and (longest is None or longest > gap):
        message = f"`{name}` may be silent for {float(gap):g} s at most"
        related = (Related(binding.place, "bound here"),)
        help = "make `lasts` shorter, or `max_gap` longer"
        yield Diagnostic("E0517", message, place, related=related, help=help)


CHECKS = (starts_fit, disturbances_fit)
