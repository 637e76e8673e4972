"""The plant of a system: bindings of its model, and which buffers they stand behind."""

from __future__ import annotations

from collections.abc import Iterator

from specc.lower.imports import Imports
from specc.lower.module import buffer_names
from specc.lower.names import Names
from specc.lower.plan import PlantPlan
from specc.lower.text import literal
from specc.model.system import Binding, System

RUNTIME = "specc_runtime.system"
BINDINGS = "specc_runtime.plants.binding"


def plant_plan(system: System, imports: Imports, names: Names) -> PlantPlan | None:
    """What stands behind the devices; None if the system has no plant."""
    if system.plant is None:
        return None
    imports.add(RUNTIME, "PlantSpec")
    functions = _Functions(imports, names)
    reported = {(d.qualified_name, e.name) for d in system.devices for e in d.y}
    sensors, actuators = [], []
    for binding in system.plant.bindings:
        if (binding.device, binding.element) in reported:
            imports.add(BINDINGS, "SensorBinding")
            sensors.append(_call("SensorBinding", _sensor(binding, functions)))
        else:
            imports.add(BINDINGS, "ActuatorBinding")
            actuators.append(_call("ActuatorBinding", _actuator(binding, functions)))
    bound = {_name(b) for b in system.plant.bindings}
    inputs = tuple(_ends(system, "x", bound))
    outputs = tuple(_ends(system, "y", bound))
    for kind, found in (("PlantInput", inputs), ("PlantOutput", outputs)):
        if found:
            imports.add(RUNTIME, kind)
    model = literal(system.plant.model)
    return PlantPlan(model, tuple(sensors), tuple(actuators), inputs, outputs)


class _Functions:
    """Imports the functions of `through`; two of one name from two modules get two names."""

    def __init__(self, imports: Imports, names: Names) -> None:
        self._imports = imports
        self._names = names
        self._known: dict[str, str] = {}

    def use(self, python: str) -> str:
        if python not in self._known:
            module, _, name = python.partition(":")
            self._known[python] = self._imports.add(module, name, self._names.new(name))
        return self._known[python]


def _name(binding: Binding) -> str:
    return f"{binding.device}.{binding.element}"


def _call(name: str, arguments: Iterator[str]) -> str:
    return f"{name}({', '.join(arguments)})"


def _sensor(binding: Binding, functions: _Functions) -> Iterator[str]:
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


def _actuator(binding: Binding, functions: _Functions) -> Iterator[str]:
    yield literal(_name(binding))
    yield f"actuators={literal(binding.actuators)}"
    if binding.joints:
        yield f"joints={literal(binding.joints)}"
    if binding.through:
        yield f"through={functions.use(binding.through)}"


def _ends(system: System, direction: str, bound: set[str]) -> Iterator[str]:
    """`PlantInput` or `PlantOutput` for every bound element of a device in some buffer."""
    devices = {device.qualified_name for device in system.devices}
    for subsystem in system.subsystems:
        names = buffer_names(subsystem, direction)
        for port in subsystem.ports:
            if port.direction != direction or port.other_end not in devices:
                continue
            for element in port.elements:
                end = f"{port.other_end}.{element.name}"
                own = literal(subsystem.qualified_name), literal(names[port.peer, element.name])
                if end in bound and direction == "x":
                    yield f"PlantInput({literal(end)}, {own[0]}, {own[1]})"
                elif end in bound:
                    yield f"PlantOutput({own[0]}, {own[1]}, {literal(end)})"
