"""Where values come from, through subsystems and from devices, and how old they are."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from math import lcm
from typing import NamedTuple

from specc.analysis.graph import components
from specc.analysis.machine import Machine
from specc.analysis.path_conditions import Guards, ImpliedFacts
from specc.analysis.plant import BoundElement
from specc.analysis.rates import LONGEST, base_tick
from specc.model.expr import Expr, Fresh, Input
from specc.model.fsm import State
from specc.model.system import Subsystem
from specc.model.wires import Output, Wires
from specc.proof import InputName, InputNames
from specc.reachable import reachable
from specc.source import Place

# The inputs of the same period that the value of an expression depends on.


class Read(NamedTuple):
    """An input that is read; with `on_arrival` only in periods in which it is fresh."""

    input: InputName
    on_arrival: bool


class Reads:
    """The inputs that a machine reads in its reachable states; memory is not followed."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        lets = machine.subsystem.lets

        def fresh_input(expr: Expr, holds: bool) -> InputNames:
            return frozenset((expr.input.key,) if holds and isinstance(expr, Fresh) else ())

        implied = ImpliedFacts(lets, fresh_input)
        self._guards = Guards[InputNames](
            lets, lambda fresh, *test: fresh | implied.of(*test), frozenset.intersection
        )

    def of(self, expr: Expr) -> frozenset[Read]:
        """The inputs that the value of `expr` depends on."""
        parts = self._guards.parts(expr, frozenset())
        inputs = ((part.key, fresh) for part, fresh, _ in parts if isinstance(part, Input))
        return frozenset(Read(name, name in fresh) for name, fresh in inputs)

    @cached_property
    def all(self) -> frozenset[Read]:
        """The inputs whose values the machine uses."""
        reads = (
            self.read_by_conditions(state) | self.read_by_functions(state)
            for state in self.reachable_states
        )
        return frozenset[Read]().union(*reads)

    def read_by_conditions(self, state: State) -> frozenset[Read]:
        """The inputs on which the conditions that may end a state depend."""
        rows = (self._machine.subsystem.rows(state.name, cause) for cause in state.behaviour.causes)
        ends = [condition.when for _, condition in state.behaviour.endings]
        row_conditions = [row.condition.when for of_cause in rows for _, row in of_cause]
        return frozenset[Read]().union(*map(self.of, (*ends, *row_conditions)))

    def read_by_functions(self, state: State) -> frozenset[Read]:
        """The inputs that the functions of a state depend on."""
        values = (item.value for item in state.behaviour.assignments)
        return frozenset[Read]().union(*map(self.of, values))

    @property
    def reachable_states(self) -> list[State]:
        """The states that the machine may enter."""
        return [
            s for s in self._machine.subsystem.states if s.name in self._machine.reachable_states
        ]


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

    `silent_state` is a reachable state in which the subsystem does not send it.
    """

    sender: Subsystem
    reads: tuple[ReadEdge, ...]
    silent_state: State | None

    @property
    def period_s(self) -> Fraction:
        """Seconds between two periods of the sender."""
        return 1 / self.sender.rate_hz

    @property
    def may_be_silent(self) -> bool:
        """Whether there may be no new value for an unlimited time."""
        return self.silent_state is not None


@dataclass(frozen=True, slots=True)
class Measured:
    """An element that a device reports.

    `period_s` are the seconds between samples, 0 without a rate; for a sporadic one the longest
    time without a sample, 0 if unknown. `is_shared` says whether it has several readers.
    """

    device: str
    period_s: Fraction
    place: Place
    is_sporadic: bool = False
    is_shared: bool = False

    @property
    def may_be_silent(self) -> bool:
        """Whether there may be no new sample for an unlimited time."""
        return self.is_sporadic and not self.period_s


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
        self._origins: dict[InputNode, Sent | Measured | None] = {}
        self._sent_in: dict[InputNode, dict[str, frozenset[ReadEdge]]] = {}

    def origin(self, node: InputNode) -> Sent | Measured | None:
        """Where a value comes from; None if that is not known."""
        if node not in self._origins:
            self._origins[node] = self._sent(node) or self._measured(node)
        return self._origins[node]

    def only_on_arrival(self, node: InputNode) -> bool:
        """Whether a subsystem uses a value only where it is fresh."""
        reads = self._reads.get(node.reader)
        own = [read for read in reads.all if read.input == node[1:]] if reads else []
        return bool(own) and all(read.on_arrival for read in own)

    def reads_of(self, subsystem: str) -> Reads | None:
        """What a subsystem reads; None if it has errors."""
        return self._reads.get(subsystem)

    def sent_in(self, node: InputNode) -> dict[str, frozenset[ReadEdge]]:
        """State of the sender in which it sends a value -> what the value is computed from."""
        if node not in self._sent_in:
            sender, output = self.sender(node) or _NOBODY
            machine = self._machines.get(sender)
            is_known = machine is not None and not machine.faulty
            written = (
                machine.subsystem.assigned_values.get(output, {}) if machine and is_known else {}
            )
            edges = {name: self._inputs_of(sender, values) for name, values in written.items()}
            self._sent_in[node] = {
                state.name: edges[state.behaviour.name]
                for state in (self._reads[sender].reachable_states if edges else ())
                if state.behaviour.name in edges
            }
        return self._sent_in[node]

    def _inputs_of(self, sender: str, values: Iterable[Expr]) -> frozenset[ReadEdge]:
        """The inputs from which values of a subsystem are computed."""
        found = (read for value in values for read in self._reads[sender].of(value))
        return frozenset((InputNode(sender, *read.input), read.on_arrival) for read in found)

    def _sent(self, node: InputNode) -> Sent | None:
        sender, _ = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None or machine.faulty:
            return None
        sent = self.sent_in(node)
        silent = (state for state in self._reads[sender].reachable_states if state.name not in sent)
        edges = frozenset[ReadEdge]().union(*sent.values())
        return Sent(machine.subsystem, tuple(sorted(edges)), next(silent, None))

    def stored_inputs(self, node: InputNode) -> Iterator[tuple[str, InputNode]]:
        """Yield each memory element that a value depends on, with each input stored in it."""
        sender, output = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None:
            return
        written, dependences = machine.subsystem.assigned_values, machine.dependences

        def values_assigned_to(target: tuple[str, str]) -> list[Expr]:
            return [value for values in written.get(target, {}).values() for value in values]

        def memory_read_by(target: tuple[str, str]) -> list[tuple[str, str]]:
            return [
                ("", name) for name in sorted(dependences.all(values_assigned_to(target)).memory)
            ]

        for memory in reachable(memory_read_by(output), memory_read_by):
            for source, _ in sorted(self._inputs_of(sender, values_assigned_to(memory))):
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
                is_shared = len(self._wires.wires_of_element(name, "x", node.element)) > 1
                return Measured(name, gap_s, place, True, is_shared)
            if binding.rate_hz is not None:
                return Measured(name, 1 / binding.rate_hz, binding.place.below("rate"))
        return Measured(name, Fraction(0), element.place)


# Values on their way through one repetition of the timeline.


ReadEdges = dict[InputNode, tuple[ReadEdge, ...]]
StampedRead = tuple[int, bool]
"""A time stamp of a reader, and whether only a value that is fresh then counts."""


@dataclass(frozen=True, slots=True)
class AgeChain:
    """A value that is read at `read_s`, and the value `before` from which it was computed, if any.

    Its age counts from `since_s`, the time of the measurement, or of the computation if the value
    depends on no measurement.
    """

    node: InputNode
    read_s: Fraction
    since_s: Fraction
    before: AgeChain | None

    @property
    def age_s(self) -> Fraction:
        """Seconds since its age began."""
        return self.read_s - self.since_s

    def steps(self) -> list[AgeChain]:
        """The chain from the measured or computed value to this one."""
        chain = [self]
        while (before := chain[-1].before) is not None:
            chain.append(before)
        return chain[::-1]


class Timeline:
    """Follows values through one repetition of the timeline, in whole ticks."""

    def __init__(
        self,
        sources: DataFlow,
        edges: ReadEdges,
        periods_s: dict[InputNode, Fraction],
        computed: Collection[InputNode],
    ) -> None:
        """`edges` are in an order of dependence, `periods_s` are those of readers.

        `computed` are the values that may be computed from nothing that has an age.
        """
        self._edges = edges
        self._computed = computed
        self._origins = {n: sources.origin(n) for n in edges}
        regular = {
            n: s.period_s
            for n, s in self._origins.items()
            if s is not None and not (isinstance(s, Measured) and s.is_sporadic)
        }
        every = [p for p in (*periods_s.values(), *regular.values()) if p]
        self._tick = base_tick(every)
        self._reader = {n: int(p / self._tick) for n, p in periods_s.items()}
        self._source = {n: int(p / self._tick) for n, p in regular.items()}
        self._repeats = lcm(*(int(p / self._tick) for p in every))
        self._warm_up = -(-2 * sum(int(p / self._tick) for p in every) // self._repeats)

    def oldest(self, node: InputNode, on_arrival: bool) -> AgeChain | None:
        """The oldest value in the steady state, at the first time stamp at which it is read."""
        if self._repeats > LONGEST:
            return None
        start = self._warm_up * self._repeats
        stamps = range(start, start + self._repeats, self._reader[node])
        wanted: dict[InputNode, set[StampedRead]] = {n: set() for n in self._edges}
        wanted[node] = {(stamp, on_arrival) for stamp in stamps}
        for n in reversed(self._edges):
            for read in wanted[n]:
                for stamp in self._sent_at(n, read):
                    for m, arrival in self._edges[n]:
                        wanted[m].add((stamp, arrival))
        found: dict[tuple[InputNode, StampedRead], AgeChain] = {}
        for n in self._edges:
            for read in sorted(wanted[n]):
                chain = self._chain(n, read, found)
                if chain is not None:
                    found[n, read] = chain
        chains = [found[node, read] for read in sorted(wanted[node]) if (node, read) in found]
        return max(chains, key=lambda c: (c.age_s, -c.read_s), default=None)

    def _chain(
        self, n: InputNode, read: StampedRead, found: dict[tuple[InputNode, StampedRead], AgeChain]
    ) -> AgeChain | None:
        (stamp, on_arrival), source = read, self._origins[n]
        read_s = stamp * self._tick
        if isinstance(source, Measured) and source.is_sporadic:
            age_s = source.period_s
            if on_arrival:  # another reader may have asked for it
                age_s = self._reader[n] * self._tick if source.is_shared else Fraction(0)
            return AgeChain(n, read_s, read_s - age_s, None)
        if isinstance(source, Measured):
            period = self._source[n]
            measured = stamp - stamp % period if period else stamp
            if on_arrival and measured <= stamp - self._reader[n]:
                return None
            return AgeChain(n, read_s, measured * self._tick, None)
        stamps = self._sent_at(n, read)
        earlier = ((m, (at, arrival)) for at in stamps for m, arrival in self._edges[n])
        chains = [found[each] for each in earlier if each in found]
        if chains:
            before = min(chains, key=lambda c: c.since_s)
            return AgeChain(n, read_s, before.since_s, before)
        if stamps and n in self._computed:
            return AgeChain(n, read_s, stamps[0] * self._tick, None)
        return None

    def _sent_at(self, n: InputNode, read: StampedRead) -> range:
        """The time stamps at which the value that is read may have been computed."""
        source, (stamp, on_arrival) = self._origins[n], read
        if not isinstance(source, Sent):
            return range(0)
        period = self._source[n]
        first = newest = stamp // period * period - period
        if on_arrival:
            first = ((stamp - self._reader[n]) // period + 1) * period - period
            if source.silent_state is None:
                first = max(first, newest)
        return range(first, newest + 1, period)


# How old values are where they are read: the time since the measurements behind them.
#
# A value is as old as the oldest measurement that it is computed from, through subsystems that read
# and send within one work cycle. Memory, and a loop through several subsystems, are not followed.
# Where no measurement is behind a value in any state, it is as old as the oldest computation.


@dataclass(frozen=True, slots=True)
class UnboundedAge:
    """A value that is read although its source may be silent for ever."""

    node: InputNode
    source: Sent | Measured


class Ages:
    """Ages of the values in the input buffers of a system."""

    def __init__(
        self, sources: DataFlow, periods_s: Mapping[str, Fraction], inputs: Iterable[InputNode]
    ) -> None:
        """`periods_s` of the subsystems, by their qualified names; `inputs` are all there are."""
        self.sources = sources
        self._periods_s = periods_s
        self._inputs = inputs
        self._oldest: dict[InputNode, AgeChain | UnboundedAge | None] = {}

    def oldest(self, node: InputNode) -> AgeChain | UnboundedAge | None:
        """The oldest value that is read, or why it is unbounded; None if its source is unknown.

        A device reads a value when it is sent. For a subsystem that reads a value only where it is
        fresh, only the age on arrival counts.
        """
        if node not in self._oldest:
            self._oldest[node] = self._follow(node)
        return self._oldest[node]

    def reads_by_state(self, node: InputNode) -> dict[str, list[ReadEdge]]:
        """State of the sender -> the inputs that determine the age of what it sends there.

        Those are the measured ones, or all of them if none is measured; inputs that close a loop
        are left out.
        """
        followed = {above for above, _ in self._followed(node)}
        return {
            state: sorted(each for each in reads if each[0] in followed)
            for state, reads in self.sources.sent_in(node).items()
        }

    def is_measured(self, node: InputNode) -> bool:
        """Whether a value depends on a measurement in some state."""
        return node in self._measured

    def _followed(self, node: InputNode) -> tuple[ReadEdge, ...]:
        """The reads that determine the age of a value."""
        edges = self._edges[node]
        return (
            tuple(e for e in edges if self.is_measured(e[0])) if self.is_measured(node) else edges
        )

    def _follow(self, node: InputNode) -> AgeChain | UnboundedAge | None:
        if self.sources.origin(node) is None:
            return None
        upstream = reachable([node], lambda here: (above for above, _ in self._followed(here)))
        edges = {n: self._followed(n) for n in self._edges if n in upstream}
        on_arrival = not node.peer or self.sources.only_on_arrival(node)
        read_late = {n for reads in edges.values() for n, arrival in reads if not arrival}
        periods_s, computed = dict[InputNode, Fraction](), list[InputNode]()
        for n in edges:
            source = self.sources.origin(n)
            is_late = n in read_late or (n == node and not on_arrival)
            if is_late and source is not None and source.may_be_silent:
                return UnboundedAge(n, source)
            if n.peer:
                periods_s[n] = self._periods_s[n.reader]
            elif source is not None:  # a device reads whenever something is sent
                periods_s[n] = source.period_s
            if not self.is_measured(node) and any(
                all(arrival for _, arrival in reads) for reads in self.reads_by_state(n).values()
            ):
                computed.append(n)
        return Timeline(self.sources, edges, periods_s, computed).oldest(node, on_arrival)

    @cached_property
    def _edges(self) -> ReadEdges:
        """What each value is computed from, in an order of dependence; loops are left out."""

        def reads(node: InputNode) -> tuple[ReadEdge, ...]:
            source = self.sources.origin(node)
            return source.reads if isinstance(source, Sent) else ()

        def inputs_of(node: InputNode) -> list[InputNode]:
            return [read for read, _ in edges[node]]

        edges = {n: reads(n) for n in reachable(self._inputs, lambda n: [m for m, _ in reads(n)])}
        try:
            order = [*TopologicalSorter({n: inputs_of(n) for n in edges}).static_order()]
        except CycleError:
            found = components(list(edges), ((n, m) for n in edges for m in inputs_of(n)))
            part = {n: number for number, each in enumerate(found) for n in each.states}
            for n, all_reads in edges.items():
                edges[n] = tuple(e for e in all_reads if part[e[0]] != part[n])
            order = [*TopologicalSorter({n: inputs_of(n) for n in edges}).static_order()]
        return {n: edges[n] for n in order}

    @cached_property
    def _measured(self) -> set[InputNode]:
        measured = set[InputNode]()
        for n, reads in self._edges.items():
            is_measured = isinstance(self.sources.origin(n), Measured)
            if is_measured or any(m in measured for m, _ in reads):
                measured.add(n)
        return measured
