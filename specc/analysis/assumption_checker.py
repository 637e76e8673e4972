"""Assumptions about arrival, compared with what senders send in one of their periods.

A sender that is not faster than its reader sends at most once between two time stamps of the
reader: what arrives there is what one of its behaviours sends, or nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, product
from math import prod
from typing import Literal

from specc.analysis.machine import Machine
from specc.model.expr import negation
from specc.model.fsm import Axiom, State
from specc.model.system import Subsystem
from specc.model.wires import Wires
from specc.proof import InputName, freshness

_MOST = 256
"""Combinations of what several senders may send that are looked at."""

Grounds = Literal["", "proved", "broken"]


@dataclass(frozen=True, slots=True)
class JointArrival:
    """Inputs that may arrive together from one sender: those that a state of it sends, or none.

    From a `slower` sender nothing arrives in some periods.
    """

    state: State | None
    inputs: frozenset[InputName]
    slower: Subsystem | None = None


@dataclass(frozen=True, slots=True)
class SenderVerdict:
    """Whether senders prove an assumption, one of them breaks it, or neither (`""`).

    The sender that breaks it has a `state` that sends what the assumption excludes, whatever other
    senders send, or is `slower` than the reader while the assumption excludes silence.
    """

    grounds: Grounds
    state: State | None = None
    slower: Subsystem | None = None


class AssumptionChecker:
    """Checks the assumptions of subsystems against what is sent to them."""

    def __init__(self, wires: Wires, machines: dict[str, Machine]) -> None:
        """`machines` by the qualified names of their subsystems."""
        self._wires = wires
        self._machines = machines

    def check_assumption(self, machine: Machine, axiom: Axiom) -> SenderVerdict:
        """The verdict of the senders of a machine on one of its assumptions."""
        tested = machine.dependences.of(axiom.that).arrivals
        if not tested:
            return SenderVerdict("")
        cases = [list(each) for each in self._cases(machine.subsystem, tested)]
        if not cases or prod(map(len, cases)) > _MOST:
            return SenderVerdict("")
        known = frozenset(name for each in cases for one in each for name in one.inputs)
        ways = list[tuple[tuple[JointArrival, ...], bool | None, bool | None]]()
        for way in product(*cases):
            new = frozenset[InputName]().union(*(one.inputs for one in way))
            context = [
                freshness(name) if name in new else negation(freshness(name))
                for name in sorted(tested & known)
            ]
            holds = machine.prover.implies(context, axiom.that, assuming=False)
            never = negation(axiom.that)
            fails = not holds and machine.prover.implies(context, never, assuming=False)
            ways.append((way, holds, fails))
        # What takes states of several senders may never happen; none of them breaks it by itself.
        for one in chain.from_iterable(cases):
            certain = one.state or one.slower
            if certain and all(fails for way, _, fails in ways if any(one is w for w in way)):
                return SenderVerdict("broken", one.state, one.slower)
        tautology = machine.prover.implies((), axiom.that, assuming=False)
        return SenderVerdict(
            "proved" if all(holds for _, holds, _ in ways) and not tautology else ""
        )

    def _cases(
        self, reader: Subsystem, tested: frozenset[InputName]
    ) -> Iterator[list[JointArrival]]:
        """For each sender with known sending times, the inputs that may arrive together."""
        for wire in self._wires.wires_of(reader):
            port, sender = wire.port, self._machines.get(wire.peer_name)
            mine = {(port.peer, element.name) for element in port.elements}
            about = any(peer == port.peer for peer, _ in tested)
            if port.direction != "x" or not about or sender is None or not wire.peer_port:
                continue
            subsystem = sender.subsystem
            timed = reader.has_rate and subsystem.has_rate and subsystem.rate_hz <= reader.rate_hz
            is_known = all(state.behaviour.is_complete for state in subsystem.states)
            if not (timed and is_known and subsystem.states):
                continue
            found = dict[frozenset[InputName], JointArrival]()
            for state in subsystem.states:
                if state.name in sender.reachable_states:
                    names = wire.inputs_sent_by(state.behaviour) & mine & tested
                    found.setdefault(names, JointArrival(state, names))
            # Of the same rate, and never silent: something arrives in every period.
            slower = subsystem if subsystem.rate_hz < reader.rate_hz else None
            if slower or frozenset() in found:
                found[frozenset()] = JointArrival(None, frozenset(), slower)
            # What none of them sends never arrives.
            yield list(found.values())
