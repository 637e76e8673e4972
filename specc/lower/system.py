"""A whole system: its subsystems, connections, plant and task."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from specc.analysis.ages import Ages
from specc.analysis.rates import base_tick
from specc.frozen import frozen
from specc.lower.ages import ages_plan
from specc.lower.annotations import Annotations, Contracts, PythonTypes, literal_type, named_types
from specc.lower.families import Family, Part, families
from specc.lower.flow import NOTHING_PROVED, Proofs
from specc.lower.layouts import layouts_plan
from specc.lower.module import buffer_names
from specc.lower.names import (
    OWN_NAMES,
    AttributePlan,
    FilePlan,
    Functions,
    Imports,
    NamedPlan,
    Namespace,
    call,
    class_name,
    comment,
    docstring,
    given,
    in_docstring,
    literal,
)
from specc.lower.requirements import CLASS as REQUIREMENTS
from specc.lower.requirements import TRIGGERS, requirements_plan
from specc.lower.ros2 import ros2_arguments
from specc.lower.subsystem import device_plan, scheduled_call, spec_file, subsystem_plan
from specc.lower.task import disturbances, task_arguments
from specc.model.binding import PLANT, Binding
from specc.model.system import Device, Plant, System
from specc.model.types import Enum, Record, Type, Vector
from specc.model.wires import Wires

# Connections between subsystems: which output element becomes which input element.


def connections(system: System) -> Iterator[str]:
    """Calls of `Connection`, by reader, in order of its buffers."""
    wires = Wires(system.agents)
    for reader in system.subsystems:
        inputs = buffer_names(reader.inputs)
        for wire in wires.of(reader):
            port, end = wire.port, wire.end
            if port.direction != "x" or wire.other is None or end is None:
                continue
            outputs = buffer_names(wire.other.outputs)
            for element in port.elements:
                if end.element(element.name):
                    ends = (
                        wire.name,
                        outputs[end.peer, element.name],
                        reader.qualified_name,
                        inputs[port.peer, element.name],
                    )
                    yield f"Connection({', '.join(map(literal, ends))})"


# The plant of a system: bindings of its model, and which buffers they stand behind.


def plant_plan(
    system: System,
    imports: Imports,
    names: Namespace,
    types: PythonTypes,
    safe: tuple[str, ...],
    *,
    stand_ins: bool,
) -> dict[str, object] | None:
    """What stands behind the devices; None if the system has neither a plant nor devices.

    Elements without a binding are there by their names: a plant can still be given to a run.
    `safe` are the classes of the devices with safe outputs.
    """
    if system.plant is None and not system.devices:
        return None
    imports.own("PlantSpec")
    contracts = Contracts(imports, Annotations(imports, types), names.new, stand_ins=stand_ins)
    inputs, outputs = tuple(_ends(system, "x")), tuple(_ends(system, "y"))
    for kind, found in (("PlantInput", inputs), ("PlantOutput", outputs)):
        if found:
            imports.own(kind)
    return {
        **_bound(system, imports, Functions(imports, names), contracts),
        "contracts": contracts.plans,
        "made": _made(system.plant),
        "ros2": tuple(ros2_arguments(system, imports)),
        "inputs": inputs,
        "outputs": outputs,
        "safe": safe,
    }


def _bound(
    system: System, imports: Imports, functions: Functions, contracts: Contracts
) -> dict[str, list[str]]:
    """Calls that make the bindings: of sensors, of what is observed and of actuators."""
    types = {f"{d.qualified_name}.{e.name}": e.type for d in system.devices for e in d.y}
    observed = system.plant.observed if system.plant else ()
    types |= {f"{PLANT}.{e.name}": e.type for e in observed}
    found: dict[str, list[str]] = {"sensors": [], "observed": [], "actuators": []}
    for binding in _bindings(system):
        if type_ := types.get(_name(binding)):
            told = (*_sensor(binding, functions), *_contract(binding, type_, contracts))
            kind = "observed" if binding.device == PLANT else "sensors"
            found[kind].append(call(imports.own("SensorBinding"), told))
        else:
            told = tuple(_actuator(binding, functions))
            found["actuators"].append(call(imports.own("ActuatorBinding"), told))
    return found


def _made(plant: Plant | None) -> str:
    """The argument that says what makes the plant; empty if nothing does, or ROS 2 does."""
    if plant is None or plant.ros2:
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


def _sensor(binding: Binding, functions: Functions) -> Iterator[str]:
    yield literal(_name(binding))
    parts = ("joints", "sensors", "actuators", "camera", "image")
    yield from given({part: getattr(binding, part) for part in parts})
    if binding.through:
        yield f"through={functions.use(binding.through)}"
    yield from given(
        {
            "noise": binding.noise,
            "depth_noise": binding.depth_noise,
            "rate_hz": binding.rate_hz and float(binding.rate_hz),
            "sporadic": binding.sporadic,
            "max_gap_s": binding.max_gap_s and float(binding.max_gap_s),
        }
    )


def _contract(binding: Binding, type_: Type, contracts: Contracts) -> Iterator[str]:
    yield f"contract={contracts.of(type_)}"
    yield f"declared={literal(str(type_))}"
    if isinstance(type_, Vector) and type_.size == 1:
        yield "is_vector=True"


def _actuator(binding: Binding, functions: Functions) -> Iterator[str]:
    yield literal(_name(binding))
    yield from given({"actuators": binding.actuators, "joints": binding.joints})
    if binding.through:
        yield f"through={functions.use(binding.through)}"


def _ends(system: System, direction: str) -> Iterator[str]:
    """`PlantInput` or `PlantOutput` for every element of a device in some buffer."""
    wires = Wires(system.agents)
    for subsystem in system.subsystems:
        names = buffer_names(subsystem.inputs if direction == "x" else subsystem.outputs)
        for wire in wires.of(subsystem):
            port = wire.port
            if port.direction != direction or wire.device is None:
                continue
            for element in port.elements:
                end = f"{wire.name}.{element.name}"
                own = literal(subsystem.qualified_name), literal(names[port.peer, element.name])
                if direction == "x":
                    yield f"PlantInput({literal(end)}, {own[0]}, {own[1]})"
                else:
                    yield f"PlantOutput({own[0]}, {own[1]}, {literal(end)})"


# The whole system to its plans: packages, types, subsystems, and what connects them.


def lower(
    system: System,
    proofs: Proofs | None,
    ages: Ages | None = None,
    *,
    stand_ins: bool = False,
) -> dict[str, FilePlan]:
    """What the generated package of a system contains: path in the package -> plan.

    `proofs` says which transition tables need no check while they run; without it all have one.
    `ages` says what values are computed from, where somebody asks how old they are. `stand_ins` is
    for code whose operators and devices are played by a test: images and values of classes can be
    anything.
    """
    types = PythonTypes(named_types(system))
    title = in_docstring(system.title or system.name)
    tests_all_rows, proofs = proofs is None, proofs or NOTHING_PROVED
    found = [
        *families(system, system.subsystems, proofs, types),
        *families(system, [d for d in system.devices if d.safe], proofs, types),
    ]
    if stand_ins:
        found = [Family((part,)) for family in found for part in family.members]
    known = {part.qualified_name: family for family in found for part in family.members}
    classes = _classes(found, types)
    modules = _modules(found)
    spec = in_docstring(spec_file(system))
    files = {"__init__.py": FilePlan("package.py.j2", {"title": title, "spec": spec})}
    if types.declared:
        files["types.py"] = _types(system, types, title)
    for family in found:
        part, name = family.first, family.first.qualified_name
        if isinstance(part, Device):
            plan = device_plan(system, part, family, types, classes[name], stand_ins=stand_ins)
        else:
            plan = subsystem_plan(
                system, part, family, proofs, types, classes[name], stand_ins=stand_ins
            )
        files[f"{modules[name]}.py"] = plan
    if not stand_ins:
        files["layouts.py"] = layouts_plan(system, types, title, spec)
    if system.requirements and not stand_ins:
        tick = base_tick(1 / s.rate_hz for s in system.subsystems)
        files["requirements.py"] = requirements_plan(system, types, tick, title, spec)
    if system.triggers and not stand_ins:
        tick = base_tick(1 / s.rate_hz for s in system.subsystems)
        files["triggers.py"] = requirements_plan(system, types, tick, title, spec, triggers=True)
    made = Made(known, classes, modules)
    files["system.py"] = _whole(
        system, title, types, made, ages, stand_ins=stand_ins, tests_all_rows=tests_all_rows
    )
    return files


@frozen
class Made:
    """Of each part, by its qualified name: its family, class and module."""

    families: Mapping[str, Family]
    classes: Mapping[str, str]
    modules: Mapping[str, str]

    def call(self, part: Part, imports: Imports) -> str:
        """The call that makes a part."""
        name = part.qualified_name
        for module, needed in self.families[name].imports:
            imports.add(module, needed)
        imports.add(f".{self.modules[name]}", self.classes[name])
        return self.families[name].made(part, self.classes[name])


def _classes(found: list[Family], types: PythonTypes) -> dict[str, str]:
    """Class of every part, after its agent and itself; titles may be reworded."""
    names = Namespace((*OWN_NAMES, *types.of.values()))
    return _each(found, lambda family: names.new(class_name(" ".join(_words(family)))))


def _modules(found: list[Family]) -> dict[str, str]:
    names = Namespace(("system", "types", "layouts", "requirements", "triggers", "__init__"))

    def module(family: Family) -> str:
        name = "_".join(_words(family))
        return names.new(name.lower() if isinstance(family.first, Device) else name)

    return _each(found, module)


def _words(family: Family) -> tuple[str, ...]:
    agent, name = family.stem
    if isinstance(family.first, Device):
        letter = family.first.qualified_name.split(".")[1]
        return agent, letter, name
    return agent, name


def _each(found: list[Family], of: Callable[[Family], str]) -> dict[str, str]:
    """Something of the family of each part, made once for the family."""
    made = [(family, of(family)) for family in found]
    return {part.qualified_name: one for family, one in made for part in family.members}


def _types(system: System, types: PythonTypes, title: str) -> FilePlan:
    """The module of enums and records."""
    imports = Imports()
    annotations = Annotations(imports, types, own_module="")
    traces = {named.name: named.trace for named in system.types}
    literals, records = [], []
    for name, type_ in types.declared:
        if isinstance(type_, Enum):
            imports.own("Literal")
            literals.append(NamedPlan(name, literal_type(type_)))
        elif isinstance(type_, Record):
            imports.own("dataclass")
            said = docstring(f"Record {type_.name}", str(traces.get(type_.name) or ""))
            records.append((name, said, _fields(type_, annotations)))
    parts = {
        "title": title,
        "spec": in_docstring(spec_file(system)),
        "imports": imports.lines,
        "literals": literals,
        "records": records,
    }
    return FilePlan("types.py.j2", parts)


def _fields(record: Record, annotations: Annotations) -> tuple[AttributePlan, ...]:
    return tuple(
        AttributePlan(name, annotations.of(type_), comment(str(type_)))
        for name, type_ in record.fields
    )


def _whole(
    system: System,
    title: str,
    types: PythonTypes,
    made: Made,
    ages: Ages | None,
    *,
    stand_ins: bool,
    tests_all_rows: bool,
) -> FilePlan:
    imports = Imports()
    imports.own("Scheduled")
    imports.own("System")
    tick = base_tick(1 / s.rate_hz for s in system.subsystems)
    connected = tuple(connections(system))
    if connected:
        imports.own("Connection")
    safe = [device for device in system.devices if device.safe]
    names = Namespace((*OWN_NAMES, *types.of.values(), *made.classes.values()))
    owners = tuple(made.call(device, imports) for device in safe)
    plant = plant_plan(system, imports, names, types, owners, stand_ins=stand_ins)
    if system.files:
        imports.own("join")
    aged = ages_plan(system, ages, imports) if ages else {}
    judged = _judged(system, imports, stand_ins=stand_ins)
    scheduled = tuple(scheduled_call(s, made.call(s, imports), tick) for s in system.subsystems)
    parts = {
        "title": title,
        "spec": in_docstring(spec_file(system)),
        "spec_literal": literal(spec_file(system)),
        "imports": imports.lines,
        "name": literal(system.name),
        "tick_s": literal(float(tick)),
        "files": tuple((literal(name), literal(path)) for name, path in system.files),
        "subsystems": scheduled,
        "connections": connected,
        "plant": plant,
        "tests_all_rows": tests_all_rows,
        "ages": aged,
        **judged,
    }
    return FilePlan("system.py.j2", parts)


def _judged(system: System, imports: Imports, *, stand_ins: bool) -> dict[str, object]:
    """What a run counts, what happens meanwhile and what it is watched for.

    Stand-ins only begin and count.
    """
    parts: dict[str, object] = {"task": (), "disturbances": (), "requirements": "", "triggers": ""}
    task = system.task
    if task:
        imports.own("Task")
        parts["task"] = tuple(task_arguments(system, task))
    disturbed = task.disturbances if task and not stand_ins else ()
    if task and (task.starts or any(each.numbers for each in disturbed)):
        imports.own("Draw")
    if task and disturbed:
        imports.own("Disturbance")
        parts["disturbances"] = tuple(disturbances(task))
    if system.requirements and not stand_ins:
        parts["requirements"] = imports.own(REQUIREMENTS)
    if system.triggers and not stand_ins:
        parts["triggers"] = imports.own(TRIGGERS)
        if system.stop_when:
            parts["stop_when"] = len(system.triggers) - 1
    return parts
