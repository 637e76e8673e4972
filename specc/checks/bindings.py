"""What stands behind the devices is named in the model, and each is driven once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from specc.analysis import Facts
from specc.analysis.plant import wrong_kind
from specc.analysis.words import below, listed
from specc.diagnostics import Diagnostic, Edit, Fix, Related, is_slip, nearest, surely_meant
from specc.lang import or_else
from specc.mjcf import Model, ModelError
from specc.model.system import Binding, System
from specc.model.types import Type, records_in
from specc.source import Place

# The model of the plant is there and is MJCF.


def model_readable(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0501."""
    if system.plant is not None and isinstance(facts.model, ModelError):
        why, _, way_out = str(facts.model).partition("; ")
        yield Diagnostic(
            "E0501",
            f"the model of the plant cannot be used: {why}",
            system.plant.place,
            help=way_out
            or "a model is an MJCF file; its path is relative to the file that names it",
        )


# What the plant binds are elements of devices.


_LISTED = 8


def bindings_known(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0503, and O0205 for what may still come."""
    elements = {d.qualified_name: [e.name for e in (*d.x, *d.y)] for d in system.devices}
    for binding in system.plant.bindings if system.plant else ():
        known = elements.get(binding.device)
        if binding.device in facts.broken:
            continue
        if known is None:
            message = f"there is no device `{binding.device}`"
            yield _unknown_element(binding, message, binding.device, list(elements))
        elif binding.element not in known:
            message = f"`{binding.device}` has no element `{binding.element}`"
            yield _unknown_element(binding, message, binding.element, known)


def _unknown_element(binding: Binding, message: str, name: str, known: list[str]) -> Diagnostic:
    hint = _suggestion(name, known)
    # A real effector called a real receptor, or the other way round, is no other device.
    if is_slip(name, known) or name.split(".")[-1] in {other.split(".")[-1] for other in known}:
        return Diagnostic("E0503", message, binding.place, help=hint)
    absent = f"`{binding.device}.{binding.element}` is not there yet"
    help = or_else("add it to the agent", hint)
    return Diagnostic("O0205", absent, binding.place, message, help=help)


def _suggestion(name: str, known: list[str]) -> str:
    if close := nearest(name, known):
        return f"did you mean {listed(_quoted(close), 'or')}?"
    if known:
        return f"known: {', '.join(_quoted(known[:_LISTED]))}"
    return "an element is named `agent.E.device.element`"


def _quoted(names: list[str]) -> list[str]:
    return [f"`{name}`" for name in names]


# Records that Python code makes have a class that it can import.


def records_made(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0206, once for each record."""
    makers: dict[str, list[Related]] = {}
    for type_, given, maker in _made(system, facts):
        for name in _classless(type_) - {name for one in given for name in _classless(one)}:
            makers.setdefault(name, []).append(maker)
    for name, (first, *others) in makers.items():
        yield Diagnostic(
            "O0206",
            f"record `{name}` has no Python class, but Python code has to create its values",
            first.place,
            first.message,
            related=tuple(others[:_LISTED]),
            help="add `python: package.module:Class`, a frozen dataclass or a `NamedTuple` with "
            "these fields",
        )


def _made(system: System, facts: Facts) -> Iterator[tuple[Type, Sequence[Type], Related]]:
    """Types of what Python code gives, beside those that it is given and may pass on."""
    for operator in system.operators:
        given = [type_ for _, type_ in operator.parameters]
        if operator.python:
            yield operator.result, given, Related(operator.place, f"gives `{operator.result}`")
    for bound in facts.bindings:
        if not bound.commanded:
            type_ = bound.element.type
            yield type_, (), Related(bound.binding.place, f"gives `{type_}`")


def _classless(type_: Type) -> set[str]:
    return {name for name, record in records_in(type_).items() if not record.python}


# What is to be simulated has a plant behind its devices and a task to count.


def devices_simulated(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0501 and O0503; a specification with neither plant nor task is not meant to be simulated."""
    if system.plant is None and system.task is not None:
        yield from without_plant(system, system.task.place)
    if system.plant is not None and system.task is None and system.devices:
        yield Diagnostic(
            "O0503",
            "nothing says what a run counts: there is no task",
            system.plant.place,
            help="add `task:` with the transition that ends a cycle",
        )


def without_plant(system: System, place: Place) -> Iterator[Diagnostic]:
    """O0501 at a place, if there are devices."""
    if system.devices:
        names = ", ".join(f"`{device.qualified_name}`" for device in system.devices)
        yield Diagnostic(
            "O0501",
            "there is no plant behind the devices",
            place,
            f"nothing stands behind {names}",
            help="add `plant:` with what makes it, `model` or `python`, and what it binds",
        )


# If there is a plant, something stands behind every element of every device.


def devices_bound(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0502; not for an element that an unknown one is nearest to, which `bindings_known` tells."""
    if system.plant is None:
        return
    bound = {(b.device, b.element) for b in system.plant.bindings}
    elements = {
        (d.qualified_name, e.name): f"{d.qualified_name}.{e.name}"
        for d in system.devices
        for e in (*d.x, *d.y)
    }
    open_ = {name for key, name in elements.items() if key not in bound}
    strange = [f"{device}.{element}" for device, element in bound - elements.keys()]
    meant = {name for other in strange for name in nearest(other, open_)[:1]}
    for device in system.devices:
        for element in (*device.x, *device.y):
            if elements[device.qualified_name, element.name] in open_ - meant:
                yield Diagnostic(
                    "O0502",
                    f"nothing in the plant stands behind `{device.qualified_name}.{element.name}`",
                    element.place,
                    related=(Related(system.plant.place, "the plant"),),
                    help=f"add `{device.qualified_name}.{element.name}: {{...}}` under `bind:`",
                )


# A commanded element moves actuators; a reported one comes from joints, sensors or a camera.


def bindings_fit(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0505."""
    for bound in facts.bindings:
        complaint = wrong_kind(bound)
        if complaint:
            message, help_text = complaint
            related = (Related(bound.element.place, f"`{bound.element.type}`"),)
            yield Diagnostic("E0505", message, bound.binding.place, "", related, help_text)


# The joints, sensors, actuators and cameras that bindings name are in the model.


def model_names_known(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0502; names in a binding of the wrong kind are `bindings_fit`'s matter."""
    model = facts.model
    if system.plant is None or not isinstance(model, Model) or not model.complete:
        return
    unfit = [bound.binding for bound in facts.bindings if wrong_kind(bound)]
    for binding in system.plant.bindings:
        for kind, names, known in _named(binding, model):
            for index, name in enumerate(names):
                if name not in known and binding not in unfit:
                    yield _unknown_name(_place(binding, kind, index), kind, name, known)


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


def _unknown_name(place: Place, kind: str, name: str, known: Mapping[str, object]) -> Diagnostic:
    close = nearest(name, known)
    if close:
        hint = "did you mean " + " or ".join(f"`{n}`" for n in close) + "?"
    else:
        hint = "it has " + (", ".join(f"`{n}`" for n in list(known)[:8]) or f"no {kind}s")
    meant = surely_meant(name, close)
    fix = Fix(f"write `{meant}`", (Edit(place, meant),)) if meant else None
    return Diagnostic("E0502", f"the model has no {kind} `{name}`", place, help=hint, fix=fix)


# An actuator of the plant obeys one element.


def actuators_driven_once(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0508."""
    first: dict[str, Place] = {}
    for bound in facts.bindings:
        for index, name in enumerate(bound.binding.actuators if bound.commanded else ()):
            place = below(bound.binding.place, "actuators", index)
            if name in first:
                yield Diagnostic(
                    "E0508",
                    f"actuator `{name}` is driven twice",
                    place,
                    related=(Related(first[name], "driven by this already"),),
                    help="let one element of a device command it",
                )
            first.setdefault(name, place)


CHECKS = (
    model_readable,
    bindings_known,
    records_made,
    devices_simulated,
    devices_bound,
    bindings_fit,
    model_names_known,
    actuators_driven_once,
)
