"""Where values come from: flow through a subsystem, and samples behind it."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import cached_property
from operator import eq
from typing import NamedTuple

from specc.analysis.facts import Facts
from specc.analysis.guards import Guards, Implied
from specc.analysis.words import below
from specc.model.expr import Expr, Fresh, Input
from specc.model.fsm import State
from specc.model.system import Binding, Device, Element, Subsystem
from specc.proof import InputName
from specc.source import Place

# Which inputs of the same period the value of an expression is computed from.


InputNames = frozenset[InputName]


class Read(NamedTuple):
    """An input whose value counts, with `on_arrival` only in periods that find it fresh."""

    input: InputName
    on_arrival: bool


class Flow:
    """Follows the expressions of a subsystem through its lets; memory is not followed."""

    def __init__(self, subsystem: Subsystem) -> None:
        lets = {item.name: item for item in subsystem.lets}
        asked = Implied(lets, _asked)
        # Each way to a let counts: what is read where it is fresh may be older than elsewhere.
        self._guards = Guards[InputNames](lets, lambda fresh, *test: fresh | asked.by(*test), eq)

    def reads(self, expr: Expr) -> frozenset[Read]:
        """What the value of `expr` depends on."""
        parts = self._guards.parts(expr, frozenset())
        inputs = ((part, fresh) for part, fresh, _ in parts if isinstance(part, Input))
        names = (((part.peer, part.element), fresh) for part, fresh in inputs)
        return frozenset(Read(name, name in fresh) for name, fresh in names)


def _asked(expr: Expr, holds: bool) -> InputNames:
    """The input that must be fresh where a condition holds."""
    if holds and isinstance(expr, Fresh):
        return frozenset(((expr.input.peer, expr.input.element),))
    return frozenset()


# Where the values of inputs come from: who computes them, when, and from which other inputs.


class Node(NamedTuple):
    """An element of an input buffer: of a subsystem, or with the peer "" of a device."""

    reader: str
    peer: str
    element: str

    def __str__(self) -> str:
        return f"{self.short} of {self.reader}" if self.peer else self.short

    @property
    def short(self) -> str:
        """The element as its reader calls it, or with the whole name of a device."""
        if not self.peer:
            return f"{self.reader}.{self.element}"
        return f"x.{self.peer}.{self.element}"


class Sent(NamedTuple):
    """An element that a subsystem computes, from `reads` of its own.

    `silent` is a state, of those that the subsystem enters, in which it does not send it.
    """

    sender: Subsystem
    reads: tuple[tuple[Node, bool], ...]
    silent: State | None


class Measured(NamedTuple):
    """An element that a device reports.

    `period_s` are the seconds between samples, 0 without a rate; for a `sporadic` one the longest
    time without a sample, 0 if that is not known. `shared` tells whether it has several readers.
    """

    device: str
    period_s: Fraction
    place: Place
    sporadic: bool = False
    shared: bool = False

    @property
    def unlimited(self) -> bool:
        """Whether there may be no new sample for an unlimited time."""
        return self.sporadic and not self.period_s


class Sources:
    """The data flow between the subsystems of a system."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._flows: dict[str, Flow] = {}
        self._running: dict[str, dict[str, State]] = {}
        self._found: dict[Node, Sent | Measured | None] = {}

    def of(self, node: Node) -> Sent | Measured | None:
        """Where a value comes from; None if that is not known."""
        if node not in self._found:
            self._found[node] = self._sent(node) or self._measured(node)
        return self._found[node]

    def own_reads(self, subsystem: Subsystem) -> frozenset[Read]:
        """The inputs whose values the machine of a subsystem uses in the states that it enters."""
        flow, found = self._flow(subsystem), set[Read]()
        reached = self._facts.reached(subsystem)
        for state in subsystem.states:
            if state.name in reached:
                behaviour = state.behaviour
                values = [a.value for a in behaviour.assignments]
                values += [behaviour.terminal.when, behaviour.error.when]
                for value in values:
                    found |= flow.reads(value)
        for row in subsystem.transitions:
            if row.source in reached:
                found |= flow.reads(row.condition.when)
        return frozenset(found)

    def _flow(self, subsystem: Subsystem) -> Flow:
        return self._flows.setdefault(subsystem.qualified_name, Flow(subsystem))

    def _sent(self, node: Node) -> Sent | None:
        found = self._sender(node)
        if found is None or found[0].qualified_name in self._facts.broken | self._facts.faulty:
            return None
        sender, peer = found
        running = self._runs(sender)
        written = sender.written.get((peer, node.element), {})
        silent = next((state for name, state in running.items() if name not in written), None)
        reads: set[tuple[Node, bool]] = set()
        for name in written.keys() & running.keys():
            for value in written[name]:
                reads |= set(self._nodes(sender, value_reads=self._flow(sender).reads(value)))
        return Sent(sender, tuple(sorted(reads)), silent)

    def _runs(self, subsystem: Subsystem) -> dict[str, State]:
        """The behaviours that run, each with the first state that it runs in."""
        name = subsystem.qualified_name
        if name not in self._running:
            reached = self._facts.reached(subsystem)
            first = self._running[name] = {}
            for state in subsystem.states:
                if state.name in reached:
                    first.setdefault(state.behaviour.name, state)
        return self._running[name]

    def _nodes(
        self, sender: Subsystem, value_reads: frozenset[Read]
    ) -> Iterator[tuple[Node, bool]]:
        for read in value_reads:
            yield Node(sender.qualified_name, *read.input), read.on_arrival

    def _sender(self, node: Node) -> tuple[Subsystem, str] | None:
        """The subsystem that sends to a node, and its name for the buffer."""
        connections = self._facts.connections
        if not node.peer:
            return self._drivers.get(node.reader)
        reader = connections.subsystems.get(node.reader)
        port = reader.port("x", node.peer) if reader else None
        end = connections.other_port(reader, port) if reader and port else None
        return (connections.subsystems[port.other_end], end.peer) if port and end else None

    @cached_property
    def _drivers(self) -> dict[str, tuple[Subsystem, str]]:
        """The subsystem that commands each device."""
        return {
            port.other_end: (subsystem, port.peer)
            for subsystem in self._facts.subsystems
            for port in subsystem.ports
            if port.direction == "y" and port.other_end in self._facts.connections.devices
        }

    def _measured(self, node: Node) -> Measured | None:
        connections = self._facts.connections
        reader = connections.subsystems.get(node.reader)
        port = reader.port("x", node.peer) if reader and node.peer else None
        device = connections.devices.get(port.other_end) if port else None
        element = next((e for e in device.y if e.name == node.element), None) if device else None
        if device is None or element is None:
            return None
        for bound in self._facts.bindings:
            binding = bound.binding
            name = binding.device, binding.element
            if name != (device.qualified_name, node.element):
                continue
            if binding.sporadic:
                return self._sporadic(node.element, device, binding)
            if binding.rate_hz is not None:
                place = below(binding.place, "rate")
                return Measured(device.qualified_name, 1 / binding.rate_hz, place)
        return Measured(device.qualified_name, Fraction(0), element.place)

    def _sporadic(self, element: str, device: Device, binding: Binding) -> Measured:
        gap_s, place = binding.max_gap_s, below(binding.place, "sporadic")
        ports = (p for s in self._facts.system.subsystems for p in s.ports if p.direction == "x")
        readers = [p for p in ports if p.other_end == device.qualified_name and p.element(element)]
        return Measured(
            device.qualified_name, gap_s or Fraction(0), place, True, shared=len(readers) > 1
        )


def bounded(facts: Facts) -> Iterator[tuple[Node, Element]]:
    """The elements whose age their readers limit."""
    for node, element in received(facts):
        if element.max_age_s is not None:
            yield node, element


def received(facts: Facts) -> Iterator[tuple[Node, Element]]:
    """All elements that subsystems and devices receive, those with errors in them left out."""
    for subsystem in facts.subsystems:
        for port in subsystem.ports:
            for element in port.elements if port.direction == "x" else ():
                yield Node(subsystem.qualified_name, port.peer, element.name), element
    for device in facts.system.devices:
        if device.qualified_name not in facts.broken:
            for element in device.x:
                yield Node(device.qualified_name, "", element.name), element
