"""The abstraction of a system for exploring, and its slices: machines that are explored together.

The abstraction keeps the inputs, memory and outputs on which conditions and assumptions depend,
directly or through lets, memory and other subsystems. A value that is computed from measurements
in every period is `noise`: always fresh, and never known. A slice has a machine together with all
machines that send it an element that is kept.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

from specc.analysis import Facts, Machine
from specc.analysis.rates import base_tick
from specc.analysis.reads import Dependences, texts
from specc.model import expr as m
from specc.model import requirement as r
from specc.model.fsm import State
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
    named_in,
)
from specc.tools.explore.partial import Known, filled, may_fail, static
from specc.tools.explore.regions import Within, within


def conditions_of(subsystem: Subsystem, state: str) -> Iterator[m.Expr]:
    """The conditions of a state: error, terminal, and the initial conditions of its rows."""
    for cause, end in subsystem.state(state).behaviour.endings:
        rows = subsystem.rows(state, cause)
        if rows and end.when != m.FALSE:
            yield end.when
            yield from (row.condition.when for _, row in rows)


@dataclass(eq=False, slots=True)
class Kept:
    """The inputs, memory and outputs of one subsystem that the abstraction keeps."""

    machine: Machine
    inputs: set[InputName] = field(default_factory=set)
    memory: set[str] = field(default_factory=set)
    outputs: set[InputName] = field(default_factory=set)

    @property
    def subsystem(self) -> Subsystem:
        """The subsystem."""
        return self.machine.subsystem

    @property
    def rests(self) -> Dependences:
        """The dependences of its expressions."""
        return self.machine.dependences

    def has(self, target: InputName) -> bool:
        """Whether memory (of the peer "") or an output is kept."""
        return target in self.outputs if target[0] else target[1] in self.memory

    def memory_within(self) -> Iterator[tuple[str, Within]]:
        """What numbers in kept memory lie within, whatever is measured."""
        bounds = self.machine.value_ranges.bounds
        for item in self.subsystem.memory:
            memory = m.MemoryRef(item.name, type=item.type)
            if item.name in self.memory and (found := within(memory, bounds.of(memory), item.type)):
                yield item.name, found

    @property
    def decides(self) -> bool:
        """Whether it has a condition, an event or an assumption."""
        subsystem = self.subsystem
        ends = any(list(conditions_of(subsystem, s.name)) for s in subsystem.states)
        events = any(element.event for element in subsystem.inputs.values())
        return ends or events or bool(subsystem.axioms)


def _state(kept: Kept, state: State, failing: Collection[str]) -> ConeState:
    """What the cone of a machine has of a state; `failing` are the lets that may fail."""
    endings = (
        ConeEnding(
            end.name,
            end.when,
            tuple(
                ConeRow(index, row.target, row.condition.name, row.condition.when)
                for index, row in kept.subsystem.rows(state.name, cause)
            ),
        )
        for cause, end in state.behaviour.endings
    )
    assigned = [((item.peer, item.name), item.value) for item in state.behaviour.assignments]
    return ConeState(
        state.name,
        tuple(endings),
        tuple((key, value) for key, value in assigned if kept.has(key)),
        tuple(value for _, value in assigned if may_fail(value, failing)),
        kept.rests.all(value for _, value in assigned).inputs,
        frozenset(state.ignores),
        tuple(_members(kept, state)),
    )


def _members(
    kept: Kept, state: State
) -> Iterator[tuple[InputName, frozenset[str], frozenset[str]]]:
    """The events with an enum, with the members to which conditions and functions react."""
    conditions = list(conditions_of(kept.subsystem, state.name))
    values = [item.value for item in state.behaviour.assignments]
    for key, element in kept.subsystem.inputs.items():
        if element.event and isinstance(element.type, Enum):
            reactions = kept.machine.reactions
            yield key, reactions(conditions, key), reactions(values, key)


class Abstraction:
    """The kept elements of all subsystems of a system without errors."""

    def __init__(self, facts: Facts, requirements: Iterable[r.Requirement] = ()) -> None:
        """Memory and outputs that these requirements read are kept as well."""
        self.facts = facts
        self.kept = {machine.subsystem.qualified_name: Kept(machine) for machine in facts.machines}
        self.sender_of = facts.wires.sender
        self.noise = self._noise()
        self._cones: dict[str, Cone] = {}
        self.copies: dict[tuple[str, ...], list[Any]] = {}
        """Of slices that were looked at, what `symmetry` says of them."""
        self._keep()
        required = list(requirements)
        for reading in (each for requirement in required for each in requirement.readings):
            self._watch(reading)
        atoms = [atom for requirement in required for atom in r.expressions(requirement.formula)]
        self._atoms = tuple(atoms)

    @cached_property
    def tick_s(self) -> Fraction:
        """The base tick of the whole system."""
        return base_tick(1 / each.rate_hz for each in self.facts.system.subsystems)

    @cached_property
    def cuts(self) -> frozenset[float]:
        """The numbers that stand in comparisons, the bounds of regions."""
        return frozenset(self._compared())

    def _compared(self) -> Iterator[float]:
        system = self.facts.system
        known = Known({}, {}, Fraction(1))
        for item in system.constants:
            constants = {**known.constants, item.name: filled(item.value, known)}
            known = Known({}, constants, known.period_s)
        yield from _compared(self._atoms, known)
        for kept in self.kept.values():
            exprs = (text.expr for text in texts(kept.subsystem))
            yield from _compared(exprs, static(kept.subsystem, system))

    def _noise(self) -> set[tuple[str, InputName]]:
        found: set[tuple[str, InputName]] = set()
        before = -1
        while before < len(found):
            before = len(found)
            for reader, kept in self.kept.items():
                for key in kept.machine.availability.fresh:
                    sent = self.sender_of(reader, key)
                    if sent and self._is_measured(*sent, found):
                        found.add((reader, key))
        return found

    def _is_measured(self, sender: str, key: InputName, noise: set[tuple[str, InputName]]) -> bool:
        """Whether every value of an output is computed from measurements."""
        kept = self.kept[sender]
        sent = [e for each in kept.subsystem.written.get(key, {}).values() for e in each]
        return bool(sent) and all(
            any(
                self.sender_of(sender, name) is None or (sender, name) in noise
                for name in kept.rests.of(expr).values
            )
            for expr in sent
        )

    @cached_property
    def measured(self) -> set[tuple[str, InputName]]:
        """Inputs, and memory without a peer, whose values are computed from measurements."""
        found = {
            (name, key)
            for name, kept in self.kept.items()
            for key in kept.subsystem.inputs
            if self.sender_of(name, key) is None
        }
        before = -1
        while before < len(found):
            before = len(found)
            for name, kept in self.kept.items():
                for item in kept.subsystem.memory:
                    if self._is_given(name, ("", item.name), item.init, found):
                        found.add((name, ("", item.name)))
                for key in kept.subsystem.inputs:
                    sent = self.sender_of(name, key)
                    if sent and self._is_given(*sent, None, found):
                        found.add((name, key))
        return found

    def _is_given(
        self, name: str, key: InputName, init: m.Expr | None, measured: set[tuple[str, InputName]]
    ) -> bool:
        """Whether some value that memory or an output gets is computed from measurements."""
        written = self.kept[name].subsystem.written.get(key, {}).values()
        exprs = [*(e for each in written for e in each), *([] if init is None else [init])]
        rests = self.kept[name].rests.all(exprs)
        read = {*rests.inputs, *(("", memory) for memory in rests.memory)}
        return rests.has_lag or any((name, key) in measured for key in read)

    def noise_within(self, reader: str, key: InputName) -> Within | None:
        """What a value lies within that is computed from measurements in every period."""
        sent = self.sender_of(reader, key)
        if sent is None or (reader, key) not in self.noise:
            return None
        sender, output = self.kept[sent[0]], sent[1]
        bounds, type_ = sender.machine.value_ranges.bounds, sender.subsystem.outputs[output].type
        exprs = [e for each in sender.subsystem.written[output].values() for e in each]
        found = [within(expr, bounds.of(expr), type_) for expr in exprs]
        if (init := self.kept[reader].subsystem.inputs[key].init) is not None:
            here = self.kept[reader].machine.value_ranges.bounds
            found.append(within(init, here.of(init), type_))
        known = [each for each in found if each is not None]
        if len(known) < len(found):
            return None
        return Within(min(each.low for each in known), max(each.high for each in known))

    def _keep(self) -> None:
        for name, kept in self.kept.items():
            subsystem = kept.subsystem
            asked = [e for s in subsystem.states for e in conditions_of(subsystem, s.name)]
            events = [
                m.Fresh(m.Input(*key, type=element.type), type=m.TRUE.type)
                for key, element in subsystem.inputs.items()
                if element.event
            ]
            self._need(name, [*asked, *(axiom.that for axiom in subsystem.axioms), *events])

    def _watch(self, reading: r.Reading) -> None:
        if reading.kind == "memory" and reading.subsystem in self.kept:
            memory = m.MemoryRef(reading.element[0], type=reading.type)
            self._need(reading.subsystem, [memory])
        elif reading.kind == "sent" and reading.subsystem in self.kept:
            kept = self.kept[reading.subsystem]
            key = reading.element[0], reading.element[1]
            kept.outputs.add(key)
            written = kept.subsystem.written.get(key, {})
            self._need(reading.subsystem, [e for each in written.values() for e in each])

    def _need(self, name: str, exprs: Iterable[m.Expr]) -> None:
        """Keep the transitive dependences of some expressions of a subsystem."""
        kept = self.kept[name]
        rests = kept.rests.all(exprs)
        for item in rests.memory - kept.memory:
            kept.memory.add(item)
            written = kept.subsystem.written.get(("", item), {})
            begin = next(i.init for i in kept.subsystem.memory if i.name == item)
            self._need(name, [begin, *(e for each in written.values() for e in each)])
        for key in rests.inputs - kept.inputs:
            sent = self.sender_of(name, key)
            event = kept.subsystem.inputs[key].event
            if sent is None or ((name, key) in self.noise and not event):
                continue
            kept.inputs.add(key)
            sender, output = sent
            self.kept[sender].outputs.add(output)
            written = self.kept[sender].subsystem.written.get(output, {})
            self._need(sender, [e for each in written.values() for e in each])

    def is_steady(self, reader: str, key: InputName) -> bool:
        """Whether an input that is not kept is fresh in every period after the first."""
        if (reader, key) in self.noise:
            return True
        bindings = {(b.binding.device, b.binding.element): b.binding for b in self.facts.bindings}
        subsystem = self.kept[reader].subsystem
        bound = bindings.get((self.facts.wires.measured(reader, key[0]), key[1]))
        if bound is None or bound.sporadic:
            return False
        return bound.rate_hz is None or bound.rate_hz >= subsystem.rate_hz

    def cone(self, name: str) -> Cone:
        """The cone of a machine."""
        if name not in self._cones:
            self._cones[name] = self._cone(name, self.kept[name])
        return self._cones[name]

    def _cone(self, name: str, kept: Kept) -> Cone:
        subsystem, within = kept.subsystem, dict(kept.memory_within())
        failing = set[str]()
        for let in subsystem.lets:  # in order of dependence
            failing |= {let.name} if may_fail(let.value, failing) else set()
        states = tuple(_state(kept, state, failing) for state in subsystem.states)
        inputs = tuple(
            ConeInput(
                key,
                element.type,
                element.init if key in kept.inputs else None,
                is_event=element.event,
                is_followed=key in kept.inputs,
                is_measured=self.sender_of(name, key) is None,
                is_steady=key not in kept.inputs and self.is_steady(name, key),
                within=None if key in kept.inputs else self.noise_within(name, key),
            )
            for key, element in subsystem.inputs.items()
        )
        memory = tuple(
            ConeMemory(item.name, item.type, item.init, within.get(item.name))
            for item in subsystem.memory
            if item.name in kept.memory
        )
        axioms = tuple(axiom.that for axiom in subsystem.axioms)
        exprs = [*axioms, *(item.init for item in memory), *(x.init for x in inputs if x.init)]
        exprs += [expr for state in states for expr in state.expressions]
        known = static(subsystem, self.facts.system)
        lets, constants = named_in(exprs, kept.rests, known.constants)
        return Cone(
            known.period_s,
            subsystem.initial_state,
            states,
            inputs,
            tuple((k, out.type) for k, out in subsystem.outputs.items() if k in kept.outputs),
            memory,
            lets,
            constants,
            axioms,
            frozenset(kept.machine.availability.declared),
            frozenset(key for reader, key in self.measured if reader == name),
            kept.machine.prover,
        )

    def slices(self) -> list[tuple[str, ...]]:
        """The slices: each machine that decides, with all machines that influence it."""
        every = [set(self.around([name])) for name, kept in self.kept.items() if kept.decides]
        largest = [s for s in every if not any(s < other for other in every)]
        return list(dict.fromkeys(_ordered(names) for names in largest))

    def around(self, names: Iterable[str]) -> tuple[str, ...]:
        """Some machines with all machines that influence them."""

        def influences(name: str) -> list[str]:
            sent = (self.sender_of(name, key) for key in sorted(self.kept[name].inputs))
            return [one[0] for one in sent if one]

        return _ordered(reachable([n for n in names if n in self.kept], influences))


def _ordered(names: Iterable[str]) -> tuple[str, ...]:
    """The machines by name: of equally easy traces, the order in the file chooses none."""
    return tuple(sorted(names))


def _compared(exprs: Iterable[m.Expr], known: Known) -> Iterator[float]:
    for node in (node for expr in exprs for node in m.walk(expr)):
        for side in (node.left, node.right) if isinstance(node, m.Compare) else ():
            value = filled(side, known)
            if isinstance(value, m.Number):
                yield value.value
