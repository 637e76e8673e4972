"""The abstraction of a system for exploring, and its slices: machines that are explored together.

The abstraction tracks the inputs, memory and outputs on which conditions and assumptions depend,
directly or through lets, memory and other subsystems. A value that is computed from measurements
in every period is `noise`: always fresh, and never known. A slice has a machine together with all
machines that send it a tracked element.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

from specc.analysis import Facts, Machine
from specc.analysis.rates import base_tick
from specc.analysis.reads import Dependences
from specc.model import expr as m
from specc.model import requirement as r
from specc.model.fsm import State, mode_name
from specc.model.system import Subsystem
from specc.model.types import Enum
from specc.proof import InputName
from specc.reachable import reachable
from specc.tools.explore.cone import (
    Cone,
    ConeEnding,
    ConeInput,
    ConeMemory,
    ConeRow,
    ConeState,
    named_definitions,
)
from specc.tools.explore.cuts import number_domains
from specc.tools.explore.partial import may_fail, static_values
from specc.tools.explore.regions import BoundedUnknown, NumberDomain, bounded_unknown


def conditions_of(subsystem: Subsystem, state: str) -> Iterator[m.Expr]:
    """The conditions of a state: error, terminal, and the initial conditions of its rows."""
    for cause, end in subsystem.state(state).behaviour.endings:
        rows = subsystem.rows(state, cause)
        if rows and end.when != m.FALSE:
            yield end.when
            yield from (row.condition.when for _, row in rows)


@dataclass(eq=False, slots=True)
class AbstractMachine:
    """The inputs, memory and outputs of one subsystem that the abstraction tracks."""

    analysis: Machine
    inputs: set[InputName] = field(default_factory=set)
    memory: set[str] = field(default_factory=set)
    outputs: set[InputName] = field(default_factory=set)

    @property
    def subsystem(self) -> Subsystem:
        """The subsystem."""
        return self.analysis.subsystem

    @property
    def dependences(self) -> Dependences:
        """The dependences of its expressions."""
        return self.analysis.dependences

    def tracks(self, target: InputName) -> bool:
        """Whether memory (of the peer "") or an output is tracked."""
        return target in self.outputs if target[0] else target[1] in self.memory

    def memory_bounds(self) -> Iterator[tuple[str, BoundedUnknown]]:
        """The bounds of numbers in tracked memory, whatever is measured."""
        bounds = self.analysis.value_ranges.bounds
        for item in self.subsystem.memory:
            memory = m.MemoryRef(item.name, type=item.type)
            if item.name in self.memory and (
                found := bounded_unknown(memory, bounds.of(memory), item.type)
            ):
                yield item.name, found

    @property
    def has_decisions(self) -> bool:
        """Whether it has a condition, an event or an assumption."""
        subsystem = self.subsystem
        ends = any(list(conditions_of(subsystem, s.name)) for s in subsystem.states)
        events = any(element.event for element in subsystem.inputs.values())
        return ends or events or bool(subsystem.axioms)


def _cone_state(machine: AbstractMachine, state: State, failing: Collection[str]) -> ConeState:
    """The part of the cone that describes a state; `failing` are the lets that may fail."""
    endings = (
        ConeEnding(
            end.name,
            end.when,
            tuple(
                ConeRow(
                    index,
                    row.target,
                    row.condition.name,
                    row.condition.when,
                    tuple((name, value) for name, value in row.sets if name in machine.memory),
                )
                for index, row in machine.subsystem.rows(state.name, cause)
            ),
        )
        for cause, end in state.behaviour.endings
    )
    assigned = [((item.peer, item.name), item.value) for item in state.behaviour.assignments]
    return ConeState(
        state.name,
        tuple(endings),
        tuple((key, value) for key, value in assigned if machine.tracks(key)),
        tuple(value for _, value in assigned if may_fail(value, failing)),
        machine.dependences.all(value for _, value in assigned).inputs,
        frozenset(state.ignores),
        tuple(_event_members(machine, state)),
    )


def _event_members(
    machine: AbstractMachine, state: State
) -> Iterator[tuple[InputName, frozenset[str], frozenset[str]]]:
    """The events with an enum, with the members to which conditions and functions react."""
    conditions = list(conditions_of(machine.subsystem, state.name))
    values = [item.value for item in state.behaviour.assignments]
    for key, element in machine.subsystem.inputs.items():
        if element.event and isinstance(element.type, Enum):
            reactions = machine.analysis.reactions
            yield key, reactions(conditions, key), reactions(values, key)


class Abstraction:
    """The tracked elements of all subsystems of a system without errors."""

    def __init__(
        self,
        facts: Facts,
        requirements: Iterable[r.Requirement] = (),
        forgotten_memory: Collection[str] = (),
    ) -> None:
        """Memory and outputs that these requirements read are tracked as well.

        Nothing is known of `forgotten_memory`, with names such as `irp.m.tries`.
        """
        self.facts = facts
        self._forgotten_memory = forgotten_memory
        self.machines = {
            machine.subsystem.qualified_name: AbstractMachine(machine) for machine in facts.machines
        }
        self.sender_of = facts.wires.sender
        self.noise = self._find_noise()
        self._cones: dict[str, Cone] = {}
        self.copies_by_slice: dict[tuple[str, ...], list[Any]] = {}
        """The copies of agents in each slice that was examined (`symmetry`)."""
        self._track_conditions()
        self._requirements = tuple(requirements)
        for reading in (each for required in self._requirements for each in required.readings):
            self._track_reading(reading)

    @cached_property
    def tick_s(self) -> Fraction:
        """The base tick of the whole system."""
        return base_tick(1 / each.rate_hz for each in self.facts.system.subsystems)

    @cached_property
    def domains(self) -> dict[str, NumberDomain]:
        """The domains of all numbers in memory and outputs, by target."""
        return number_domains(self.facts, self._requirements)

    def _find_noise(self) -> set[tuple[str, InputName]]:
        found: set[tuple[str, InputName]] = set()
        before = -1
        while before < len(found):
            before = len(found)
            for reader, machine in self.machines.items():
                for key in machine.analysis.availability.fresh:
                    sent = self.sender_of(reader, key)
                    if sent and self._is_measured(*sent, found):
                        found.add((reader, key))
        return found

    def _is_measured(self, sender: str, key: InputName, noise: set[tuple[str, InputName]]) -> bool:
        """Whether every value of an output is computed from measurements."""
        machine = self.machines[sender]
        sent = [e for each in machine.subsystem.assigned_values.get(key, {}).values() for e in each]
        return bool(sent) and all(
            any(
                self.sender_of(sender, name) is None or (sender, name) in noise
                for name in machine.dependences.of(expr).values
            )
            for expr in sent
        )

    @cached_property
    def measured(self) -> set[tuple[str, InputName]]:
        """Inputs, and memory without a peer, whose values are computed from measurements."""
        found = {
            (name, key)
            for name, machine in self.machines.items()
            for key in machine.subsystem.inputs
            if self.sender_of(name, key) is None
        }
        before = -1
        while before < len(found):
            before = len(found)
            for name, machine in self.machines.items():
                for item in machine.subsystem.memory:
                    if self._may_be_measured(name, ("", item.name), item.init, found):
                        found.add((name, ("", item.name)))
                for key in machine.subsystem.inputs:
                    sent = self.sender_of(name, key)
                    if sent and self._may_be_measured(*sent, None, found):
                        found.add((name, key))
        return found

    def _may_be_measured(
        self, name: str, key: InputName, init: m.Expr | None, measured: set[tuple[str, InputName]]
    ) -> bool:
        """Whether some value that memory or an output gets is computed from measurements."""
        written = self.machines[name].subsystem.assigned_values.get(key, {}).values()
        exprs = [*(e for each in written for e in each), *([] if init is None else [init])]
        rests = self.machines[name].dependences.all(exprs)
        read = {*rests.inputs, *(("", memory) for memory in rests.memory)}
        return rests.has_lag or any((name, key) in measured for key in read)

    def noise_bounds(self, reader: str, key: InputName) -> BoundedUnknown | None:
        """The bounds of a value that is computed from measurements in every period."""
        sent = self.sender_of(reader, key)
        if sent is None or (reader, key) not in self.noise:
            return None
        sender, output = self.machines[sent[0]], sent[1]
        bounds, type_ = sender.analysis.value_ranges.bounds, sender.subsystem.outputs[output].type
        exprs = [e for each in sender.subsystem.assigned_values[output].values() for e in each]
        found = [bounded_unknown(expr, bounds.of(expr), type_) for expr in exprs]
        if (init := self.machines[reader].subsystem.inputs[key].init) is not None:
            here = self.machines[reader].analysis.value_ranges.bounds
            found.append(bounded_unknown(init, here.of(init), type_))
        known = [each for each in found if each is not None]
        if len(known) < len(found):
            return None
        return BoundedUnknown(min(each.low for each in known), max(each.high for each in known))

    def _track_conditions(self) -> None:
        for name, machine in self.machines.items():
            subsystem = machine.subsystem
            conditions = [e for s in subsystem.states for e in conditions_of(subsystem, s.name)]
            events = [
                m.Fresh(m.Input(*key, type=element.type), type=m.TRUE.type)
                for key, element in subsystem.inputs.items()
                if element.event
            ]
            self._track_dependences(
                name, [*conditions, *(axiom.that for axiom in subsystem.axioms), *events]
            )

    def _track_reading(self, reading: r.Reading) -> None:
        if reading.kind == "memory" and reading.subsystem in self.machines:
            memory = m.MemoryRef(reading.element[0], type=reading.type)
            self._track_dependences(reading.subsystem, [memory])
        elif reading.kind == "sent" and reading.subsystem in self.machines:
            machine = self.machines[reading.subsystem]
            key = reading.element[0], reading.element[1]
            machine.outputs.add(key)
            written = machine.subsystem.assigned_values.get(key, {})
            self._track_dependences(
                reading.subsystem, [e for each in written.values() for e in each]
            )

    def _track_dependences(self, name: str, exprs: Iterable[m.Expr]) -> None:
        """Track the transitive dependences of some expressions of a subsystem."""
        waiting = [(name, [*exprs])]
        while waiting:
            name, here = waiting.pop()
            machine = self.machines[name]
            rests = machine.dependences.all(here)
            for item in rests.memory - machine.memory:
                machine.memory.add(item)
                written = machine.subsystem.assigned_values.get(("", item), {})
                begin = next(i.init for i in machine.subsystem.memory if i.name == item)
                waiting.append((name, [begin, *(e for each in written.values() for e in each)]))
            for key in rests.inputs - machine.inputs:
                sent = self.sender_of(name, key)
                event = machine.subsystem.inputs[key].event
                if sent is None or ((name, key) in self.noise and not event):
                    continue
                machine.inputs.add(key)
                sender, output = sent
                self.machines[sender].outputs.add(output)
                written = self.machines[sender].subsystem.assigned_values.get(output, {})
                waiting.append((sender, [e for each in written.values() for e in each]))

    def is_steady(self, reader: str, key: InputName) -> bool:
        """Whether an untracked input is fresh in every period after the first."""
        if (reader, key) in self.noise:
            return True
        bindings = {(b.binding.device, b.binding.element): b.binding for b in self.facts.bindings}
        subsystem = self.machines[reader].subsystem
        bound = bindings.get((self.facts.wires.measuring_device(reader, key[0]), key[1]))
        if bound is None or bound.sporadic:
            return False
        return bound.rate_hz is None or bound.rate_hz >= subsystem.rate_hz

    def cone(self, name: str) -> Cone:
        """The cone of a machine."""
        if name not in self._cones:
            self._cones[name] = self._cone(name, self.machines[name])
        return self._cones[name]

    def _cone(self, name: str, machine: AbstractMachine) -> Cone:
        subsystem, within = machine.subsystem, dict(machine.memory_bounds())
        failing = set[str]()
        for let in subsystem.lets:  # in order of dependence
            failing |= {let.name} if may_fail(let.value, failing) else set()
        states = tuple(_cone_state(machine, state, failing) for state in subsystem.states)
        inputs = tuple(
            ConeInput(
                key,
                element.type,
                element.init if key in machine.inputs else None,
                is_event=element.event,
                is_tracked=key in machine.inputs,
                is_measured=self.sender_of(name, key) is None,
                is_steady=key not in machine.inputs and self.is_steady(name, key),
                bounds=None if key in machine.inputs else self.noise_bounds(name, key),
            )
            for key, element in subsystem.inputs.items()
        )
        timers = {mode_name("periods", mode.name) for mode in subsystem.modes}
        memory = tuple(
            ConeMemory(
                item.name,
                item.type,
                item.init,
                within.get(item.name),
                item.name in timers,
                f"{name}.{item.name}" in self._forgotten_memory,
            )
            for item in subsystem.memory
            if item.name in machine.memory
        )
        axioms = tuple(axiom.that for axiom in subsystem.axioms)
        exprs = [*axioms, *(item.init for item in memory), *(x.init for x in inputs if x.init)]
        exprs += [expr for state in states for expr in state.expressions]
        known = static_values(subsystem, self.facts.system)
        lets, constants = named_definitions(exprs, machine.dependences, known.constants)
        return Cone(
            known.period_s,
            subsystem.initial_state,
            states,
            inputs,
            tuple((k, out.type) for k, out in subsystem.outputs.items() if k in machine.outputs),
            memory,
            lets,
            constants,
            axioms,
            frozenset(machine.analysis.availability.declared),
            frozenset(key for reader, key in self.measured if reader == name),
            machine.analysis.prover,
        )

    def slices(self) -> list[tuple[str, ...]]:
        """The slices: each machine that decides, with all machines that influence it."""
        every = [
            set(self.with_influences([name]))
            for name, machine in self.machines.items()
            if machine.has_decisions
        ]
        largest = [s for s in every if not any(s < other for other in every)]
        return list(dict.fromkeys(_sorted_names(names) for names in largest))

    def with_influences(self, names: Iterable[str]) -> tuple[str, ...]:
        """Some machines with all machines that influence them."""

        def influences(name: str) -> list[str]:
            sent = (self.sender_of(name, key) for key in sorted(self.machines[name].inputs))
            return [one[0] for one in sent if one]

        return _sorted_names(reachable([n for n in names if n in self.machines], influences))


def _sorted_names(names: Iterable[str]) -> tuple[str, ...]:
    """The machines by name: the order in the file does not choose among equally easy traces."""
    return tuple(sorted(names))
