"""A whole system: its subsystems, connections, plant and task."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import PurePath

from specc.analysis.dataflow import Ages
from specc.analysis.plant import bindable
from specc.analysis.rates import base_tick
from specc.lower.ages import ages_plan
from specc.lower.annotations import Annotations, Contracts, PythonTypes, literal_type, named_types
from specc.lower.families import Family, families
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
from specc.lower.requirements import requirements_plan
from specc.lower.ros2 import ros2_arguments
from specc.lower.subsystem import device_plan, subsystem_plan
from specc.lower.task import run_parts
from specc.model.binding import PLANT, Binding
from specc.model.system import Device, Plant, Subsystem, System
from specc.model.types import Enum, Pose, Record, Type, Vector
from specc.model.wires import Wires

# Connections between subsystems: which output element becomes which input element.


def _connections(system: System, imports: Imports) -> Iterator[str]:
    """Calls of `Connection`, by reader, in order of its buffers."""
    wires = Wires(system.agents)
    sent = {s.qualified_name: buffer_names(s.outputs) for s in system.subsystems}
    for reader in system.subsystems:
        inputs = buffer_names(reader.inputs)
        for wire in wires.of(reader):
            port, end = wire.port, wire.end
            if port.direction != "x" or wire.other is None or end is None:
                continue
            outputs = sent[wire.other.qualified_name]
            for element in port.elements:
                if end.element(element.name):
                    ends = (
                        wire.name,
                        outputs[end.peer, element.name],
                        reader.qualified_name,
                        inputs[port.peer, element.name],
                    )
                    yield call(imports.own("Connection"), map(literal, ends))


# The plant of a system: bindings of its model, and which buffers they stand behind.


def _plant(
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
    return {
        **_bound(system, imports, Functions(imports, names), contracts),
        "contracts": contracts.plans,
        "made": _made(system.plant),
        "ros2": tuple(ros2_arguments(system, imports)),
        "inputs": tuple(_ends(system, "x", imports)),
        "outputs": tuple(_ends(system, "y", imports)),
        "safe": safe,
    }


def _bound(
    system: System, imports: Imports, functions: Functions, contracts: Contracts
) -> dict[str, list[str]]:
    """Calls that make the bindings: of sensors, of what is observed and of actuators."""
    every = bindable(system)
    types = {(device, e.name): e.type for device, e, commanded in every if not commanded}
    found: dict[str, list[str]] = {"sensors": [], "observed": [], "actuators": []}
    for binding in _bindings(system):
        if type_ := types.get((binding.device, binding.element)):
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
    bound = {(binding.device, binding.element) for binding in bindings}
    for device, element, _ in bindable(system):
        if device != PLANT and (device, element.name) not in bound:
            yield Binding(device, element.name, element.place)


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
    if isinstance(type_, Pose) and not binding.through and (binding.sensors or binding.joints):
        yield "is_pose=True"


def _actuator(binding: Binding, functions: Functions) -> Iterator[str]:
    yield literal(_name(binding))
    yield from given({"actuators": binding.actuators, "joints": binding.joints})
    if binding.through:
        yield f"through={functions.use(binding.through)}"


def _ends(system: System, direction: str, imports: Imports) -> Iterator[str]:
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
                own = subsystem.qualified_name, names[port.peer, element.name]
                if direction == "x":
                    yield call(imports.own("PlantInput"), map(literal, (end, *own)))
                else:
                    yield call(imports.own("PlantOutput"), map(literal, (*own, end)))


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
    families_ = _families(system, proofs or NOTHING_PROVED, types, stand_ins=stand_ins)
    made = tuple(_named(families_, types))
    files = {"__init__.py": FilePlan("package.py.j2", {})}
    if types.declared:
        files["types.py"] = _types(system, types)
    for each in made:
        files[f"{each.module}.py"] = _part_plan(system, each, proofs, types, stand_ins=stand_ins)
    tick_s = base_tick(1 / s.rate_hz for s in system.subsystems)
    if not stand_ins:
        files["layouts.py"] = layouts_plan(system, types)
        if system.requirements:
            files["requirements.py"] = requirements_plan(system, types, tick_s, triggers=False)
        if system.triggers:
            files["triggers.py"] = requirements_plan(system, types, tick_s, triggers=True)
    files["system.py"] = _whole(
        system, tick_s, types, made, ages, stand_ins=stand_ins, tests_all_rows=proofs is None
    )
    spec = PurePath(system.file).name  # without the directories of some machine
    said = {"title": in_docstring(system.title or system.name), "spec": in_docstring(spec)}
    return {path: FilePlan(f.template, {**said, **f.parts}) for path, f in files.items()}


def _families(
    system: System, proofs: Proofs, types: PythonTypes, *, stand_ins: bool
) -> Iterator[Family]:
    """The parts that become modules; each stand-in has one of its own."""
    parts: list[Subsystem | Device] = [*system.subsystems, *(d for d in system.devices if d.safe)]
    if stand_ins:
        yield from (Family((part,)) for part in parts)
    else:
        yield from families(system, parts, proofs, types)


@dataclass(frozen=True, slots=True)
class Made:
    """A family with the class and the module that it becomes."""

    family: Family
    class_name: str
    module: str

    def call(self, part: Subsystem | Device, imports: Imports) -> str:
        """The call that makes a part."""
        for module, needed in self.family.imports:
            imports.add(module, needed)
        imports.add(f".{self.module}", self.class_name)
        return self.family.made(part, self.class_name)


def _named(found: Iterable[Family], types: PythonTypes) -> Iterator[Made]:
    """Families with names after agents and parts; titles may be reworded."""
    classes = Namespace((*OWN_NAMES, *types.of.values()))
    modules = Namespace(("system", "types", "layouts", "requirements", "triggers", "__init__"))
    for family in found:
        agent, name = family.stem
        words, module = f"{agent} {name}", f"{agent}_{name}"
        if isinstance(family.first, Device):
            letter = family.first.qualified_name.split(".")[1]
            words, module = f"{agent} {letter} {name}", f"{agent}_{letter}_{name}".lower()
        yield Made(family, classes.new(class_name(words)), modules.new(module))


def _part_plan(
    system: System, made: Made, proofs: Proofs | None, types: PythonTypes, *, stand_ins: bool
) -> FilePlan:
    part, name = made.family.first, made.class_name
    if isinstance(part, Device):
        return device_plan(system, part, made.family, types, name, stand_ins=stand_ins)
    known = proofs or NOTHING_PROVED
    return subsystem_plan(system, part, made.family, known, types, name, stand_ins=stand_ins)


def _types(system: System, types: PythonTypes) -> FilePlan:
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
    tick_s: Fraction,
    types: PythonTypes,
    made: Sequence[Made],
    ages: Ages | None,
    *,
    stand_ins: bool,
    tests_all_rows: bool,
) -> FilePlan:
    imports = Imports()
    imports.own("System")
    of = {part.qualified_name: each for each in made for part in each.family.members}
    names = Namespace((*OWN_NAMES, *types.of.values(), *(each.class_name for each in made)))
    safe = tuple(of[d.qualified_name].call(d, imports) for d in system.devices if d.safe)
    plant = _plant(system, imports, names, types, safe, stand_ins=stand_ins)
    if system.files:
        imports.own("join")
    scheduled = (
        _scheduled(s, of[s.qualified_name].call(s, imports), tick_s, imports)
        for s in system.subsystems
    )
    parts = {
        "spec_literal": literal(PurePath(system.file).name),
        "name": literal(system.name),
        "tick_s": literal(float(tick_s)),
        "files": tuple((literal(name), literal(path)) for name, path in system.files),
        "subsystems": tuple(scheduled),
        "connections": tuple(_connections(system, imports)),
        "plant": plant,
        "tests_all_rows": tests_all_rows,
        "ages": ages_plan(system, ages, imports) if ages else {},
        **run_parts(system, imports, stand_ins=stand_ins),
        "imports": imports.lines,  # when all of the others have asked for theirs
    }
    return FilePlan("system.py.j2", parts)


def _scheduled(subsystem: Subsystem, made: str, tick_s: Fraction, imports: Imports) -> str:
    """The call of `Scheduled` for the expression that makes a subsystem."""
    arguments = [made, f"ticks={int(1 / subsystem.rate_hz / tick_s)}"]
    if subsystem.budget_s is not None:
        arguments.append(f"budget_s={literal(float(subsystem.budget_s))}")
    return call(imports.own("Scheduled"), arguments)
