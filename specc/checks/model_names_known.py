"""The joints, sensors, actuators and cameras that bindings name are in the model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from specc.diagnostics import Diagnostic, nearest
from specc.facts import Facts
from specc.facts.places import below
from specc.mjcf import Model
from specc.model.system import Binding, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0502."""
    model = facts.model
    if system.plant is None or not isinstance(model, Model) or not model.complete:
        return
    for binding in system.plant.bindings:
        for kind, names, known in _named(binding, model):
            for name in names:
                if name not in known:
                    yield _unknown(binding, kind, name, known)


def _named(
    binding: Binding, model: Model
) -> Iterator[tuple[str, tuple[str, ...], Mapping[str, object]]]:
    yield "joint", binding.joints, model.joints
    yield "sensor", binding.sensors, model.sensors
    yield "actuator", binding.actuators, model.actuators
    yield "camera", (binding.camera,) if binding.camera else (), model.cameras


def _unknown(binding: Binding, kind: str, name: str, known: Mapping[str, object]) -> Diagnostic:
    key = kind if kind == "camera" else f"{kind}s"
    close = nearest(name, known)
    if close:
        hint = "did you mean " + " or ".join(f"`{n}`" for n in close) + "?"
    else:
        hint = "it has " + (", ".join(f"`{n}`" for n in list(known)[:8]) or f"no {kind}s")
    place = below(binding.place, key)
    return Diagnostic("E0502", f"the model has no {kind} `{name}`", place, help=hint)
