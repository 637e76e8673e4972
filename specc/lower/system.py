"""A whole system: its subsystems, connections, plant, topics of ROS 2 and task."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from pathlib import PurePath
from typing import Any

from specc.analysis.dataflow import Ages
from specc.analysis.plant import BoundElement, bindable, bound_elements
from specc.analysis.rates import base_tick
from specc.analysis.ros2 import (
    MessageTypeMismatch,
    frames_of,
    part_of,
    published_value,
)
from specc.analysis.ros2_messages import short_message_type
from specc.lang import Environment, evaluate
from specc.lang.kinds import kind
from specc.lower.families import Family, families
from specc.lower.flow import NOTHING_PROVED, Proofs
from specc.lower.module import (
    Annotations,
    Contracts,
    PythonTypes,
    buffer_names,
    layouts_plan,
    literal_type,
    live_slots,
    memory_names,
    named_types,
)
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
    in_docstring,
    keyword_arguments,
    literal,
)
from specc.lower.nodes import number
from specc.lower.requirements import REQUIREMENTS, TRIGGERS, ages_plan, requirements_plan
from specc.lower.subsystem import device_plan, subsystem_plan
from specc.model.bindings import DIAGNOSTICS, PLANT, Binding, Published, Ros2
from specc.model.system import Device, Element, Subsystem, System
from specc.model.task import VERBS, DisturbanceAction, Draw, Task, Verb
from specc.model.types import Enum, OptionalOf, Pose, Real, Record, Type, Vector
from specc.model.units import DIMENSIONLESS
from specc.model.wires import Wires

_TF = "tf2_msgs/TFMessage"


def ros2_arguments(system: System, imports: Imports) -> Iterator[str]:
    """Arguments of the node and its topics; none if there is no plant behind ROS 2."""
    if system.plant is None or system.plant.ros2 is None:
        return
    ros2 = system.plant.ros2
    imports.runtime_name("Ros2")
    yield literal(ros2.node)
    options = {"wait_s": float(ros2.wait_s), "use_sim_time": ros2.use_sim_time}
    yield from keyword_arguments({"python": ros2.python, **options})
    behind = [bound for bound in bound_elements(system) if bound.plant == "ros2"]
    topics = [_topic(bound, ros2, imports) for bound in behind]
    yield f"topics=({''.join(f'{topic}, ' for topic in topics if topic)})"
    published = [_published(each, system, ros2, imports) for each in system.plant.published]
    if any(published):
        yield f"published=({''.join(f'{each}, ' for each in published if each)})"
    if any(each.name == DIAGNOSTICS for each in system.plant.published):
        yield "diagnostics=True"


def _published(each: Published, system: System, ros2: Ros2, imports: Imports) -> str:
    """The call for what others can watch; empty for a name that stands for nothing."""
    found = published_value(each, system)
    if isinstance(found, MessageTypeMismatch):
        return ""
    subsystem, known = found.subsystem, dict(ros2.frames)
    output = buffer_names(subsystem.outputs)[found.peer, found.element] if found.peer else ""
    frames = [(at, known.get(f, f)) for at, f in frames_of(found.part, found.type) if at and f]
    options = keyword_arguments(
        {"path": found.part.path, "commanded": True, "frames": tuple(frames)}
    )
    first = (found.name, found.topic, found.message, found.part.shape)
    topic = call(imports.runtime_name("Ros2Topic"), (*map(literal, first), *options))
    own = literal(subsystem.qualified_name), literal(output)
    return call(imports.runtime_name("Ros2Published"), (*own, topic))


def _topic(bound: BoundElement, ros2: Ros2, imports: Imports) -> str:
    """The call that makes a topic; empty for a binding that has none."""
    binding, type_ = bound.binding, bound.element.type
    numbers = type_.value if isinstance(type_, OptionalOf) else type_
    part = part_of(binding, type_, commanded=bound.is_commanded)
    interface, called = binding.call
    where = binding.topic or called or ("/tf" if binding.tf else "")
    if not where or isinstance(part, MessageTypeMismatch):
        return ""
    known = dict(ros2.frames)
    frames = tuple((at, known[f]) for at, f in frames_of(part, type_) if at and f in known)
    options = {
        "path": part.path,
        "commanded": bound.is_commanded,
        "joints": binding.joints,
        "frames": () if binding.tf else frames,
        "between": tuple(name for _, name in frames) if binding.tf else (),
        "qos": binding.qos,
        "interface": interface,
        "part": binding.part,
        "when_busy": binding.when_busy,
        "answer_within_s": binding.answer_within_s and float(binding.answer_within_s),
        "is_number": part.shape == "joints" and isinstance(numbers, Real),
    }
    first = (
        f"{binding.device}.{binding.element}",
        where,
        short_message_type(binding.message) or _TF,
        part.shape,
    )
    return call(
        imports.runtime_name("Ros2Topic"), (*map(literal, first), *keyword_arguments(options))
    )


def run_parts(system: System, imports: Imports, *, stand_ins: bool) -> dict[str, object]:
    """What a run counts, what happens meanwhile and what it is watched for.

    Stand-ins only begin and count.
    """
    parts: dict[str, object] = {"task": (), "disturbances": (), "requirements": "", "triggers": ""}
    if system.task:
        imports.runtime_name("Task")
        parts["task"] = tuple(_task_arguments(system, system.task, imports))
    if stand_ins:
        return parts
    if system.task:
        parts["disturbances"] = tuple(_disturbances(system.task, imports))
    if system.run_requirements:
        parts["requirements"] = imports.runtime_name(REQUIREMENTS)
    if system.triggers:
        parts["triggers"] = imports.runtime_name(TRIGGERS)
        if system.stop_when:
            parts["stop_when"] = len(system.triggers) - 1
    return parts


def _task_arguments(system: System, task: Task, imports: Imports) -> Iterator[str]:
    """Arguments of `Task`, but for the disturbances."""
    names = ("subsystem", "source", "target", "scene", "judge")
    subsystem = next((s for s in system.subsystems if s.qualified_name == task.subsystem), None)
    memory = memory_names(subsystem) if subsystem else {}
    watched = tuple(memory[name] for name in task.watch if name in memory)
    yield from keyword_arguments({name: getattr(task, name) for name in names} | {"watch": watched})
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
            actions = (action for action in each.actions if action.verb == verb.name)
            items = " ".join(_action(verb, action, imports) for action in actions)
            arguments += [f"{verb.name}=({items})"] if items else []
        yield call(imports.runtime_name("Disturbance"), arguments)


def _action(verb: Verb, action: DisturbanceAction, imports: Imports) -> str:
    """An item of a tuple: a name, a number, which has one, or a name with its numbers."""
    if verb.numbers in ("none", "one"):
        return _draws(action.numbers, imports) or f"{literal(action.name)},"
    return f"({literal(action.name)}, ({_draws(action.numbers, imports)})),"


def _draws(draws: Iterable[Draw], imports: Imports) -> str:
    """Items of a tuple."""
    return " ".join(f"{_draw(draw, imports)}," for draw in draws)


def _draw(draw: Draw, imports: Imports) -> str:
    first = literal(draw.name), literal(tuple(value for value, _ in draw.values))
    return call(
        imports.runtime_name("Draw"), (*first, *keyword_arguments({"between": draw.is_range}))
    )


# Connections between subsystems: which output element becomes which input element.


def _connections(system: System, imports: Imports) -> Iterator[str]:
    """Calls of `Connection`, by reader, in order of its buffers."""
    wires = Wires(system.agents)
    sent = {s.qualified_name: buffer_names(s.outputs) for s in system.subsystems}
    for reader in system.subsystems:
        inputs = buffer_names(reader.inputs)
        for wire in wires.wires_of(reader):
            port, end = wire.port, wire.peer_port
            if port.direction != "x" or wire.peer_subsystem is None or end is None:
                continue
            outputs = sent[wire.peer_subsystem.qualified_name]
            for element in port.elements:
                if end.element(element.name):
                    ends = (
                        wire.peer_name,
                        outputs[end.peer, element.name],
                        reader.qualified_name,
                        inputs[port.peer, element.name],
                    )
                    yield call(imports.runtime_name("Connection"), map(literal, ends))


def _live_constants(system: System, imports: Imports) -> Iterator[str]:
    """Calls of `LiveConstant`."""
    changing = [constant for constant in system.constants if constant.initial is not None]
    slots = {s.qualified_name: live_slots(system, s) for s in system.subsystems if changing}
    for constant in changing:
        assert constant.initial is not None  # it may change
        name, type_ = constant.name, constant.value.type
        values = (constant.initial.value, *(constant.bounds or ()))
        numbers = [number(value, type_).text for value in values]
        readers = [(owner, own[name].attribute) for owner, own in slots.items() if name in own]
        unit = str(type_.unit) if isinstance(type_, Real) and type_.unit != DIMENSIONLESS else ""
        arguments = (
            literal(name),
            *numbers,
            *keyword_arguments({"unit": unit, "readers": tuple(readers), "title": constant.title}),
        )
        yield call(imports.runtime_name("LiveConstant"), arguments)


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
    imports.runtime_name("PlantSpec")
    contracts = Contracts(imports, Annotations(imports, types), names.new, stand_ins=stand_ins)
    plant, made = system.plant, ""
    if plant and (plant.model or plant.python):
        made = (
            f"python={literal(plant.python)}" if plant.python else f"model={literal(plant.model)}"
        )
    functions = Functions(imports, names)
    return {
        **_bindings_by_kind(system, imports, functions, contracts, stand_ins=stand_ins),
        "contracts": contracts.plans,
        "made": made,
        "ros2": tuple(ros2_arguments(system, imports)),
        "inputs": tuple(_plant_ends(system, "x", imports)),
        "outputs": tuple(_plant_ends(system, "y", imports)),
        "safe": safe,
    }


def _bindings_by_kind(
    system: System,
    imports: Imports,
    functions: Functions,
    contracts: Contracts,
    *,
    stand_ins: bool,
) -> dict[str, list[str]]:
    """Calls that make the bindings: of sensors, of what is observed and of actuators."""
    every = bindable(system)
    elements = {(device, e.name): e for device, e, commanded in every if not commanded}
    found: dict[str, list[str]] = {"sensors": [], "observed": [], "actuators": []}
    for binding in _all_bindings(system):
        if element := elements.get((binding.device, binding.element)):
            arguments = (
                *_sensor(binding, functions),
                *_contract_arguments(binding, element.type, contracts),
                *(() if stand_ins else _panel_argument(binding, element, imports)),
            )
            for key in ("initial", "on_loss"):
                if (given := getattr(binding, key)) is not None:
                    value = _value(element.type, given.value, imports)
                    arguments = (*arguments, f"{key}=({value},)")
            kind = "observed" if binding.device == PLANT else "sensors"
            found[kind].append(call(imports.runtime_name("SensorBinding"), arguments))
        else:
            arguments = (
                literal(f"{binding.device}.{binding.element}"),
                *keyword_arguments({"actuators": binding.actuators, "joints": binding.joints}),
                *_through_argument(binding, functions),
            )
            found["actuators"].append(call(imports.runtime_name("ActuatorBinding"), arguments))
    return found


def _all_bindings(system: System) -> Iterator[Binding]:
    """Those of the plant, then of all other elements of devices."""
    bindings = system.plant.bindings if system.plant else ()
    yield from bindings
    bound = {(binding.device, binding.element) for binding in bindings}
    for device, element, _ in bindable(system):
        if device != PLANT and (device, element.name) not in bound:
            yield Binding(device, element.name, element.place)


def _through_argument(binding: Binding, functions: Functions) -> Iterator[str]:
    if binding.through:
        yield f"through={functions.use(binding.through)}"


def _sensor(binding: Binding, functions: Functions) -> Iterator[str]:
    yield literal(f"{binding.device}.{binding.element}")
    parts = ("joints", "sensors", "actuators", "camera", "image")
    yield from keyword_arguments({part: getattr(binding, part) for part in parts})
    yield from _through_argument(binding, functions)
    yield from keyword_arguments(
        {
            "noise": binding.noise,
            "depth_noise": binding.depth_noise,
            "rate_hz": binding.rate_hz and float(binding.rate_hz),
            "sporadic": binding.sporadic,
            "max_gap_s": binding.max_gap_s and float(binding.max_gap_s),
        }
    )


def _contract_arguments(binding: Binding, type_: Type, contracts: Contracts) -> Iterator[str]:
    yield f"contract={contracts.of(type_)}"
    yield f"declared={literal(str(type_))}"
    if isinstance(type_, Vector) and type_.size == 1:
        yield "is_vector=True"
    if isinstance(type_, Pose) and not binding.through and (binding.sensors or binding.joints):
        yield "is_pose=True"


def _panel_argument(binding: Binding, element: Element, imports: Imports) -> Iterator[str]:
    """The call for what of the operator's panel sets an element, if it is on it."""
    panel, type_ = binding.panel, element.type
    if panel is None or panel.initial is None:
        return
    unit = type_.unit if isinstance(type_, Real) else DIMENSIONLESS
    ends = zip(("least", "greatest"), panel.bounds or (), strict=False)
    options = {
        "choices": type_.members if isinstance(type_, Enum) else (),
        "hold": panel.hold,
        "key": panel.key,
        "unit": "" if unit == DIMENSIONLESS else str(unit),
        "title": " ".join(element.title.split()),
    }
    arguments = (
        literal(binding.name),
        literal(panel.kind),
        literal(evaluate(panel.initial, Environment())),
        *(f"{name}={literal(end.value)}" for name, end in ends),
        *keyword_arguments(options),
    )
    yield f"panel={call(imports.runtime_name('PanelElement'), arguments)}"


class _PartText(str):
    """Python for a part of a value."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def _value(type_: Type, value: Any, imports: Imports) -> str:
    """Python for a value, as `specc.lang.evaluate` has it; a contract looks at it afterwards.

    It is that of an expression without operators, of which nobody makes records.
    """
    if value is not None and (type_.is_array or isinstance(type_, Pose)):
        numbers = chain.from_iterable(value) if isinstance(type_, Pose) else value
        vector = call(imports.runtime_name("vector"), (number(n, Real()).text for n in numbers))
        return f"{vector}.reshape(4, 4)" if isinstance(type_, Pose) else vector
    parts = kind(type_).map_parts(type_, value, lambda t, part: _PartText(_value(t, part, imports)))
    return literal(parts)


def _plant_ends(system: System, direction: str, imports: Imports) -> Iterator[str]:
    """`PlantInput` or `PlantOutput` for every element of a device in some buffer."""
    wires = Wires(system.agents)
    for subsystem in system.subsystems:
        names = buffer_names(subsystem.inputs if direction == "x" else subsystem.outputs)
        for wire in wires.wires_of(subsystem):
            port = wire.port
            if port.direction != direction or wire.peer_device is None:
                continue
            for element in port.elements:
                end = f"{wire.peer_name}.{element.name}"
                own = subsystem.qualified_name, names[port.peer, element.name]
                if direction == "x":
                    yield call(imports.runtime_name("PlantInput"), map(literal, (end, *own)))
                else:
                    yield call(imports.runtime_name("PlantOutput"), map(literal, (*own, end)))


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
    known = proofs or NOTHING_PROVED
    parts: list[Subsystem | Device] = [*system.subsystems, *(d for d in system.devices if d.safe)]
    each_alone = (Family((part,)) for part in parts)
    shared = each_alone if stand_ins else families(system, parts, known, types)
    families_lowered = tuple(_name_families(shared, types))
    files = {"__init__.py": FilePlan("package.py.j2", {})}
    if types.declared:
        files["types.py"] = _types(system, types)
    for each in families_lowered:
        part, place = each.family.first, f"{each.module}.py"
        own = each.family, types, each.class_name
        if isinstance(part, Device):
            files[place] = device_plan(system, part, *own, stand_ins=stand_ins)
        else:
            files[place] = subsystem_plan(system, part, *own, known, stand_ins=stand_ins)
    tick_s = base_tick(1 / s.rate_hz for s in system.subsystems)
    if not stand_ins:
        files["layouts.py"] = layouts_plan(system, types)
        if system.run_requirements:
            files["requirements.py"] = requirements_plan(system, types, tick_s, triggers=False)
        if system.triggers:
            files["triggers.py"] = requirements_plan(system, types, tick_s, triggers=True)
    files["system.py"] = _system_plan(
        system,
        tick_s,
        types,
        families_lowered,
        ages,
        stand_ins=stand_ins,
        tests_all_rows=proofs is None,
    )
    spec = PurePath(system.file).name  # without the directories of some machine
    texts = {"title": in_docstring(system.title or system.name), "spec": in_docstring(spec)}
    return {path: FilePlan(f.template, {**texts, **f.parts}) for path, f in files.items()}


@dataclass(frozen=True, slots=True)
class LoweredFamily:
    """A family with the class and the module that it becomes."""

    family: Family
    class_name: str
    module: str

    def call(self, part: Subsystem | Device, imports: Imports) -> str:
        """The call that makes a part."""
        for module, needed in self.family.imports:
            imports.add(module, needed)
        imports.add(f".{self.module}", self.class_name)
        return self.family.constructor_call(part, self.class_name)


def _name_families(found: Iterable[Family], types: PythonTypes) -> Iterator[LoweredFamily]:
    """Families with names after agents and parts; titles may be reworded."""
    classes = Namespace((*OWN_NAMES, *types.names.values()))
    modules = Namespace(("system", "types", "layouts", "requirements", "triggers", "__init__"))
    for family in found:
        agent, name = family.common_name
        words, module = f"{agent} {name}", f"{agent}_{name}"
        if isinstance(family.first, Device):
            letter = family.first.qualified_name.split(".")[1]
            words, module = f"{agent} {letter} {name}", f"{agent}_{letter}_{name}".lower()
        yield LoweredFamily(family, classes.new(class_name(words)), modules.new(module))


def _types(system: System, types: PythonTypes) -> FilePlan:
    """The module of enums and records."""
    imports = Imports()
    annotations = Annotations(imports, types, own_module="")
    traces = {named.name: named.trace for named in system.types}
    literals, records = [], []
    for name, type_ in types.declared:
        if isinstance(type_, Enum):
            imports.runtime_name("Literal")
            literals.append(NamedPlan(name, literal_type(type_)))
        elif isinstance(type_, Record):
            imports.runtime_name("dataclass")
            doc = docstring(f"Record {type_.name}", str(traces.get(type_.name) or ""))
            fields = tuple(
                AttributePlan(field, annotations.of(of), comment(str(of)))
                for field, of in type_.fields
            )
            records.append((name, doc, fields))
    parts = {
        "imports": imports.lines,
        "literals": literals,
        "records": records,
    }
    return FilePlan("types.py.j2", parts)


def _system_plan(
    system: System,
    tick_s: Fraction,
    types: PythonTypes,
    lowered: Sequence[LoweredFamily],
    ages: Ages | None,
    *,
    stand_ins: bool,
    tests_all_rows: bool,
) -> FilePlan:
    imports = Imports()
    imports.runtime_name("System")
    of = {part.qualified_name: each for each in lowered for part in each.family.instances}
    names = Namespace((*OWN_NAMES, *types.names.values(), *(each.class_name for each in lowered)))
    safe = tuple(of[d.qualified_name].call(d, imports) for d in system.devices if d.safe)
    plant = _plant(system, imports, names, types, safe, stand_ins=stand_ins)
    if system.files:
        imports.runtime_name("join")
    scheduled = []
    for subsystem in system.subsystems:
        arguments = [of[subsystem.qualified_name].call(subsystem, imports)]
        arguments.append(f"ticks={int(1 / subsystem.rate_hz / tick_s)}")
        if subsystem.budget_s is not None:
            arguments.append(f"budget_s={literal(float(subsystem.budget_s))}")
        scheduled.append(call(imports.runtime_name("Scheduled"), arguments))
    parts = {
        "spec_literal": literal(PurePath(system.file).name),
        "name": literal(system.name),
        "tick_s": literal(float(tick_s)),
        "files": tuple((literal(name), literal(path)) for name, path in system.files),
        "subsystems": scheduled,
        "connections": tuple(_connections(system, imports)),
        "live": tuple(_live_constants(system, imports)),
        "plant": plant,
        "tests_all_rows": tests_all_rows,
        "ages": ages_plan(system, ages, imports) if ages else {},
        **run_parts(system, imports, stand_ins=stand_ins),
        "imports": imports.lines,  # when all of the others have asked for theirs
    }
    return FilePlan("system.py.j2", parts)
