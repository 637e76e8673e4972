"""Where the last value of an output goes while its sender sends nothing more."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.analysis.dataflow import Reads
from specc.analysis.facts import Facts
from specc.analysis.graph import RowEdge
from specc.analysis.guards import Guards, ImpliedFacts
from specc.analysis.machine import Machine
from specc.model.expr import Choice, Clock, Expr, Fresh, Input, Lag, MemoryRef, Present
from specc.model.fsm import Condition, State
from specc.model.system import Device, Element, Subsystem
from specc.model.types import ListOf, Type, within
from specc.model.units import AMPERE, METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND
from specc.proof import InputName, InputNames

# Values that make something move or push for as long as they stay.


_MOVING = {METRE / SECOND, RADIAN / SECOND, NEWTON, NEWTON_METRE, AMPERE}


def moves(type: Type) -> bool:
    """Whether a value has a speed, a force or a current, and no place where the motion ends."""
    parts = within([type])
    units = {unit for part in parts for unit in part.units}
    several = any(isinstance(part, ListOf) for part in parts)
    return bool(units & _MOVING) and not several and not names_a_place(type)


def names_a_place(type: Type) -> bool:
    """Whether a value may say where a motion ends, as a length, an angle or a pose does."""
    leaves = (part for part in within([type]) if not part.parts and not part.is_discrete)
    return any(not leaf.units or {METRE, RADIAN} & {*leaf.units} for leaf in leaves)


# The way of a value that stays the same, to a device.


@dataclass(frozen=True, slots=True)
class ValuePath:
    """Subsystems that pass a value on in every period, until it reaches `element` of `device`.

    A new value of one of `stops`, elements of the same buffer as the output, may end that.
    """

    through: tuple[Subsystem, ...]
    device: Device
    element: Element
    stops: frozenset[str]


def path_to_device(
    facts: Facts,
    sender: Subsystem,
    output: InputName,
    unsent: frozenset[str],
    passed: tuple[Subsystem, ...] = (),
) -> ValuePath | None:
    """How an output reaches a device while its value stays the same; None if it does not.

    `unsent` are the elements of its buffer that are not sent meanwhile, often with the output.
    `passed` are the subsystems before the sender.
    """
    wires = facts.wires.of(sender)
    wire = next(w for w in wires if (w.port.direction, w.port.peer) == ("y", output[0]))
    if wire.device is not None:
        found = (e for e in wire.device.x if e.name == output[1] and moves(e.type))
        return next((ValuePath((), wire.device, e, frozenset()) for e in found), None)
    reader = wire.other
    if reader is None or wire.end is None or reader in (*passed, sender):
        return None
    reads = facts.ages.sources.reads_of(reader.qualified_name)
    if reads is None or not facts.of(reader).is_whole:
        return None
    peer = wire.end.peer
    held = frozenset((peer, name) for name in unsent)
    relay = _Relay(facts, facts.of(reader), reads, (peer, output[1]), held)
    for further, states in relay.outputs():
        rest = path_to_device(
            facts, reader, further, unsent_in(reader, states, further[0]), (*passed, sender)
        )
        if rest is not None:
            stops = relay.stops(further, states)
            return ValuePath((reader, *rest.through), rest.device, rest.element, stops)
    return None


def unsent_in(sender: Subsystem, states: Iterable[State], peer: str) -> frozenset[str]:
    """The elements of an output buffer that a subsystem sends in none of some states."""
    sent = {item.name for s in states for item in s.behaviour.assignments if item.peer == peer}
    return frozenset(name for to, name in sender.outputs if to == peer and name not in sent)


class _Relay:
    """A subsystem that receives a value that stays the same."""

    def __init__(
        self, facts: Facts, machine: Machine, reads: Reads, origin: InputName, held: InputNames
    ) -> None:
        """The value is that of the input `origin`.

        Nothing new comes in the inputs that are `held`. The origin is one of them, unless its value
        is sent again and again.
        """
        self._wires = facts.wires
        self._machine = machine
        self._reads = reads
        self._origin = origin
        self._held = held
        lets = machine.subsystem.lets
        self._implied = ImpliedFacts(lets, self._missing)
        self._guards = Guards[InputNames](
            lets, lambda missing, *test: missing | self._implied.by(*test), frozenset.intersection
        )

    def _missing(self, condition: Expr, holds: bool) -> InputNames:
        """The input that is not as it would have to be for a condition to hold, or not to hold."""
        match condition:
            case Fresh(input=element) if holds and element.key in self._held:
                return frozenset((element.key,))
            case Present(input=element) if not holds and element.key == self._origin:
                return frozenset((element.key,))
        return frozenset()

    def outputs(self) -> Iterator[tuple[InputName, list[State]]]:
        """The outputs that stay the same with the origin, and the states that go on sending them.

        The subsystem need not leave these states, neither by time nor because nothing comes.
        """
        outputs = self._machine.subsystem.outputs
        for output in (key for key, element in outputs.items() if moves(element.type)):
            states = [state for state in self._reads.states if self._behind(state, output)]
            while left := [state for state in states if not self._may_stay(state, states)]:
                states = [state for state in states if state not in left]
            if states:
                yield output, states

    def stops(self, output: InputName, states: list[State]) -> frozenset[str]:
        """Elements that come with the origin, of which a new value may end that."""
        inputs = self._machine.subsystem.inputs
        found = {n for s in states for n in self._behind(s, output) if not moves(inputs[n].type)}
        for state in states:
            for step in self._ways_out(state, states):
                found |= self._missing_for(step)
        return frozenset(name for peer, name in found - {self._origin} if peer == self._origin[0])

    def _ways_out(self, state: State, states: list[State]) -> list[RowEdge]:
        names = {each.name for each in states}
        steps = self._machine.leaving.get(state.name, ())
        return [step for step in steps if step.row.target not in names]

    def _may_stay(self, state: State, states: list[State]) -> bool:
        """Whether every way out of some states needs what does not come, or is an accident."""
        return all(
            self._missing_for(step)
            or (step.row.cause == "error" and self._is_measured(state.behaviour.ending("error")))
            for step in self._ways_out(state, states)
        )

    def _missing_for(self, step: RowEdge) -> InputNames:
        """The inputs of which a row needs what they do not have."""
        ended = self._machine.subsystem.state(step.row.source).behaviour.ended(step.row.cause)
        tests = *ended, (step.row.condition.when, True)
        return frozenset[InputName]().union(*(self._implied.by(*test) for test in tests))

    def _is_measured(self, condition: Condition) -> bool:
        """Whether a condition follows from measurements alone."""
        found = self._machine.dependences.of(condition.when)
        others = found.clock or found.lags or found.arrivals or found.memory
        return bool(found.values) and not others and all(map(self._device, found.values))

    def _device(self, key: InputName) -> bool:
        name = self._machine.subsystem.qualified_name
        return bool(self._wires.measured(name, key[0]))

    def _behind(self, state: State, output: InputName) -> InputNames:
        """The inputs behind an output that stays as it is in a state because the origin does.

        Nothing if it does not: if time, a new value, or a place that is measured changes it.
        """
        assigned = {(a.peer, a.name): a.value for a in state.behaviour.assignments}
        pending = [assigned[output]] if output in assigned else []
        remembered: set[str] = set()
        found: set[InputName] = set()
        for value in pending:  # it grows
            for part, missing, _ in self._guards.parts(value, frozenset()):
                if missing:
                    continue
                if not self._stays(part, assigned):
                    return frozenset()
                if isinstance(part, Input):
                    found.add(part.key)
                elif isinstance(part, MemoryRef) and part.name not in remembered:
                    remembered.add(part.name)
                    value = assigned.get(("", part.name), part)
                    if part in self._results(value):
                        found |= self._remembered(part.name) & {self._origin}
                    pending += [value] if value is not part else []
        return frozenset(found) if self._origin in found else frozenset()

    def _results(self, value: Expr) -> Iterator[Expr]:
        """What a value may be where nothing new comes: of choices the branches."""
        missing = {id(part): why for part, why, _ in self._guards.parts(value, frozenset())}
        through = self._machine.prover.numbering.resolve
        pending = [value]
        for result in map(through, pending):  # it grows
            if isinstance(result, Choice):
                branches = result.then, result.otherwise
                pending += [each for each in branches if not missing.get(id(each))]
            else:
                yield result

    def _stays(self, part: Expr, assigned: dict[InputName, Expr]) -> bool:
        """Whether a part of a value does not change by itself."""
        match part:
            case Clock(name=name):
                return name == "period"
            case Lag():
                return False
            case Fresh(input=element):
                return element.key in self._held
            case Choice(test=test):
                return not any(map(self._device, self._machine.dependences.of(test).values))
            case Input(key=key) if self._device(key):
                return moves(part.type)
            case Input(peer=peer, key=key):
                is_held = key in self._held and not names_a_place(part.type)
                return is_held or (peer == self._origin[0] and moves(part.type))
            case MemoryRef(name=name):
                is_constant = ("", name) not in assigned
                return not names_a_place(part.type) and (is_constant or moves(part.type))
        return True

    def _remembered(self, memory: str) -> InputNames:
        """The inputs that some state puts into memory."""
        written = self._machine.subsystem.written.get(("", memory), {})
        values = [value for several in written.values() for value in several]
        return frozenset(read.input for value in values for read in self._reads.of(value))
