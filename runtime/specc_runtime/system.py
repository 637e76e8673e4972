"""A built system: subsystems with their rates, connections, plant and task."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from specc_runtime.changes import number_within
from specc_runtime.subsystem import Subsystem

if TYPE_CHECKING:
    from specc_runtime.ages import AgeRules
    from specc_runtime.panel import PanelElement
    from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
    from specc_runtime.requirements import Requirements
    from specc_runtime.ros2.binding import Ros2
    from specc_runtime.safety import SafeOutputs


@dataclass(frozen=True, slots=True)
class Scheduled:
    """A subsystem that is due every `ticks` base ticks.

    Its steps take `budget_s` of the machine's time at most, as its specification says.
    """

    subsystem: Subsystem
    ticks: int
    budget_s: float | None = None


@dataclass(frozen=True, slots=True)
class Connection:
    """Output element `output` of `source` becomes input element `input` of `target`."""

    source: str
    output: str
    target: str
    input: str


@dataclass(frozen=True, slots=True)
class PlantInput:
    """Sensor `sensor` of the plant is input element `element` of `subsystem`."""

    sensor: str
    subsystem: str
    element: str


@dataclass(frozen=True, slots=True)
class PlantOutput:
    """Output element `element` of `subsystem` goes to actuator `actuator` of the plant."""

    subsystem: str
    element: str
    actuator: str


@dataclass(frozen=True, slots=True)
class PlantSpec:
    """What stands behind the real effectors and receptors.

    `model` is an MJCF file, relative to the base; `python` names what makes another plant,
    `module:name`; `ros2` is a node, which has only the elements with topics if it is beside one of
    those. A system without any is given its plant by the program that runs it.
    """

    model: str = ""
    sensors: tuple[SensorBinding, ...] = ()
    actuators: tuple[ActuatorBinding, ...] = ()
    inputs: tuple[PlantInput, ...] = ()
    outputs: tuple[PlantOutput, ...] = ()
    python: str = ""
    observed: tuple[SensorBinding, ...] = ()
    """What requirements see of the plant, and agents do not."""
    safe: tuple[SafeOutputs, ...] = ()
    """Of devices with safe outputs, which they get when a run ends."""
    ros2: Ros2 | None = None

    @property
    def is_simulated(self) -> bool:
        """Whether there is a model, or a plant in Python; `ros2` may be beside it."""
        return bool(self.model or self.python)

    @property
    def measured(self) -> tuple[SensorBinding, ...]:
        """The sensors whose values the plant gives, and not the operator's panel."""
        return tuple([sensor for sensor in self.sensors if sensor.panel is None])

    @property
    def panel(self) -> tuple[PanelElement, ...]:
        """The elements of the operator's panel."""
        return tuple([sensor.panel for sensor in self.sensors if sensor.panel is not None])


@dataclass(frozen=True, slots=True)
class LiveConstant:
    """A constant that may change within its bounds while the system runs, in SI units.

    `initial` is its value at the start; `readers` are subsystems and the elements of their inputs
    that have it; `title` is what the specification says of it.
    """

    name: str
    initial: float
    least: float
    greatest: float
    unit: str = ""
    readers: tuple[tuple[str, str], ...] = ()
    title: str = ""

    def checked(self, value: float) -> float:
        """A value that it may get; raises ValueError for any other one."""
        whole = type(self.initial) is int
        return number_within(self.name, value, self.least, self.greatest, self.unit, whole=whole)


@dataclass(frozen=True, slots=True)
class Draw:
    """A number that the seed of a run decides: one of `values`, or anywhere `between` two of them.

    SI units. `name` says of what it is: `at`, or a joint with `.x`, `.y`, `.z` or `.yaw` if free.
    """

    name: str
    values: tuple[float, ...]
    between: bool = False


@dataclass(frozen=True, slots=True)
class Deed:
    """A verb of `specc_runtime.disturbances.VERBS`, with what it is done to and its numbers."""

    verb: str
    name: str
    numbers: tuple[Draw, ...] = ()


Done = Draw | str | tuple[str, tuple[Draw, ...]]
"""A number of a name, a name, or a name with its numbers."""


class Disturbance:
    """What happens, for `lasts` seconds or to the end, from `at` on or once `when` holds then.

    `when` counts the triggers of the system; what waits for one begins `delay` seconds later.
    Numbers are drawn as those of a scene, anew for each repetition; `every` is the time to the next
    one. `does` says what is done, by verbs.
    """

    def __init__(
        self,
        because: str,
        *,
        at: Draw | None = None,
        when: int | None = None,
        delay: Draw | None = None,
        every: Draw | None = None,
        probability: Draw | None = None,
        lasts: Draw | None = None,
        **does: tuple[Done, ...],
    ) -> None:
        self.because, self.when, self.delay = because, when, delay
        self.at, self.every, self.probability, self.lasts = at, every, probability, lasts
        self.deeds = tuple(_deed(verb, item) for verb, items in does.items() for item in items)

    @property
    def subject(self) -> str:
        """What it does to what: `block elbow, shift box.x`."""
        return ", ".join(sorted(f"{deed.verb} {deed.name}" for deed in self.deeds))


def _deed(verb: str, item: Done) -> Deed:
    if isinstance(item, Draw):
        return Deed(verb, item.name, (item,))
    return Deed(verb, item) if isinstance(item, str) else Deed(verb, *item)


@dataclass(frozen=True, slots=True)
class Task:
    """What a run counts and judges. A cycle ends when `subsystem` goes from `source` to `target`.

    `starts` are positions to begin with. `scene` and `judge` name classes, `module:Class` (see
    `specc_runtime.task`); either may be "".
    `watch` lists memory of `subsystem` that its step records carry for the judge, `disturb` what
    happens to the plant meanwhile.
    """

    subsystem: str
    source: str
    target: str
    scene: str = ""
    judge: str = ""
    watch: tuple[str, ...] = ()
    starts: tuple[Draw, ...] = ()
    disturb: tuple[Disturbance, ...] = ()


@dataclass(frozen=True, slots=True)
class System:
    """Everything a run needs. `spec` is the specification's file, for reports."""

    name: str
    tick_s: float
    subsystems: tuple[Scheduled, ...]
    connections: tuple[Connection, ...] = ()
    plant: PlantSpec | None = None
    task: Task | None = None
    spec: str = ""
    requirements: Requirements | None = None
    triggers: Requirements | None = None
    """Conditions on which disturbances begin, and the run ends."""
    stop_when: int | None = None
    """Number of the trigger that ends a run."""
    tests_all_rows: bool = False
    """Whether the code tests rows although they are proved, as a run in real time needs it."""
    ages: AgeRules | None = None
    """Where somebody asks how old values are."""
    live: tuple[LiveConstant, ...] = ()
    """Constants that may change while it runs."""

    def __post_init__(self) -> None:
        """Raises ValueError that lists all inconsistencies."""
        problems = [*_bad_rates(self), *_bad_names(self)]
        if problems:
            raise ValueError(f"system {self.name!r}: {'; '.join(problems)}")

    @property
    def panel(self) -> tuple[PanelElement, ...]:
        """The elements of the operator's panel."""
        return self.plant.panel if self.plant is not None else ()

    @property
    def needs_plant(self) -> bool:
        """Whether there are devices but for the operator's panel."""
        plant = self.plant
        if plant is None or not plant.panel:
            return plant is not None
        others = plant.measured, plant.actuators, plant.observed
        return any(others) or plant.is_simulated or plant.ros2 is not None

    def scheduled(self, name: str) -> Scheduled:
        """The subsystem of that name; raises KeyError."""
        for scheduled in self.subsystems:
            if scheduled.subsystem.name == name:
                return scheduled
        raise KeyError(name)


def whole_ticks(period_s: float, tick_s: float) -> int:
    """Base ticks in a period; raises ValueError unless it is a whole number, at least 1."""
    ticks = round(period_s / tick_s)
    if ticks < 1 or not math.isclose(ticks * tick_s, period_s, rel_tol=1e-9):
        raise ValueError(f"a period of {period_s} s is not a multiple of the base tick, {tick_s} s")
    return ticks


def _bad_rates(system: System) -> list[str]:
    if not (system.tick_s > 0.0 and math.isfinite(system.tick_s)):
        return [f"the base tick is {system.tick_s} s"]
    problems = []
    for scheduled in system.subsystems:
        name, period_s = scheduled.subsystem.name, scheduled.subsystem.period_s
        try:
            ticks = whole_ticks(period_s, system.tick_s)
        except ValueError as error:
            problems.append(f"{name}: {error}")
            continue
        if ticks != scheduled.ticks:
            problems.append(f"{name}: {scheduled.ticks} ticks, but its period is {ticks}")
    for sensor in system.plant.sensors if system.plant else ():
        try:
            if sensor.rate_hz is not None:
                whole_ticks(1.0 / sensor.rate_hz, system.tick_s)
        except ValueError as error:
            problems.append(f"{sensor.name}: {error}")
    return problems


def _bad_names(system: System) -> list[str]:
    names = [scheduled.subsystem.name for scheduled in system.subsystems]
    problems = [f"{name} occurs twice" for name in sorted({n for n in names if names.count(n) > 1})]
    used = [end for c in system.connections for end in (c.source, c.target)]
    if system.plant is not None:
        used += [item.subsystem for item in system.plant.inputs]
        used += [item.subsystem for item in system.plant.outputs]
        sensors = {sensor.name for sensor in system.plant.sensors}
        actuators = {actuator.name for actuator in system.plant.actuators}
        unbound = {i.sensor for i in system.plant.inputs} - sensors
        unbound |= {o.actuator for o in system.plant.outputs} - actuators
        problems += [f"{name} is not bound to the plant" for name in sorted(unbound)]
    if system.task is not None:
        used.append(system.task.subsystem)
    return problems + [f"there is no subsystem {name}" for name in sorted(set(used) - set(names))]
