"""The whole system to its plans: packages, types, subsystems, and what connects them."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import reduce
from math import gcd

from specc.lower.annotations import Annotations, TypeNames, literal_type
from specc.lower.flow import Proofs
from specc.lower.imports import Imports
from specc.lower.module import memory_names
from specc.lower.named_types import named_types
from specc.lower.names import ALL_OWN_NAMES, Names, class_name
from specc.lower.plan import (
    AttributePlan,
    FilePlan,
    LiteralPlan,
    PackagePlan,
    RecordPlan,
    ScheduledPlan,
    SystemPlan,
    TypesPlan,
    WholePlan,
)
from specc.lower.plant import plant_plan
from specc.lower.safe import device_plan
from specc.lower.subsystem import spec_file, subsystem_plan
from specc.lower.text import comment, docstring, in_docstring, literal
from specc.lower.wiring import connections
from specc.model.system import System, Task
from specc.model.types import Enum, Record


def lower(system: System, proofs: Proofs, *, stand_ins: bool = False) -> SystemPlan:
    """What the generated package of a system contains.

    `proofs` says which transition tables need no check while they run. `stand_ins` is for code
    whose operators and devices are played by a test: images and values of classes can be anything.
    """
    types = TypeNames(named_types(system))
    title = in_docstring(system.title or system.name)
    classes = _classes(system, types)
    modules = _modules(system)
    files: list[tuple[str, FilePlan]] = [
        ("__init__.py", PackagePlan(title, in_docstring(spec_file(system)))),
        *_types(system, types, title),
    ]
    for s in system.subsystems:
        name = s.qualified_name
        part = subsystem_plan(system, s, proofs, types, classes[name], stand_ins=stand_ins)
        files.append((f"{modules[name]}.py", part))
    for device in system.devices:
        if device.safe:
            name = device.qualified_name
            spec = in_docstring(spec_file(system))
            plan = device_plan(system, device, spec, types, classes[name], stand_ins=stand_ins)
            files.append((f"{modules[name]}.py", plan))
    files.append(("system.py", _whole(system, title, types, modules, classes, stand_ins=stand_ins)))
    return SystemPlan(system.name, tuple(files))


def _classes(system: System, types: TypeNames) -> dict[str, str]:
    """Class of every subsystem, after its agent and itself; titles may be reworded."""
    names = Names((*ALL_OWN_NAMES, *types.of.values()))
    found = {
        s.qualified_name: names.new(class_name(f"{s.agent} {s.name}")) for s in system.subsystems
    }
    for device in system.devices:
        found[device.qualified_name] = names.new(class_name(device.qualified_name))
    return found


def _modules(system: System) -> dict[str, str]:
    names = Names(("system", "types", "__init__"))
    found = {s.qualified_name: names.new(f"{s.agent}_{s.name}") for s in system.subsystems}
    for device in system.devices:
        found[device.qualified_name] = names.new(device.qualified_name.replace(".", "_").lower())
    return found


def _types(system: System, types: TypeNames, title: str) -> Iterator[tuple[str, TypesPlan]]:
    if not types.declared:
        return
    imports = Imports()
    annotations = Annotations(imports, types, own_module="")
    traces = dict(system.types)
    literals, records = [], []
    for name, type_ in types.declared:
        if isinstance(type_, Enum):
            imports.add("typing", "Literal")
            literals.append(LiteralPlan(name, literal_type(type_)))
        elif isinstance(type_, Record):
            imports.add("dataclasses", "dataclass")
            said = docstring(f"Record {type_.name}", str(traces.get(type_.name) or ""))
            records.append(RecordPlan(name, said, _fields(type_, annotations)))
    spec = in_docstring(spec_file(system))
    yield "types.py", TypesPlan(title, spec, imports.lines, tuple(literals), tuple(records))


def _fields(record: Record, annotations: Annotations) -> tuple[AttributePlan, ...]:
    return tuple(
        AttributePlan(name, annotations.of(type_), comment(str(type_)))
        for name, type_ in record.fields
    )


def _whole(
    system: System,
    title: str,
    types: TypeNames,
    modules: dict[str, str],
    classes: dict[str, str],
    *,
    stand_ins: bool,
) -> WholePlan:
    imports = Imports()
    imports.add("specc_runtime.system", "Scheduled")
    imports.add("specc_runtime.system", "System")
    for subsystem in system.subsystems:
        name = subsystem.qualified_name
        imports.add(f".{modules[name]}", classes[name])
    tick = base_tick(system)
    connected = tuple(connections(system))
    if connected:
        imports.add("specc_runtime.system", "Connection")
    safe = tuple(d.qualified_name for d in system.devices if d.safe)
    for name in safe:
        imports.add(f".{modules[name]}", classes[name])
    names = Names((*ALL_OWN_NAMES, *classes.values()))
    owners = tuple(classes[name] for name in safe)
    plant = plant_plan(system, imports, names, types, owners, stand_ins=stand_ins)
    if system.files:
        imports.add("os.path", "join")
    if system.task:
        imports.add("specc_runtime.system", "Task")
    return WholePlan(
        title=title,
        spec=in_docstring(spec_file(system)),
        spec_literal=literal(spec_file(system)),
        imports=imports.lines,
        name=literal(system.name),
        tick_s=literal(float(tick)),
        files=tuple((literal(name), literal(path)) for name, path in system.files),
        subsystems=tuple(
            ScheduledPlan(classes[s.qualified_name], int(1 / s.rate_hz / tick))
            for s in system.subsystems
        ),
        connections=connected,
        plant=plant,
        task=tuple(_task(system, system.task)) if system.task else (),
    )


def base_tick(system: System) -> Fraction:
    """The longest time of which all periods are whole multiples, in seconds."""
    periods = [1 / s.rate_hz for s in system.subsystems]
    return reduce(_common, periods) if periods else Fraction(1)


def _common(a: Fraction, b: Fraction) -> Fraction:
    divisor = gcd(a.numerator * b.denominator, b.numerator * a.denominator)
    return Fraction(divisor, a.denominator * b.denominator)


def _task(system: System, task: Task) -> Iterator[str]:
    yield f"subsystem={literal(task.subsystem)}"
    yield f"source={literal(task.source)}"
    yield f"target={literal(task.target)}"
    if task.scene:
        yield f"scene={literal(task.scene)}"
    if task.judge:
        yield f"judge={literal(task.judge)}"
    if task.watch:
        yield f"watch={literal(_watched(system, task))}"


def _watched(system: System, task: Task) -> tuple[str, ...]:
    """Attributes of the watched memory elements."""
    subsystem = next((s for s in system.subsystems if s.qualified_name == task.subsystem), None)
    names = memory_names(subsystem) if subsystem else {}
    return tuple(names[name] for name in task.watch if name in names)
