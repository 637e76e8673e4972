"""The joints, sensors, actuators and cameras that bindings name are in the model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from specc.diagnostics import Diagnostic, Edit, Fix, nearest, surely_meant
from specc.facts import Facts
from specc.facts.kinds import wrong_kind
from specc.facts.places import below
from specc.mjcf import Model
from specc.model.system import Binding, System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0502; names in a binding of the wrong kind are `bindings_fit`'s matter."""
    model = facts.model
    if system.plant is None or not isinstance(model, Model) or not model.complete:
        return
    unfit = [bound.binding for bound in facts.bindings if wrong_kind(bound)]
    for binding in system.plant.bindings:
        for kind, names, known in _named(binding, model):
            for index, name in enumerate(names):
                if name not in known and binding not in unfit:
                    yield _unknown(_place(binding, kind, index), kind, name, known)


def _named(
    binding: Binding, model: Model
) -> Iterator[tuple[str, tuple[str, ...], Mapping[str, object]]]:
    yield "joint", binding.joints, model.joints
    yield "sensor", binding.sensors, model.sensors
    yield "actuator", binding.actuators, model.actuators
    yield "camera", (binding.camera,) if binding.camera else (), model.cameras


def _place(binding: Binding, kind: str, index: int) -> Place:
    if kind == "camera":
        return below(binding.place, kind)
    return below(binding.place, f"{kind}s", index)


def _unknown(place: Place, kind: str, name: str, known: Mapping[str, object]) -> Diagnostic:
    close = nearest(name, known)
    if close:
        hint = "did you mean " + " or ".join(f"`{n}`" for n in close) + "?"
    else:
        hint = "it has " + (", ".join(f"`{n}`" for n in list(known)[:8]) or f"no {kind}s")
    meant = surely_meant(name, close)
    fix = Fix(f"write `{meant}`", (Edit(place, meant),)) if meant else None
    return Diagnostic("E0502", f"the model has no {kind} `{name}`", place, help=hint, fix=fix)
