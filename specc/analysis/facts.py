"""Facts about a system: its machines, and what goes on between them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from specc.analysis.assumption_checker import AssumptionChecker
from specc.analysis.dataflow import Ages, DataFlow, InputNode
from specc.analysis.definite_assignment import availability_of
from specc.analysis.machine import Machine, RowVerdictAt
from specc.analysis.plant import BoundElement, bound_elements, plant_model
from specc.analysis.rates import Rates
from specc.analysis.reaching import ReachingDefinitions
from specc.analysis.reads import Dependences, nodes
from specc.analysis.suspicious_expressions import SuspiciousExpressions, no_value
from specc.lang.evaluate import Environment, evaluate
from specc.limits import MAX_VALUES, spend_or_raise
from specc.mjcf import Model, ModelError
from specc.model.bindings import PLANT
from specc.model.expr import (
    Call,
    Compare,
    ConstantRef,
    Expr,
    FileRef,
    Live,
    Member,
    MemoryRef,
    constant_names,
    has_unknown,
    map_children,
    walk,
)
from specc.model.fsm import Cause
from specc.model.requirement import Reading, Requirement
from specc.model.system import Constant, Element, Subsystem, System
from specc.model.types import Bool, Enum
from specc.model.wires import Wires
from specc.proof import Numbering, Ticks
from specc.reachable import reachable

if TYPE_CHECKING:
    from specc.analysis.examples import Examples


class Facts:
    """Facts about a system; those about one subsystem are its machine's.

    A `broken` subsystem is left out. A `faulty` one has unknowns in it; its facts hold whatever
    these are.
    """

    def __init__(
        self,
        system: System,
        broken: frozenset[str] = frozenset(),
        faulty: frozenset[str] = frozenset(),
    ) -> None:
        self.system = system
        self.broken = broken | _ambiguous_parts(system)
        self.faulty = faulty
        self.subsystems = tuple(s for s in system.subsystems if s.qualified_name not in self.broken)
        self.wires = Wires(system.agents)

    # Its machines, and those of which enough is known.

    @cached_property
    def _machines(self) -> dict[str, Machine]:
        """By the qualified name of the subsystem."""
        return {s.qualified_name: self._machine(s) for s in self.subsystems}

    def _machine(self, subsystem: Subsystem) -> Machine:
        arrivals = availability_of(subsystem, self.wires, self.broken, timed=not self.rates.clash)
        faulty = subsystem.qualified_name in self.faulty
        # The constants that expressions of a subsystem name, directly or through others.
        named = (node.name for node in nodes(subsystem) if isinstance(node, ConstantRef))
        found = reachable(named, self._named_by)
        constants = {name: constant for name, constant in self._constants.items() if name in found}
        return Machine(subsystem, constants, arrivals, faulty=faulty)

    def of(self, subsystem: Subsystem) -> Machine:
        """The machine of a subsystem without errors."""
        return self._machines[subsystem.qualified_name]

    @cached_property
    def machines(self) -> tuple[Machine, ...]:
        """The machines of all subsystems without errors."""
        return tuple(self._machines.values())

    @cached_property
    def consistent_machines(self) -> tuple[Machine, ...]:
        """Machines whose axioms do not contradict each other."""
        return tuple(machine for machine in self.machines if machine.is_consistent)

    @cached_property
    def complete_machines(self) -> tuple[Machine, ...]:
        """The consistent ones that have no unknowns, and rows for all states that end."""
        return tuple(machine for machine in self.machines if machine.is_complete)

    @cached_property
    def row_verdicts(self) -> tuple[RowVerdictAt, ...]:
        """The verdicts about every state and cause of all consistent machines.

        What tables leave open is refuted where a search finds values that show it.
        """
        verdicts = [each for machine in self.consistent_machines for each in machine.row_verdicts]
        if all(each.verdict.decision.open is None for each in verdicts):
            return tuple(verdicts)
        return tuple(map(self.examples().confirm, verdicts))

    def examples(self) -> Examples:
        """A new search for examples of refutations."""
        from specc.analysis.examples import Examples  # not needed unless something is found

        return Examples(self.system, self.wires, self.of)

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """Whether exactly one row of a state and cause applies whenever that cause occurs.

        `subsystem` is a qualified name; one with errors has nothing proved.
        """
        machine = self._machines.get(subsystem)
        return machine is not None and machine.verdict(state, cause).proved

    # Constants of the system.

    @cached_property
    def constants_without_value(self) -> tuple[tuple[Constant, str], ...]:
        """Constants and parameters without a value, each with the reason; one finding per place."""
        lists = dict.fromkeys((self.system.constants, *self.system.description_uses))
        found = (none for constants in lists for none in constants_without_value(constants))
        return tuple({constant.place: (constant, why) for constant, why in found}.values())

    @cached_property
    def _constants(self) -> dict[str, Constant]:
        none = {constant.place for constant, _ in self.constants_without_value}
        return {c.name: c for c in self.system.constants if c.place not in none}

    def _named_by(self, name: str) -> Iterable[str]:
        return constant_names(self._constants[name].value) if name in self._constants else ()

    @cached_property
    def suspicious(self) -> SuspiciousExpressions:
        """Suspicious expressions in the constants of the system."""
        numbering = Numbering({}, {c.name: c.value for c in self.system.constants})
        return SuspiciousExpressions(self.system, self._constants, Dependences({}), numbering)

    @cached_property
    def ticks(self) -> Ticks:
        """Proofs about formulas of requirements and of disturbances, at one tick."""
        known = facts_about_readings(
            self.system, {m.subsystem.qualified_name: m for m in self.complete_machines}
        )
        return Ticks({name: c.value for name, c in self._constants.items()}, known)

    # What goes on between machines, and between them and the plant.

    @cached_property
    def rates(self) -> Rates:
        """The rates that fit together."""
        known = {s.qualified_name for s in self.system.subsystems} | self.wires.devices.keys()
        return Rates(self.wires, self.subsystems, self.bindings, is_complete=self.broken <= known)

    @cached_property
    def ages(self) -> Ages:
        """How old values are where they are read."""
        sources = DataFlow(self.wires, self._machines, self.bindings)
        periods_s = {s.qualified_name: 1 / s.rate_hz for s in self.subsystems}
        return Ages(sources, periods_s, [node for node, _ in self.inputs()])

    @cached_property
    def assumption_checker(self) -> AssumptionChecker:
        """Checks assumptions about arrival; proves nothing where rates do not fit."""
        return AssumptionChecker(self.wires, {} if self.rates.clash else self._machines)

    def inputs(self) -> Iterator[tuple[InputNode, Element]]:
        """Yield all elements that subsystems and devices receive, without those with errors."""
        for subsystem in self.subsystems:
            for name, element in subsystem.inputs.items():
                yield InputNode(subsystem.qualified_name, *name), element
        for device in self.system.devices:
            if device.qualified_name not in self.broken:
                for element in device.x:
                    yield InputNode(device.qualified_name, "", element.name), element

    @cached_property
    def formulas(self) -> tuple[Requirement, ...]:
        """The formulas that runs monitor; a name for a part of one is in its text."""
        return self.system.monitored

    def watched(self, subsystem: Subsystem) -> frozenset[str]:
        """The memory that the task or a formula reads."""
        task, name = self.system.task, subsystem.qualified_name
        found = task.watch if task and task.subsystem == name else ()
        readings = (reading for item in self.formulas for reading in item.readings)
        named = (r.element[0] for r in readings if (r.subsystem, r.kind) == (name, "memory"))
        return frozenset((*found, *named))

    @cached_property
    def bindings(self) -> tuple[BoundElement, ...]:
        """The bindings of the plant whose device and element exist."""
        return tuple(bound_elements(self.system))

    @cached_property
    def reported(self) -> dict[str, BoundElement]:
        """The bindings of what devices report, as `agent.E.device.element`."""
        found = (b for b in self.bindings if not b.is_commanded and b.binding.device != PLANT)
        return {f"{b.binding.device}.{b.binding.element}": b for b in found}

    @cached_property
    def definitions(self) -> ReachingDefinitions:
        """Reaching definitions of numbers, through lets, memory and buffers."""
        readings = (reading for item in self.system.formulas for reading in item.readings)
        return ReachingDefinitions(self.wires, self.subsystems, self.system.constants, readings)

    @cached_property
    def model(self) -> Model | ModelError | None:
        """What the plant's model file declares, or why it cannot be read; None without one."""
        return plant_model(self.system)


def _ambiguous_parts(system: System) -> frozenset[str]:
    """All parts of agents with two subsystems of one name: their peers are ambiguous."""
    found: set[str] = set()
    for agent in system.agents:
        names = [s.qualified_name for s in agent.subsystems]
        if len(set(names)) < len(names):
            found |= {*names, *(device.qualified_name for device in agent.devices)}
    return frozenset(found)


# Constants whose arithmetic has no result, so that nothing is known of them.


def constants_without_value(constants: Iterable[Constant]) -> Iterator[tuple[Constant, str]]:
    """Constants whose arithmetic has no result, each with the reason.

    Values of operators and files are known when the system is built.
    """
    values: dict[str, Any] = {}
    sizes: dict[int, tuple[Any, int]] = {}
    count = partial(spend_or_raise, "folding")
    for constant in constants:
        expr = constant.value
        is_given = any(isinstance(node, (Call, FileRef, Live)) for node in walk(expr))
        if is_given or has_unknown(expr) or not values.keys() >= set(constant_names(expr)):
            values.pop(constant.name, None)
            continue
        try:
            known = Environment(constants=values, count=count)
            value = evaluate(constant.value, known)
            _measure(value, sizes)
            values[constant.name] = value
        except (ArithmeticError, ValueError) as error:
            values.pop(constant.name, None)
            yield constant, no_value(error)


def _measure(value: Any, sizes: dict[int, tuple[Any, int]]) -> int:
    """The number of parts of a value; shared parts count each time.

    `sizes` has what was measured before, by identity. Raises OverflowError if a number is not
    finite, or there are too many.
    """
    if not isinstance(value, tuple):
        if isinstance(value, float) and math.isinf(value):
            raise OverflowError
        return 1
    if id(value) not in sizes:
        size = 1 + sum(_measure(part, sizes) for part in value)
        if size > MAX_VALUES:
            raise OverflowError
        sizes[id(value)] = value, size
    return sizes[id(value)][1]


def facts_about_readings(system: System, machines: Mapping[str, Machine]) -> Iterator[Expr]:
    """Conditions that hold of readings at every tick; `machines` are the complete ones.

    States and memory are always present, and memory keeps within its range. An unreachable state is
    reported once (W0607), not for each formula that names it.
    """
    for reading in {r.name: r for item in system.formulas for r in item.readings}.values():
        machine = machines.get(reading.subsystem)
        value = MemoryRef(reading.name, type=reading.type)
        if reading.asks_presence:
            if reading.kind in ("state", "memory") or reading.initial:
                yield value
        elif reading.kind == "memory" and machine:
            known = machine.value_ranges.conditions.get(reading.element[0])
            if known is not None:
                yield _on_reading(reading, known)


def _on_reading(reading: Reading, known: Expr) -> Expr:
    """A condition on memory as a condition on the reading of it."""
    if isinstance(known, MemoryRef):
        return MemoryRef(reading.name, type=known.type)
    return map_children(known, lambda part: _on_reading(reading, part))


def initial_state_of(reading: Reading, system: System) -> Expr | None:
    """The condition that a subsystem is in its initial state."""
    if reading.kind != "state" or not isinstance(reading.type, Enum):
        return None
    found = {s.qualified_name: s.initial_state for s in system.subsystems if s.has_initial_state}
    state = found.get(reading.subsystem)
    if state not in reading.type.members:
        return None
    first = Member(state, type=reading.type)
    return Compare("==", MemoryRef(reading.name, type=reading.type), first, type=Bool())
