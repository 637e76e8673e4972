"""The plant of a system: bindings of its model, and which buffers they stand behind."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.lower.annotations import Annotations, TypeNames
from specc.lower.contracts import Contracts
from specc.lower.imports import Functions, Imports
from specc.lower.module import buffer_names
from specc.lower.names import Names
from specc.lower.plan import PlantPlan
from specc.lower.text import literal
from specc.model.system import Binding, Plant, System
from specc.model.types import Type, Vector

RUNTIME = "specc_runtime.system"
BINDINGS = "specc_runtime.plants.binding"


def plant_plan(
    system: System,
    imports: Imports,
    names: Names,
    types: TypeNames,
    safe: tuple[str, ...],
    *,
    stand_ins: bool,
) -> PlantPlan | None:
    """What stands behind the devices; None if the system has neither a plant nor devices.

    Elements without a binding are there by their names: a plant can still be given to a run.
    `safe` are the classes of the devices with safe outputs.
    """
    if system.plant is None and not system.devices:
        return None
    imports.add(RUNTIME, "PlantSpec")
    functions = Functions(imports, names)
    contracts = Contracts(imports, Annotations(imports, types), names.new, stand_ins=stand_ins)
    reported = {f"{d.qualified_name}.{e.name}": e.type for d in system.devices for e in d.y}
    sensors, actuators = [], []
    for binding in _bindings(system):
        type_ = reported.get(_name(binding))
        if type_ is not None:
            imports.add(BINDINGS, "SensorBinding")
            told = (*_sensor(binding, functions), *_contract(binding, type_, contracts))
            sensors.append(_call("SensorBinding", told))
        else:
            imports.add(BINDINGS, "ActuatorBinding")
            actuators.append(_call("ActuatorBinding", _actuator(binding, functions)))
    inputs, outputs = tuple(_ends(system, "x")), tuple(_ends(system, "y"))
    for kind, found in (("PlantInput", inputs), ("PlantOutput", outputs)):
        if found:
            imports.add(RUNTIME, kind)
    made, named = _made(system.plant), tuple(contracts.named)
    return PlantPlan(named, made, tuple(sensors), tuple(actuators), inputs, outputs, safe)


def _made(plant: Plant | None) -> str:
    """The argument that says what makes the plant; empty if nothing does."""
    if plant is None:
        return ""
    return f"python={literal(plant.python)}" if plant.python else f"model={literal(plant.model)}"


def _bindings(system: System) -> Iterator[Binding]:
    """Those of the plant, then of all other elements of devices."""
    bindings = system.plant.bindings if system.plant else ()
    yield from bindings
    bound = {_name(binding) for binding in bindings}
    for device in system.devices:
        for element in (*device.x, *device.y):
            if f"{device.qualified_name}.{element.name}" not in bound:
                yield Binding(device.qualified_name, element.name, element.place)


def _name(binding: Binding) -> str:
    return f"{binding.device}.{binding.element}"


def _call(name: str, arguments: Iterable[str]) -> str:
    return f"{name}({', '.join(arguments)})"


def _sensor(binding: Binding, functions: Functions) -> Iterator[str]:
    yield literal(_name(binding))
    for part in ("joints", "sensors", "actuators"):
        if names := getattr(binding, part):
            yield f"{part}={literal(names)}"
    if binding.camera:
        yield f"camera={literal(binding.camera)}"
    if binding.image:
        yield f"image={literal(binding.image)}"
    if binding.through:
        yield f"through={functions.use(binding.through)}"
    if binding.noise:
        yield f"noise={literal(binding.noise)}"
    if binding.depth_noise:
        yield f"depth_noise={literal(binding.depth_noise)}"
    if binding.rate_hz is not None:
        yield f"rate_hz={literal(float(binding.rate_hz))}"
    if binding.sporadic:
        yield "sporadic=True"
    if binding.max_gap_s is not None:
        yield f"max_gap_s={literal(float(binding.max_gap_s))}"


def _contract(binding: Binding, type_: Type, contracts: Contracts) -> Iterator[str]:
    yield f"contract={contracts.of(type_)}"
    yield f"declared={literal(str(type_))}"
    if isinstance(type_, Vector) and type_.size == 1:
        yield "is_vector=True"


def _actuator(binding: Binding, functions: Functions) -> Iterator[str]:
    yield literal(_name(binding))
    if binding.actuators:
        yield f"actuators={literal(binding.actuators)}"
    if binding.joints:
        yield f"joints={literal(binding.joints)}"
    if binding.through:
        yield f"through={functions.use(binding.through)}"


def _ends(system: System, direction: str) -> Iterator[str]:
    """`PlantInput` or `PlantOutput` for every element of a device in some buffer."""
    devices = {device.qualified_name for device in system.devices}
    for subsystem in system.subsystems:
        names = buffer_names(subsystem, direction)
        for port in subsystem.ports:
            if port.direction != direction or port.other_end not in devices:
                continue
            for element in port.elements:
                end = f"{port.other_end}.{element.name}"
                own = literal(subsystem.qualified_name), literal(names[port.peer, element.name])
                if direction == "x":
                    yield f"PlantInput({literal(end)}, {own[0]}, {own[1]})"
                else:
                    yield f"PlantOutput({own[0]}, {own[1]}, {literal(end)})"
