"""States that do not send a speed, a force or a current, so that a device keeps the last one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.analysis import Facts, Machine
from specc.analysis.dataflow import Reads
from specc.analysis.graph import RowEdge
from specc.analysis.path_conditions import Guards, ImpliedFacts
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.model.expr import (
    Choice,
    Clock,
    Expr,
    Fresh,
    Input,
    Items,
    Lag,
    MemoryRef,
    Nothing,
    Present,
    Unused,
)
from specc.model.fsm import State
from specc.model.system import Device, Element, Subsystem
from specc.model.types import ListOf, Type, nested_types
from specc.model.units import AMPERE, METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND
from specc.proof import InputName, InputNames
from specc.reachable import grouped, reachable

# Values that make something move or push for as long as they stay.


_MOVING = {METRE / SECOND, RADIAN / SECOND, NEWTON, NEWTON_METRE, AMPERE}


def is_motion(type: Type) -> bool:
    """Whether a value is a speed, a force or a current, and no position where motion ends."""
    parts = nested_types([type])
    units = {unit for part in parts for unit in part.units}
    several = any(isinstance(part, ListOf) for part in parts)
    return bool(units & _MOVING) and not several and not is_position(type)


def is_position(type: Type) -> bool:
    """Whether a value may be a position where motion ends: a length, an angle or a pose."""
    leaves = (part for part in nested_types([type]) if not part.parts and not part.is_discrete)
    return any(not leaf.units or {METRE, RADIAN} & {*leaf.units} for leaf in leaves)


# The way of a value that stays the same, to a device.


@dataclass(frozen=True, slots=True)
class ValuePath:
    """Subsystems that pass a value on in every period, until it reaches `element` of `device`.

    A new value of one of `interrupting`, elements of the output's buffer, may end that.
    """

    through: tuple[Subsystem, ...]
    device: Device
    element: Element
    interrupting: frozenset[str]


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
    wires = facts.wires.wires_of(sender)
    wire = next(w for w in wires if (w.port.direction, w.port.peer) == ("y", output[0]))
    if wire.peer_device is not None:
        found = (e for e in wire.peer_device.x if e.name == output[1] and is_motion(e.type))
        return next((ValuePath((), wire.peer_device, e, frozenset()) for e in found), None)
    reader = wire.peer_subsystem
    if reader is None or wire.peer_port is None or reader in (*passed, sender):
        return None
    reads = facts.ages.sources.reads_of(reader.qualified_name)
    if reads is None or not facts.of(reader).is_complete:
        return None
    peer = wire.peer_port.peer
    silent = frozenset((peer, name) for name in unsent)
    relay = _Relay(facts, facts.of(reader), reads, (peer, output[1]), silent)
    for further, states in relay.constant_outputs():
        rest = path_to_device(
            facts, reader, further, unsent_in(reader, states, further[0]), (*passed, sender)
        )
        if rest is not None:
            stops = relay.interrupting_elements(further, states)
            return ValuePath((reader, *rest.through), rest.device, rest.element, stops)
    return None


def unsent_in(sender: Subsystem, states: Iterable[State], peer: str) -> frozenset[str]:
    """The elements of an output buffer that a subsystem sends in none of some states."""
    sent = {item.name for s in states for item in s.behaviour.assignments if item.peer == peer}
    return frozenset(name for to, name in sender.outputs if to == peer and name not in sent)


class _Relay:
    """A subsystem that receives a value that stays the same."""

    def __init__(
        self, facts: Facts, machine: Machine, reads: Reads, origin: InputName, silent: InputNames
    ) -> None:
        """The value is that of the input `origin`.

        Nothing new arrives in `silent` inputs. The origin is one of them, unless its value is sent
        again and again.
        """
        self._wires = facts.wires
        self._machine = machine
        self._reads = reads
        self._origin = origin
        self._silent_inputs = silent
        lets = machine.subsystem.lets
        self._implied = ImpliedFacts(lets, self._missing_input)
        self._guards = Guards[InputNames](
            lets, lambda missing, *test: missing | self._implied.of(*test), frozenset.intersection
        )

    def _missing_input(self, condition: Expr, holds: bool) -> InputNames:
        """The input that prevents a condition, or its negation."""
        match condition:
            case Fresh(input=element) if holds and element.key in self._silent_inputs:
                return frozenset((element.key,))
            case Present(input=element) if not holds and element.key == self._origin:
                return frozenset((element.key,))
        return frozenset()

    def constant_outputs(self) -> Iterator[tuple[InputName, list[State]]]:
        """Yield outputs that stay constant with the origin, and the states that send them.

        The subsystem need not leave these states, neither by time nor because nothing comes.
        """
        outputs = self._machine.subsystem.outputs
        for output in (key for key, element in outputs.items() if is_motion(element.type)):
            states = [
                state for state in self._reads.reachable_states if self._sources(state, output)
            ]
            while leaving := [state for state in states if self._must_leave(state, states)]:
                states = [state for state in states if state not in leaving]
            if states:
                yield output, states

    def interrupting_elements(self, output: InputName, states: list[State]) -> frozenset[str]:
        """The elements of the origin's buffer whose new values may end this."""
        inputs = self._machine.subsystem.inputs
        found = {
            n for s in states for n in self._sources(s, output) if not is_motion(inputs[n].type)
        }
        for state in states:
            for step in self._ways_out(state, states):
                found |= self._missing_for_row(step)
        return frozenset(name for peer, name in found - {self._origin} if peer == self._origin[0])

    def _ways_out(self, state: State, states: list[State]) -> list[RowEdge]:
        names = {each.name for each in states}
        steps = self._machine.successors.get(state.name, ())
        return [step for step in steps if step.row.target not in names]

    def _must_leave(self, state: State, states: list[State]) -> bool:
        """Whether a row out of some states needs no missing input, and is no measured error."""
        errors = [error.when for _, error in state.behaviour.errors]
        on = self._machine.dependences.all(errors)
        others = on.has_clock or on.has_lag or on.arrivals or on.memory
        is_accident = bool(on.values) and not others and all(map(self._is_from_device, on.values))
        return any(
            not self._missing_for_row(step) and not (step.row.cause != "terminal" and is_accident)
            for step in self._ways_out(state, states)
        )

    def _missing_for_row(self, step: RowEdge) -> InputNames:
        """The inputs that prevent a row."""
        ended = self._machine.subsystem.state(step.row.source).behaviour.facts_after(step.row.cause)
        tests = *ended, (step.row.condition.when, True)
        return frozenset[InputName]().union(*(self._implied.of(*test) for test in tests))

    def _is_from_device(self, key: InputName) -> bool:
        name = self._machine.subsystem.qualified_name
        return bool(self._wires.measuring_device(name, key[0]))

    def _sources(self, state: State, output: InputName) -> InputNames:
        """The inputs that an output depends on in a state.

        Empty unless the origin is one of them and the output stays the same as long as the origin
        does: time, a new value or a measured position may change it otherwise.
        """
        assigned = {(a.peer, a.name): a.value for a in state.behaviour.assignments}
        pending = [assigned[output]] if output in assigned else []
        remembered: set[str] = set()
        found: set[InputName] = set()
        for value in pending:  # it grows
            for part, missing, _ in self._guards.parts(value, frozenset()):
                if missing:
                    continue
                if not self._is_unchanged(part, assigned):
                    return frozenset()
                if isinstance(part, Input):
                    found.add(part.key)
                elif isinstance(part, MemoryRef) and part.name not in remembered:
                    remembered.add(part.name)
                    value = assigned.get(("", part.name), part)
                    if part in self._results(value):
                        written = self._machine.subsystem.assigned_values.get(("", part.name), {})
                        values = [value for several in written.values() for value in several]
                        stored = {read.input for v in values for read in self._reads.of(v)}
                        found |= stored & {self._origin}
                    pending += [value] if value is not part else []
        return frozenset(found) if self._origin in found else frozenset()

    def _results(self, value: Expr) -> Iterator[Expr]:
        """The possible results of a value while nothing new arrives, through choices."""
        missing = {id(part): why for part, why, _ in self._guards.parts(value, frozenset())}
        through = self._machine.prover.numbering.resolve
        pending = [value]
        for result in map(through, pending):  # it grows
            if isinstance(result, Choice):
                branches = result.then, result.otherwise
                pending += [each for each in branches if not missing.get(id(each))]
            else:
                yield result

    def _is_unchanged(self, part: Expr, assigned: dict[InputName, Expr]) -> bool:
        """Whether a part of a value does not change by itself."""
        match part:
            case Clock(name=name):
                return name == "period"
            case Lag():
                return False
            case Fresh(input=element):
                return element.key in self._silent_inputs
            case Choice(test=test):
                return not any(map(self._is_from_device, self._machine.dependences.of(test).values))
            case Input(key=key) if self._is_from_device(key):
                return is_motion(part.type)
            case Input(peer=peer, key=key):
                is_held = key in self._silent_inputs and not is_position(part.type)
                return is_held or (peer == self._origin[0] and is_motion(part.type))
            case MemoryRef(name=name):
                is_constant = ("", name) not in assigned
                return not is_position(part.type) and (is_constant or is_motion(part.type))
        return True


# A state without an output whose last value a device keeps, and the state that may send it last.


@dataclass(frozen=True, slots=True)
class RetainedOutput:
    """`state` does not send `output`, which `before` sent; the value goes on along `path`."""

    state: State
    output: InputName
    before: State
    path: ValuePath

    @property
    def name(self) -> str:
        """The output as functions call it."""
        return f"y.{self.output[0]}.{self.output[1]}"


class RetainedOutputs:
    """The outputs of one machine that some states send and others do not."""

    def __init__(self, facts: Facts, machine: Machine) -> None:
        self._facts = facts
        self._machine = machine
        states = machine.subsystem.states
        self._states = [state for state in states if state.name in machine.reachable_states]

    def find(self) -> Iterator[RetainedOutput]:
        """Yield retained outputs, one for each state and output not declared to be held."""
        subsystem = self._machine.subsystem
        for output, element in subsystem.outputs.items():
            written = subsystem.assigned_values.get(output, {})
            silent = [s for s in self._states if s.behaviour.name not in written]
            if not is_motion(element.type) or not silent or len(silent) == len(self._states):
                continue
            moving = {name for name, values in written.items() if any(map(self._may_move, values))}
            for state, group in self._states_to_stay_in(silent):
                if output not in state.holds:
                    yield from self._retained_output(state, group, output, moving)

    def _may_move(self, value: Expr) -> bool:
        """Whether a value may be other than zero or None."""
        value = self._machine.prover.numbering.resolve(value)
        if isinstance(value, Items):
            return any(map(self._may_move, value.items))
        zero = isinstance(value, Nothing | Unused)
        return not zero and any(self._machine.value_ranges.bounds.of(value))

    def _states_to_stay_in(self, silent: list[State]) -> Iterator[tuple[State, list[State]]]:
        """Yield states in which the machine may stay, each with the states of its cycle.

        It does not stay in a state of one period, as in a sequence of steps.
        """
        named = {state.name: state for state in silent}
        edges = [(step.row.source, step.row.target) for step in self._machine.edges]
        following = grouped((a, b) for a, b in edges if a in named and b in named)
        behind = {
            name: reachable(following.get(name, ()), lambda n: following.get(n, ()))
            for name in named
        }
        for name, state in named.items():
            group = [named[other] for other in behind[name] if name in behind[other]]
            if group or not self._machine.dwell_times.is_one_period(state):
                yield state, group or [state]

    def _retained_output(
        self, state: State, group: list[State], output: InputName, moving: set[str]
    ) -> Iterator[RetainedOutput]:
        """The output that keeps its last value in a state, if that may be other than zero."""
        own, peer = self._machine.subsystem, output[0]
        path = path_to_device(self._facts, own, output, unsent_in(own, group, peer))
        if path is None:
            return
        ends = {output, *((peer, name) for name in path.interrupting)}
        passing = {
            s.name
            for s in self._states
            if ends.isdisjoint({(item.peer, item.name) for item in s.behaviour.assignments})
        }
        following = grouped((step.row.source, step.row.target) for step in self._machine.edges)

        def onward(name: str) -> list[str]:
            return following.get(name, []) if name in passing else []

        for before in self._states:
            ways = following.get(before.name, ())
            if before.behaviour.name in moving and state.name in reachable(ways, onward):
                yield RetainedOutput(state, output, before, path)
                return


# What moves a device is sent in every state, or held on purpose.


def commands_sent(facts: Facts) -> Iterator[Diagnostic]:
    """W0420, once for each state, with all that it does not send."""
    for machine in facts.complete_machines:
        found = grouped(
            (retained.state, retained) for retained in RetainedOutputs(facts, machine).find()
        )
        for state, several in found.items():
            yield _retained_finding(machine.subsystem, state, several)


def _retained_finding(
    subsystem: Subsystem, state: State, several: list[RetainedOutput]
) -> Diagnostic:
    names = [f"`{output.name}`" for output in several]
    elements = {
        f"`{output.path.device.qualified_name}.{output.path.element.name}`" for output in several
    }
    keep, last = ("keep", "values") if len(elements) > 1 else ("keeps", "value")
    written = ", ".join(output.name for output in several)
    retained = f"{state.name}: {{behaviour: {state.behaviour.name}, holds: [{written}]}}"
    return Diagnostic(
        "W0420",
        f"state `{state.name}` does not send {join_words(names, 'and')}, so "
        f"{join_words(sorted(elements), 'and')} {keep} the last {last}",
        state.place,
        "what was sent last goes on here",
        tuple(
            dict.fromkeys(place for output in several for place in _value_path(subsystem, output))
        ),
        f"send {'them' if len(names) > 1 else 'it'} in `{state.name}` as well, 0 to stop; "
        f"if the last {last} should stay, say so: `{retained}`",
    )


def _value_path(subsystem: Subsystem, retained: RetainedOutput) -> Iterator[Related]:
    sent = next(
        a for a in retained.before.behaviour.assignments if (a.peer, a.name) == retained.output
    )
    yield Related(sent.place, f"state `{retained.before.name}` may have sent it before")
    for relay in retained.path.through:
        yield Related(relay.place, f"`{relay.qualified_name}` goes on with the last value")
    device, element = retained.path.device, retained.path.element
    yield Related(element.place, f"`{device.qualified_name}` gets it")


# What a state holds is sent in other states, and not in this one.


def held_outputs_sent(facts: Facts) -> Iterator[Diagnostic]:
    """W0421, for an output that a state declares to hold but sends, or that no state sends."""
    for machine in facts.complete_machines:
        for state in machine.subsystem.states:
            for index, output in enumerate(state.holds):
                name = f"`y.{output[0]}.{output[1]}`"
                sent = [a for a in state.behaviour.assignments if (a.peer, a.name) == output]
                if sent:
                    message = f"state `{state.name}` holds {name} and sends it"
                    related = tuple(Related(item.place, "sent here") for item in sent)
                elif output not in machine.subsystem.assigned_values:
                    message, related = (
                        f"state `{state.name}` holds {name}, which no state sends",
                        (),
                    )
                else:
                    continue
                place = state.place.below("holds", index)
                yield Diagnostic(
                    "W0421", message, place, "holds nothing", related, "delete it here"
                )
