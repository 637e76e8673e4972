"""Where values come from: flow through a subsystem, and samples behind it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from specc.analysis.graph import CAUSES
from specc.analysis.guards import Guards, ImpliedFacts
from specc.analysis.machine import Machine
from specc.analysis.plant import BoundElement
from specc.model.expr import Expr, Fresh, Input
from specc.model.fsm import State
from specc.model.system import Subsystem
from specc.model.wires import Output, Wires
from specc.proof import InputName, InputNames
from specc.reachable import reachable
from specc.source import Place

# Which inputs of the same period the value of an expression is computed from.


class Read(NamedTuple):
    """An input whose value counts, with `on_arrival` only in periods that find it fresh."""

    input: InputName
    on_arrival: bool


class Reads:
    """What a machine reads in the states that it enters; memory is not followed."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        lets = machine.subsystem.lets
        asked = ImpliedFacts(lets, _fresh_input)
        self._guards = Guards[InputNames](
            lets, lambda fresh, *test: fresh | asked.by(*test), frozenset.intersection
        )

    def of(self, expr: Expr) -> frozenset[Read]:
        """What the value of `expr` depends on."""
        parts = self._guards.parts(expr, frozenset())
        inputs = ((part.key, fresh) for part, fresh, _ in parts if isinstance(part, Input))
        return frozenset(Read(name, name in fresh) for name, fresh in inputs)

    @cached_property
    def own(self) -> frozenset[Read]:
        """The inputs whose values the machine uses."""
        found = [
            read(state)
            for state in self.states
            for read in (self.read_by_conditions, self.read_by_functions)
        ]
        return frozenset[Read]().union(*found)

    def read_by_conditions(self, state: State) -> frozenset[Read]:
        """The inputs whose values the conditions depend on that may end a state."""
        rows = (self._machine.subsystem.rows(state.name, cause) for cause in CAUSES)
        ends = (state.behaviour.terminal.when, state.behaviour.error.when)
        entered = [row.condition.when for of_cause in rows for _, row in of_cause]
        return frozenset[Read]().union(*map(self.of, (*ends, *entered)))

    def read_by_functions(self, state: State) -> frozenset[Read]:
        """The inputs whose values the functions of a state depend on."""
        values = (item.value for item in state.behaviour.assignments)
        return frozenset[Read]().union(*map(self.of, values))

    @property
    def states(self) -> list[State]:
        """Those that the machine enters."""
        return [s for s in self._machine.subsystem.states if s.name in self._machine.reached]


def _fresh_input(expr: Expr, holds: bool) -> InputNames:
    """The input that must be fresh where a condition holds."""
    if holds and isinstance(expr, Fresh):
        return frozenset((expr.input.key,))
    return frozenset()


# Where the values of inputs come from: who computes them, when, and from which other inputs.


class InputNode(NamedTuple):
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


ReadEdge = tuple[InputNode, bool]
"""An input that a value is computed from, and whether only where it is fresh."""


@dataclass(frozen=True, slots=True)
class Sent:
    """An element that a subsystem computes, from `reads` of its own.

    `silent` is a state, of those that the subsystem enters, in which it does not send it.
    """

    sender: Subsystem
    reads: tuple[ReadEdge, ...]
    silent: State | None


@dataclass(frozen=True, slots=True)
class Measured:
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


_NOBODY: Output = "", ("", "")


class DataFlow:
    """The data flow between the subsystems of a system."""

    def __init__(
        self,
        wires: Wires,
        machines: Mapping[str, Machine],
        bindings: Sequence[BoundElement],
    ) -> None:
        """`machines` are the subsystems without errors, by their qualified names."""
        self._wires = wires
        self._machines = machines
        self._bindings = bindings
        self._reads = {name: Reads(machine) for name, machine in machines.items()}
        self._found: dict[InputNode, Sent | Measured | None] = {}
        self._sent_in: dict[InputNode, dict[str, frozenset[ReadEdge]]] = {}

    def of(self, node: InputNode) -> Sent | Measured | None:
        """Where a value comes from; None if that is not known."""
        if node not in self._found:
            self._found[node] = self._sent(node) or self._measured(node)
        return self._found[node]

    def only_on_arrival(self, node: InputNode) -> bool:
        """Whether a subsystem uses a value only where it is fresh."""
        reads = self._reads.get(node.reader)
        own = [read for read in reads.own if read.input == node[1:]] if reads else []
        return bool(own) and all(read.on_arrival for read in own)

    def reads_of(self, subsystem: str) -> Reads | None:
        """What a subsystem reads; None if it has errors."""
        return self._reads.get(subsystem)

    def sent_in(self, node: InputNode) -> dict[str, frozenset[ReadEdge]]:
        """State of the sender in which it sends a value -> what the value is computed from."""
        if node not in self._sent_in:
            self._sent_in[node] = dict(self._sending(node))
        return self._sent_in[node]

    def _sending(self, node: InputNode) -> Iterator[tuple[str, frozenset[ReadEdge]]]:
        sender, output = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None or machine.faulty:
            return
        written = machine.subsystem.assigned_values.get(output, {})
        edges = {name: self._edges(sender, values) for name, values in written.items()}
        for state in self._reads[sender].states:
            if state.behaviour.name in edges:
                yield state.name, edges[state.behaviour.name]

    def _edges(self, sender: str, values: Iterable[Expr]) -> frozenset[ReadEdge]:
        """What values of a subsystem are computed from."""
        found = (read for value in values for read in self._reads[sender].of(value))
        return frozenset((InputNode(sender, *read.input), read.on_arrival) for read in found)

    def _sent(self, node: InputNode) -> Sent | None:
        sender, _ = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None or machine.faulty:
            return None
        sent = self.sent_in(node)
        silent = (state for state in self._reads[sender].states if state.name not in sent)
        edges = frozenset[ReadEdge]().union(*sent.values())
        return Sent(machine.subsystem, tuple(sorted(edges)), next(silent, None))

    def remembered(self, node: InputNode) -> Iterator[tuple[str, InputNode]]:
        """Memory out of which a value comes, directly or not, with each input that goes into it."""
        sender, output = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None:
            return
        written, dependences = machine.subsystem.assigned_values, machine.dependences

        def assigned(target: tuple[str, str]) -> list[Expr]:
            return [value for values in written.get(target, {}).values() for value in values]

        def named(target: tuple[str, str]) -> list[tuple[str, str]]:
            return [("", name) for name in sorted(dependences.all(assigned(target)).memory)]

        for memory in reachable(named(output), named):
            for source, _ in sorted(self._edges(sender, assigned(memory))):
                yield memory[1], source

    def sender(self, node: InputNode) -> Output | None:
        """The output that is sent to a node; None if none is."""
        return self._wires.sender(node.reader, node[1:])

    def _measured(self, node: InputNode) -> Measured | None:
        device = self._wires.devices.get(self._wires.measuring_device(node.reader, node.peer))
        element = next((e for e in device.y if e.name == node.element), None) if device else None
        if device is None or element is None:
            return None
        name = device.qualified_name
        for bound in self._bindings:
            binding = bound.binding
            if (binding.device, binding.element) != (name, node.element):
                continue
            if binding.sporadic:
                gap_s, place = binding.max_gap_s or Fraction(0), binding.place.below("sporadic")
                return Measured(name, gap_s, place, True, self._is_shared(name, node.element))
            if binding.rate_hz is not None:
                return Measured(name, 1 / binding.rate_hz, binding.place.below("rate"))
        return Measured(name, Fraction(0), element.place)

    def _is_shared(self, device: str, element: str) -> bool:
        """Whether several subsystems read what a device reports."""
        return len(self._wires.wires_of_element(device, "x", element)) > 1
