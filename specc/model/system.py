"""A whole specified system: agents, their subsystems and devices, the plant and its bindings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain
from typing import Literal

from specc.model.bindings import Binding, Published, Ros2
from specc.model.expr import FALSE, Expr, Number
from specc.model.fsm import (
    Axiom,
    Behaviour,
    Cause,
    Condition,
    Function,
    Generic,
    Mode,
    State,
    Trace,
    Transition,
)
from specc.model.requirement import FormulaLet, Requirement
from specc.model.scenario import Scenario
from specc.model.task import Disturbance, Draw, Task
from specc.model.types import Type, nested_types
from specc.source import Place

SubsystemKind = Literal["control", "virtual_effector", "virtual_receptor"]
DeviceKind = Literal["real_effector", "real_receptor"]


@dataclass(frozen=True, slots=True)
class Operator:
    """A primitive function in Python. Frame variables in the types start with "?".

    `name` is the one in the system: see `specc.model.expr.written`.
    """

    name: str
    parameters: tuple[tuple[str, Type], ...]
    result: Type
    python: str
    title: str
    trace: Trace
    place: Place
    symbol: str = ""
    """How documents write it, where the name does not say it."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A named value; it refers to nothing but other constants and operators.

    A number may have `bounds`. If it may change while something runs, its `value` is a `Live`, and
    `initial` the value at the start.
    """

    name: str
    value: Expr
    title: str
    place: Place
    bounds: tuple[float, float] | None = None
    initial: Number | None = None
    symbol: str = ""


@dataclass(frozen=True, slots=True)
class SafeOutput:
    """The value that a device gets when a run ends: `value`, or `otherwise` if that fails.

    In both, memory is what the device reported last.
    """

    value: Expr
    otherwise: Expr | None
    place: Place


@dataclass(frozen=True, slots=True)
class Element:
    """One element of a communication buffer."""

    name: str
    type: Type
    init: Expr | None
    title: str
    trace: Trace
    place: Place
    max_age_s: Fraction | None = None
    """How old the measurements behind a value that is received may be, in seconds."""
    safe: SafeOutput | None = None
    """Of what a device accepts."""
    event: bool = False
    """Whether none of the values that are received may be missed."""
    symbol: str = ""


@dataclass(frozen=True, slots=True)
class InterfaceRef:
    """The interface whose elements a buffer has, as the buffer names it."""

    text: str
    place: Place


@dataclass(frozen=True, slots=True)
class Port:
    """The part of a buffer that is connected to one peer."""

    peer: str
    direction: Literal["x", "y"]
    elements: tuple[Element, ...]
    other_end: str
    """Qualified name of the subsystem or device at the other end: `irp.c`, `irp.E.m`."""
    place: Place
    interface: InterfaceRef | None = None

    def element(self, name: str) -> Element | None:
        return next((e for e in self.elements if e.name == name), None)

    def place_of(self, element: Element) -> Place:
        """The place of an element: its own if this buffer declares it, else that of the buffer."""
        here, place = self.place, element.place
        inside = place.file == here.file and place.route[: len(here.route)] == here.route
        return place if inside else here


@dataclass(frozen=True, slots=True)
class Memory:
    name: str
    type: Type
    init: Expr
    title: str
    trace: Trace
    place: Place
    symbol: str = ""


@dataclass(frozen=True, slots=True)
class Let:
    """A named subexpression, computed at most once a period."""

    name: str
    value: Expr
    title: str
    trace: Trace
    place: Place
    symbol: str = ""


@dataclass(frozen=True, slots=True)
class OuterName:
    """A name that a file gives to all expressions in it."""

    kind: Literal["constant", "file"]
    name: str
    place: Place


@dataclass(frozen=True)
class Subsystem:
    """A control subsystem, virtual effector or virtual receptor."""

    agent: str
    name: str
    kind: SubsystemKind
    title: str
    rate_hz: Fraction
    ports: tuple[Port, ...]
    constants: tuple[Constant, ...]
    """The parameters of a reused description, with their values; empty otherwise."""
    memory: tuple[Memory, ...]
    lets: tuple[Let, ...]
    """In order of dependence: a let refers to earlier ones only."""
    conditions: tuple[Condition, ...]
    functions: tuple[Function, ...]
    behaviours: tuple[Behaviour, ...]
    states: tuple[State, ...]
    initial_state: str
    transitions: tuple[Transition, ...]
    axioms: tuple[Axiom, ...]
    trace: Trace
    place: Place
    outside: tuple[OuterName, ...] = ()
    """Constants and files of the file that describes it."""
    has_rate: bool = True
    """Whether its rate is known; `rate_hz` is 1 if it is not."""
    has_initial_state: bool = True
    """Whether its initial state is known."""
    budget_s: Fraction | None = None
    """How long a step may take on the machine, in seconds, if that is said."""
    modes: tuple[Mode, ...] = ()
    """A mode comes before those inside it."""
    idle_rows: tuple[Place, ...] = ()
    """Rows with the cause `error` in states whose error conditions all have rows by name."""
    generics: tuple[Generic, ...] = ()
    """The behaviours and functions with parameters, as they are declared."""

    @property
    def qualified_name(self) -> str:
        return f"{self.agent}.{self.name}"

    @cached_property
    def inputs(self) -> dict[tuple[str, str], Element]:
        """The elements of input buffers by peer and name, in order of the file."""
        return self._elements("x")

    @cached_property
    def outputs(self) -> dict[tuple[str, str], Element]:
        """The elements of output buffers by peer and name, in order of the file."""
        return self._elements("y")

    def _elements(self, direction: str) -> dict[tuple[str, str], Element]:
        ports = (port for port in self.ports if port.direction == direction)
        return {(port.peer, item.name): item for port in ports for item in port.elements}

    def port(self, direction: str, peer: str) -> Port | None:
        return self._ports.get((direction, peer))

    def sender(self, peer: str) -> str:
        """The name that an input buffer declares for its other end; `Wires` follow it."""
        return self._ports["x", peer].other_end

    @cached_property
    def _ports(self) -> dict[tuple[str, str], Port]:
        return {(port.direction, port.peer): port for port in reversed(self.ports)}

    def let(self, name: str) -> Let:
        return next(item for item in self.lets if item.name == name)

    def state(self, name: str) -> State:
        """The state of that name; raises KeyError."""
        return self._states[name]

    def rows(self, state: str, cause: Cause) -> tuple[tuple[int, Transition], ...]:
        """The rows of a state and cause, with their index in the transition table."""
        return self._rows.get((state, cause), ())

    def errors(self, state: State) -> tuple[tuple[str, Condition], ...]:
        """The error conditions of a state by the names that rows can have for them, in order.

        Those of modes come first. "" is the name of one that has none.
        """
        own = (b for b in self.behaviours if b.name == state.behaviour.name)
        around = (mode.errors for mode in self.modes if mode.name in state.modes)
        every = (*chain.from_iterable(around), *next(own, state.behaviour).errors)
        return tuple((name, error) for name, error in every if error.when != FALSE)

    def mode(self, name: str) -> Mode:
        """The mode of that name."""
        return next(mode for mode in self.modes if mode.name == name)

    @cached_property
    def _states(self) -> dict[str, State]:
        return {state.name: state for state in self.states}

    @cached_property
    def exit_conditions(self) -> tuple[Condition, ...]:
        """The conditions that lead from state to state; of equal `when` objects the last."""
        endings = (state.behaviour.endings[::-1] for state in self.states)
        every = [condition for own in endings for _, condition in own]
        every += [row.condition for row in self.transitions]
        return tuple({id(condition.when): condition for condition in every}.values())

    @cached_property
    def assigned_values(self) -> dict[tuple[str, str], dict[str, list[Expr]]]:
        """What behaviours of states assign, by peer ("" for memory), name and behaviour."""
        found: dict[tuple[str, str], dict[str, list[Expr]]] = {}
        for behaviour in {s.behaviour.name: s.behaviour for s in self.states}.values():
            for item in behaviour.assignments:
                by_name = found.setdefault((item.peer, item.name), {})
                by_name.setdefault(behaviour.name, []).append(item.value)
        # A behaviour of several states is the same in all of them but for what it does for modes.
        for item in (a for s in self.states if s.for_modes for a in s.for_modes.assignments):
            found[item.peer, item.name] = {"": [item.value]}
        for name, value in (each for row in self.transitions for each in row.sets):
            found.setdefault(("", name), {}).setdefault("", []).append(value)
        return found

    @cached_property
    def changing_memory(self) -> frozenset[str]:
        """Memory that some behaviour, state or row assigns."""
        assigned = (item for behaviour in self.behaviours for item in behaviour.assignments)
        return frozenset(
            name
            for peer, name in (*((a.peer, a.name) for a in assigned), *self.assigned_values)
            if not peer
        )

    @cached_property
    def _rows(self) -> dict[tuple[str, Cause], tuple[tuple[int, Transition], ...]]:
        found: dict[tuple[str, Cause], list[tuple[int, Transition]]] = {}
        for index, row in enumerate(self.transitions):
            found.setdefault((row.source, row.cause), []).append((index, row))
        return {key: tuple(rows) for key, rows in found.items()}


@dataclass(frozen=True, slots=True)
class Device:
    """A real effector or real receptor. `x` is what it accepts, `y` what it reports."""

    agent: str
    name: str
    kind: DeviceKind
    title: str
    x: tuple[Element, ...]
    y: tuple[Element, ...]
    trace: Trace
    place: Place
    constants: tuple[Constant, ...] = ()
    """The parameters of a reused description of its agent, with their values."""
    silence_s: Fraction | None = None
    """How long the agent may be silent in real time until the device gets its safe outputs."""

    @property
    def safe(self) -> tuple[tuple[Element, SafeOutput], ...]:
        """The elements that have a safe value, with it."""
        return tuple((element, element.safe) for element in self.x if element.safe)

    @property
    def qualified_name(self) -> str:
        letter = "E" if self.kind == "real_effector" else "R"
        return f"{self.agent}.{letter}.{self.name}"


@dataclass(frozen=True, slots=True)
class Agent:
    name: str
    kind: str
    """Letters of section 2.2 as declared, e.g. CERT; "" when the designer leaves it to specc."""
    title: str
    subsystems: tuple[Subsystem, ...]
    """The control subsystem first, then virtual effectors and receptors in file order."""
    devices: tuple[Device, ...]
    place: Place
    trace: Trace = Trace()  # noqa: RUF009  # frozen


@dataclass(frozen=True, slots=True)
class Plant:
    """What simulates or drives the devices: an MJCF `model`, an object of `python`, or `ros2`.

    A simulation may have `ros2` beside it, by which others command it.
    """

    model: str
    python: str
    bindings: tuple[Binding, ...]
    place: Place
    observed: tuple[Element, ...] = ()
    """What is really so, for requirements only."""
    ros2: Ros2 | None = None
    published: tuple[Published, ...] = ()

    @property
    def is_panel(self) -> bool:
        """Whether the devices have nothing behind them but the operator's panel."""
        has_parts = self.model or self.python or self.ros2
        return not has_parts and bool(self.bindings) and all(b.panel for b in self.bindings)


@dataclass(frozen=True, slots=True)
class Definition:
    """A type, file, constant or operator of the main file.

    `names` are the types that its own text names, by their labels.
    """

    kind: str
    name: str
    place: Place
    names: frozenset[str]

    @property
    def label(self) -> str:
        """Kind and name, e.g. `type Mode`."""
        return f"{self.kind} {self.name}"


@dataclass(frozen=True, slots=True)
class NamedType:
    """A name of types: where it is defined, and where it comes from."""

    name: str
    trace: Trace
    place: Place


@dataclass(frozen=True, slots=True)
class System:
    name: str
    title: str
    file: str
    frames: tuple[tuple[str, str], ...]
    types: tuple[NamedType, ...]
    operators: tuple[Operator, ...]
    constants: tuple[Constant, ...]
    files: tuple[tuple[str, str], ...]
    """Name in the system, as that of an operator, and path."""
    agents: tuple[Agent, ...]
    plant: Plant | None
    task: Task | None
    definitions: tuple[Definition, ...] = ()
    """Those of the main file, whose agents name those in `named_in_agents`."""
    named_in_agents: frozenset[str] = frozenset()
    folders: tuple[str, ...] = ()
    """Real paths of the folders in which its files lie; without any, they may lie anywhere."""
    requirements: tuple[Requirement, ...] = ()
    description_uses: tuple[tuple[Constant, ...], ...] = ()
    """Parameters and constants of each use of a description; expressions have their values."""
    formula_lets: tuple[FormulaLet, ...] = ()
    """Names for parts of formulas, and what they stand for."""
    stop_when: Requirement | None = None
    """The formula that ends a run, which the command line gives."""
    scenarios: tuple[Scenario, ...] = ()
    contracts: tuple[Requirement, ...] = ()
    """What devices do with commands."""

    @property
    def formulas(self) -> tuple[Requirement, ...]:
        """All formulas about runs: those that runs monitor, and formulas that have names."""
        named = (each.formula for each in self.formula_lets if each.formula is not None)
        return (*self.monitored, *named)

    @property
    def monitored(self) -> tuple[Requirement, ...]:
        """The formulas that some run monitors: those of every run, triggers, those of scenarios."""
        of_scenarios = (item for each in self.scenarios for item in each.formulas)
        return (*self.run_requirements, *self.triggers, *of_scenarios)

    @property
    def run_requirements(self) -> tuple[Requirement, ...]:
        """What every run is monitored for: the requirements, then the contracts of devices."""
        return (*self.requirements, *self.contracts)

    @property
    def triggers(self) -> tuple[Requirement, ...]:
        """The formulas that disturbances wait for, in order; last the one that ends a run."""
        disturbances = self.task.disturbances if self.task else ()
        return tuple(filter(None, (*(each.when for each in disturbances), self.stop_when)))

    @property
    def courses(self) -> tuple[tuple[Disturbance, ...], ...]:
        """The disturbances that happen in one run: those of the task, then of each scenario."""
        usual = self.task.disturbances if self.task else ()
        own = (
            (() if each.is_undisturbed else usual) + each.disturbances for each in self.scenarios
        )
        return (usual, *own)

    @property
    def disturbances(self) -> tuple[Disturbance, ...]:
        """All disturbances, each once: of the task and of scenarios."""
        usual = self.task.disturbances if self.task else ()
        return (*usual, *(one for each in self.scenarios for one in each.disturbances))

    @property
    def starts(self) -> tuple[Draw, ...]:
        """Where joints are when a run begins: by the task, and by scenarios."""
        usual = self.task.starts if self.task else ()
        return (*usual, *(draw for each in self.scenarios for draw in each.starts))

    @property
    def subsystems(self) -> tuple[Subsystem, ...]:
        return tuple(s for a in self.agents for s in a.subsystems)

    @property
    def devices(self) -> tuple[Device, ...]:
        return tuple(d for a in self.agents for d in a.devices)

    def operator(self, name: str) -> Operator:
        return next(o for o in self.operators if o.name == name)


def types_used(system: System) -> dict[Type, None]:
    """The types of operators, constants, buffers, memory and lets, and what they are made of."""
    return nested_types(_declared_types(system))


def _declared_types(system: System) -> Iterator[Type]:
    for operator in system.operators:
        yield from (type_ for _, type_ in operator.parameters)
        yield operator.result
    for constant in system.constants:
        yield constant.value.type
    for subsystem in system.subsystems:
        yield from (element.type for port in subsystem.ports for element in port.elements)
        yield from (item.type for item in subsystem.memory)
        yield from (let.value.type for let in subsystem.lets)
        yield from (p.type for generic in subsystem.generics for p in generic.parameters)
        yield from (constant.value.type for constant in subsystem.constants)
