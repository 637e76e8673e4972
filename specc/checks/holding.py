"""States that do not send a speed, a force or a current, so that a device keeps the last one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.analysis import Facts, Machine
from specc.analysis.last_values import ValuePath, moves, path_to_device, unsent_in
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import listed
from specc.model.expr import Expr, Items, Nothing, Unused
from specc.model.fsm import State
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.reachable import grouped, reachable

# A state without an output whose last value a device keeps, and the state that may send it last.


@dataclass(frozen=True, slots=True)
class HeldOutput:
    """`state` does not send `output`, which `before` sent; the value goes on along `path`."""

    state: State
    output: InputName
    before: State
    path: ValuePath

    @property
    def name(self) -> str:
        """The output as functions call it."""
        return f"y.{self.output[0]}.{self.output[1]}"


class HeldOutputs:
    """The outputs of one machine that some states send and others do not."""

    def __init__(self, facts: Facts, machine: Machine) -> None:
        self._facts = facts
        self._machine = machine
        states = machine.subsystem.states
        self._states = [state for state in states if state.name in machine.reached]

    def find(self) -> Iterator[HeldOutput]:
        """One for each state and output that it does not declare to hold."""
        subsystem = self._machine.subsystem
        for output, element in subsystem.outputs.items():
            written = subsystem.written.get(output, {})
            silent = [s for s in self._states if s.behaviour.name not in written]
            if not moves(element.type) or not silent or len(silent) == len(self._states):
                continue
            moving = {name for name, values in written.items() if any(map(self._may_move, values))}
            for state, group in self._lasting(silent):
                if output not in state.holds:
                    yield from self._held(state, group, output, moving)

    def _may_move(self, value: Expr) -> bool:
        """Whether a value may be another one than zero, or nothing."""
        value = self._machine.prover.numbering.resolve(value)
        if isinstance(value, Items):
            return any(map(self._may_move, value.items))
        zero = isinstance(value, Nothing | Unused)
        return not zero and any(self._machine.memory_facts.bounds.of(value))

    def _lasting(self, silent: list[State]) -> Iterator[tuple[State, list[State]]]:
        """States in which the machine may stay, with those among which it stays there.

        A state of one period, as in a sequence of steps, is left for the next one.
        """
        named = {state.name: state for state in silent}
        edges = [(step.row.source, step.row.target) for step in self._machine.steps]
        following = grouped((a, b) for a, b in edges if a in named and b in named)
        behind = {
            name: reachable(following.get(name, ()), lambda n: following.get(n, ()))
            for name in named
        }
        for name, state in named.items():
            group = [named[other] for other in behind[name] if name in behind[other]]
            if group or not self._machine.dwell_times.is_one_period(state):
                yield state, group or [state]

    def _held(
        self, state: State, group: list[State], output: InputName, moving: set[str]
    ) -> Iterator[HeldOutput]:
        """The output that is held in a state, if something else than zero may have been sent."""
        own, peer = self._machine.subsystem, output[0]
        path = path_to_device(self._facts, own, output, unsent_in(own, group, peer))
        if path is None:
            return
        ends = {output, *((peer, name) for name in path.stops)}
        passing = {s.name for s in self._states if ends.isdisjoint(_sent(s))}
        following = grouped((step.row.source, step.row.target) for step in self._machine.steps)

        def onward(name: str) -> list[str]:
            return following.get(name, []) if name in passing else []

        for before in self._states:
            ways = following.get(before.name, ())
            if before.behaviour.name in moving and state.name in reachable(ways, onward):
                yield HeldOutput(state, output, before, path)
                return


def _sent(state: State) -> set[InputName]:
    return {(item.peer, item.name) for item in state.behaviour.assignments}


# What moves a device is sent in every state, or held on purpose.


def commands_sent(facts: Facts) -> Iterator[Diagnostic]:
    """W0420, once for each state, with all that it does not send."""
    for machine in facts.complete_machines:
        found = grouped((held.state, held) for held in HeldOutputs(facts, machine).find())
        for state, several in found.items():
            yield _finding(machine.subsystem, state, several)


def _finding(subsystem: Subsystem, state: State, several: list[HeldOutput]) -> Diagnostic:
    names = [f"`{held.name}`" for held in several]
    elements = {f"`{held.path.device.qualified_name}.{held.path.element.name}`" for held in several}
    keep, last = ("keep", "values") if len(elements) > 1 else ("keeps", "value")
    written = ", ".join(held.name for held in several)
    held = f"{state.name}: {{behaviour: {state.behaviour.name}, holds: [{written}]}}"
    return Diagnostic(
        "W0420",
        f"state `{state.name}` does not send {listed(names, 'and')}, so "
        f"{listed(sorted(elements), 'and')} {keep} the last {last}",
        state.place,
        "what was sent last goes on here",
        tuple(dict.fromkeys(place for held in several for place in _way(subsystem, held))),
        f"send {'them' if len(names) > 1 else 'it'} in `{state.name}` as well, 0 to stop; "
        f"if the last {last} should stay, say so: `{held}`",
    )


def _way(subsystem: Subsystem, held: HeldOutput) -> Iterator[Related]:
    sent = next(a for a in held.before.behaviour.assignments if (a.peer, a.name) == held.output)
    yield Related(sent.place, f"state `{held.before.name}` may have sent it before")
    for relay in held.path.through:
        yield Related(relay.place, f"`{relay.qualified_name}` goes on with the last value")
    device, element = held.path.device, held.path.element
    yield Related(element.place, f"`{device.qualified_name}` gets it")


# What a state holds is sent in other states, and not in this one.


def held_outputs_sent(facts: Facts) -> Iterator[Diagnostic]:
    """W0421."""
    for machine in facts.complete_machines:
        for state in machine.subsystem.states:
            for index, output in enumerate(state.holds):
                yield from _without_effect(machine.subsystem, state, output, index)


def _without_effect(
    subsystem: Subsystem, state: State, output: InputName, index: int
) -> Iterator[Diagnostic]:
    name = f"`y.{output[0]}.{output[1]}`"
    sent = [a for a in state.behaviour.assignments if (a.peer, a.name) == output]
    if sent:
        message = f"state `{state.name}` holds {name} and sends it"
        related = tuple(Related(item.place, "sent here") for item in sent)
    elif output not in subsystem.written:
        message, related = f"state `{state.name}` holds {name}, which no state sends", ()
    else:
        return
    place = state.place.below("holds", index)
    yield Diagnostic("W0421", message, place, "holds nothing", related, "delete it here")


USES = (commands_sent, held_outputs_sent)
