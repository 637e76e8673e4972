"""What the templates print, in order and already spelled; each template names its plan."""

from __future__ import annotations

from specc.frozen import frozen


@frozen
class ConstantPlan:
    """A constant. `is_computed`: an operator or a file gives it, so the class holds it."""

    name: str
    annotation: str
    value: str
    comment: str
    is_computed: bool


@frozen
class NamedPlan:
    """A name at the top of a module and its value: an enum, a contract, an operator."""

    name: str
    value: str


@frozen
class AttributePlan:
    """An attribute of a buffer or of the memory, or a field of a record."""

    name: str
    annotation: str
    comment: str


@frozen
class MethodPlan:
    """A method; `lines` carry their indentation relative to its body."""

    name: str
    parameters: tuple[str, ...]
    returns: str
    doc: str
    lines: tuple[str, ...]


@frozen
class TransitionPlan:
    """A row of the transition table, as literals."""

    source: str
    cause: str
    condition: str
    target: str
    comment: str


@frozen
class EquationsPlan:
    """Equation numbers by state, by state and cause, and by row, as literals."""

    behaviours: tuple[tuple[str, str], ...]
    checks: tuple[tuple[str, str], ...]
    rows: tuple[str, ...]


@frozen
class ModulePlan:
    """What stands above the classes of a module, and what its class computes when it is made."""

    imports: tuple[str, ...]
    contracts: tuple[NamedPlan, ...]
    operators: tuple[NamedPlan, ...]
    constants: tuple[ConstantPlan, ...]
    computed: tuple[ConstantPlan, ...]
    uses_files: bool


@frozen
class SubsystemPlan:
    """templates/subsystem.py.j2: the module of one subsystem."""

    title: str
    about: str
    spec: str
    module: ModulePlan
    class_name: str
    inputs: tuple[AttributePlan, ...]
    inputs_slots: str
    flags: tuple[str, ...]
    outputs: tuple[AttributePlan, ...]
    outputs_slots: str
    memory: tuple[AttributePlan, ...]
    memory_slots: str
    doc: str
    name: str
    period_s: str
    rate: str
    initial_state: str
    transitions: tuple[TransitionPlan, ...]
    sends: tuple[tuple[str, str], ...]
    equations: EquationsPlan | None
    """None if nothing has a number."""
    axioms: tuple[str, ...]
    uses_clock: bool
    initial_inputs: tuple[str, ...]
    methods: tuple[MethodPlan, ...]


@frozen
class SafePlan:
    """A method that gives the safe value of an element."""

    name: str
    annotation: str
    doc: str
    value: str
    reads_samples: bool


@frozen
class DevicePlan:
    """templates/device.py.j2: the module of a device with safe outputs."""

    title: str
    about: str
    spec: str
    module: ModulePlan
    class_name: str
    name: str
    samples: tuple[AttributePlan, ...]
    samples_slots: str
    elements: str
    reports: tuple[tuple[str, str], ...]
    values: tuple[SafePlan, ...]


@frozen
class RecordPlan:
    """A record of the specification without a class of its own."""

    name: str
    doc: str
    fields: tuple[AttributePlan, ...]


@frozen
class TypesPlan:
    """templates/types.py.j2: enums and records of the specification."""

    title: str
    spec: str
    imports: tuple[str, ...]
    literals: tuple[NamedPlan, ...]
    records: tuple[RecordPlan, ...]


@frozen
class ScheduledPlan:
    """A subsystem in the system: its class and how often it is due."""

    class_name: str
    ticks: int


@frozen
class PlantPlan:
    """What stands behind the devices: an argument that says so, if anything does.

    Items are calls of constructors.
    """

    contracts: tuple[NamedPlan, ...]
    made: str
    sensors: tuple[str, ...]
    actuators: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    safe: tuple[str, ...]
    """Classes of the devices with safe outputs."""


@frozen
class WholePlan:
    """templates/system.py.j2: how the subsystems form a system."""

    title: str
    spec: str
    spec_literal: str
    imports: tuple[str, ...]
    name: str
    tick_s: str
    files: tuple[tuple[str, str], ...]
    subsystems: tuple[ScheduledPlan, ...]
    connections: tuple[str, ...]
    plant: PlantPlan | None
    task: tuple[str, ...]
    """Arguments of the task; none if the system has no task."""


@frozen
class PackagePlan:
    """templates/package.py.j2: what the generated package is."""

    title: str
    spec: str


FilePlan = PackagePlan | TypesPlan | SubsystemPlan | DevicePlan | WholePlan


@frozen
class SystemPlan:
    """All generated files of a system: relative path -> plan."""

    name: str
    files: tuple[tuple[str, FilePlan], ...]
