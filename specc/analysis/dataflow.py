"""Where values come from, through subsystems and from devices, and how old they are."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from math import lcm
from typing import NamedTuple

from specc.analysis.graph import CAUSES, components
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
            lets, lambda fresh, *test: fresh | asked.of(*test), frozenset.intersection
        )

    def of(self, expr: Expr) -> frozenset[Read]:
        """What the value of `expr` depends on."""
        parts = self._guards.parts(expr, frozenset())
        inputs = ((part.key, fresh) for part, fresh, _ in parts if isinstance(part, Input))
        return frozenset(Read(name, name in fresh) for name, fresh in inputs)

    @cached_property
    def all(self) -> frozenset[Read]:
        """The inputs whose values the machine uses."""
        found = [
            read(state)
            for state in self.reachable_states
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
    def reachable_states(self) -> list[State]:
        """Those that the machine enters."""
        return [
            s for s in self._machine.subsystem.states if s.name in self._machine.reachable_states
        ]


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
    silent_state: State | None


@dataclass(frozen=True, slots=True)
class Measured:
    """An element that a device reports.

    `period_s` are the seconds between samples, 0 without a rate; for a `sporadic` one the longest
    time without a sample, 0 if that is not known. `shared` tells whether it has several readers.
    """

    device: str
    period_s: Fraction
    place: Place
    is_sporadic: bool = False
    is_shared: bool = False

    @property
    def is_unlimited(self) -> bool:
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
            self._sent_in[node] = dict(self._sending(node))
        return self._sent_in[node]

    def _sending(self, node: InputNode) -> Iterator[tuple[str, frozenset[ReadEdge]]]:
        sender, output = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None or machine.faulty:
            return
        written = machine.subsystem.written.get(output, {})
        edges = {name: self._edges(sender, values) for name, values in written.items()}
        for state in self._reads[sender].reachable_states:
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
        silent = (state for state in self._reads[sender].reachable_states if state.name not in sent)
        edges = frozenset[ReadEdge]().union(*sent.values())
        return Sent(machine.subsystem, tuple(sorted(edges)), next(silent, None))

    def through_memory(self, node: InputNode) -> Iterator[tuple[str, InputNode]]:
        """Memory out of which a value comes, directly or not, with each input that goes into it."""
        sender, output = self.sender(node) or _NOBODY
        machine = self._machines.get(sender)
        if machine is None:
            return
        written, dependences = machine.subsystem.written, machine.dependences

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
        device = self._wires.devices.get(self._wires.measured(node.reader, node.peer))
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
        return len(self._wires.users(device, "x", element)) > 1


# Values on their way through one repetition of the timeline.


ReadEdges = dict[InputNode, tuple[ReadEdge, ...]]
StampedRead = tuple[int, bool]
"""A time stamp of a reader, and whether only a value that is fresh then counts."""


@dataclass(frozen=True, slots=True)
class AgeChain:
    """A value on its way: read at `read_s`, and computed from one read before, if there is one.

    Its age counts from `since_s`, when it was measured; when it was computed, if nothing that was
    measured is behind it.
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
        """This one and those before it, the measured or computed one first."""
        found: list[AgeChain] = []
        trail: AgeChain | None = self
        while trail is not None:
            found.append(trail)
            trail = trail.before
        return found[::-1]


class Timeline:
    """Follows values through one repetition of the timeline, in whole ticks."""

    def __init__(
        self,
        sources: DataFlow,
        order: list[InputNode],
        edges: ReadEdges,
        periods_s: dict[InputNode, Fraction],
        computed: Collection[InputNode],
    ) -> None:
        """`computed` are the values that may be computed from nothing that has an age."""
        self._sources = sources
        self._order = order
        self._edges = edges
        self._computed = computed
        measured = {n: s for n in order if isinstance(s := self._sources.origin(n), Measured)}
        self._sporadic = {n: s for n, s in measured.items() if s.is_sporadic}
        samples = {n: s.period_s for n, s in measured.items() if not s.is_sporadic}
        senders = {
            n: 1 / s.sender.rate_hz for n in order if isinstance(s := self._sources.origin(n), Sent)
        }
        every = [p for p in (*periods_s.values(), *samples.values(), *senders.values()) if p]
        self._tick = base_tick(every)
        self._reader = {n: int(p / self._tick) for n, p in periods_s.items()}
        self._sample = {n: int(p / self._tick) for n, p in samples.items()}
        self._sender = {n: int(p / self._tick) for n, p in senders.items()}
        self._repeats = lcm(*(int(p / self._tick) for p in every))
        self._warm_up = -(-2 * sum(int(p / self._tick) for p in every) // self._repeats)

    def oldest(self, node: InputNode, on_arrival: bool) -> AgeChain | None:
        """The oldest value once everything has been sent, on the first time stamp that has it."""
        if self._repeats > LONGEST:
            return None
        start = self._warm_up * self._repeats
        stamps = range(start, start + self._repeats, self._reader[node])
        wanted: dict[InputNode, set[StampedRead]] = {n: set() for n in self._order}
        wanted[node] = {(stamp, on_arrival) for stamp in stamps}
        for n in reversed(self._order):
            for need in wanted[n]:
                for stamp in self._sent_at(n, need):
                    for m, arrival in self._edges[n]:
                        wanted[m].add((stamp, arrival))
        found: dict[tuple[InputNode, StampedRead], AgeChain] = {}
        for n in self._order:
            for need in sorted(wanted[n]):
                trail = self._chain(n, need, found)
                if trail is not None:
                    found[n, need] = trail
        trails = [found[node, need] for need in sorted(wanted[node]) if (node, need) in found]
        return max(trails, key=lambda t: (t.age_s, -t.read_s), default=None)

    def _chain(
        self, n: InputNode, need: StampedRead, found: dict[tuple[InputNode, StampedRead], AgeChain]
    ) -> AgeChain | None:
        read_s = need[0] * self._tick
        if n in self._sporadic:
            return AgeChain(n, read_s, read_s - self._since_sample_s(n, on_arrival=need[1]), None)
        if n in self._sample:
            sample = self._sample[n]
            taken = need[0] - need[0] % sample if sample else need[0]
            if need[1] and taken <= need[0] - self._reader[n]:
                return None
            return AgeChain(n, read_s, taken * self._tick, None)
        stamps = self._sent_at(n, need)
        reads = [
            trail
            for stamp in stamps
            for m, arrival in self._edges[n]
            if (trail := found.get((m, (stamp, arrival))))
        ]
        if reads:
            before = min(reads, key=lambda t: t.since_s)
            return AgeChain(n, read_s, before.since_s, before)
        if stamps and n in self._computed:
            return AgeChain(n, read_s, stamps[0] * self._tick, None)
        return None

    def _since_sample_s(self, n: InputNode, *, on_arrival: bool) -> Fraction:
        """How old a sample of a sporadic device can be; another reader may have asked for it."""
        source = self._sporadic[n]
        if not on_arrival:
            return source.period_s
        return self._reader[n] * self._tick if source.is_shared else Fraction(0)

    def _sent_at(self, n: InputNode, need: StampedRead) -> range:
        """The time stamps at which the value may have been computed that is read."""
        source = self._sources.origin(n)
        if not isinstance(source, Sent):
            return range(0)
        stamp, on_arrival = need
        period = self._sender[n]
        newest = stamp // period * period - period
        seen_before = stamp - self._reader[n]
        if not on_arrival:
            return range(newest, newest + 1)
        first = (seen_before // period + 1) * period - period
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
    """A value that is read although its source may have been silent for an unlimited time."""

    node: InputNode
    source: Sent | Measured


class Ages:
    """Ages of the values in the input buffers of a system."""

    def __init__(self, sources: DataFlow, periods_s: Mapping[str, Fraction]) -> None:
        """`periods_s` of the subsystems, by their qualified names."""
        self.sources = sources
        self._periods_s = periods_s
        self._oldest: dict[InputNode, AgeChain | UnboundedAge | None] = {}
        # What was ordered so far, with all upstream of it: a value stands after those behind it.
        self._edges: ReadEdges = {}
        self._places: dict[InputNode, int] = {}
        self._measured: set[InputNode] = set()

    def oldest(self, node: InputNode) -> AgeChain | UnboundedAge | None:
        """The oldest value that is read, or why there is none; None if its source is not known.

        A device takes a value when it is sent; a subsystem that uses one only where it is fresh
        is not asked for its age later.
        """
        if node not in self._oldest:
            self._oldest[node] = self._follow(node)
        return self._oldest[node]

    def reads_by_state(self, node: InputNode) -> dict[str, list[ReadEdge]]:
        """State of the sender -> the values that a value is computed from which it sends there.

        Of those its age is made: they have been measured, or nothing was that is behind the value,
        and it has not passed them before.
        """
        followed = {above for above, _ in self._followed(node)}
        return {
            state: sorted(each for each in reads if each[0] in followed)
            for state, reads in self.sources.sent_in(node).items()
        }

    def is_measured(self, node: InputNode) -> bool:
        """Whether a measurement is behind a value in some state."""
        self._place(node)
        return node in self._measured

    def _followed(self, node: InputNode) -> tuple[ReadEdge, ...]:
        """The reads of which the age of a value is made."""
        is_measured = self.is_measured(node)
        edges = self._edges[node]
        return tuple(e for e in edges if e[0] in self._measured) if is_measured else edges

    def _follow(self, node: InputNode) -> AgeChain | UnboundedAge | None:
        if self.sources.origin(node) is None:
            return None
        upstream = reachable([node], lambda here: (above for above, _ in self._followed(here)))
        order = sorted(upstream, key=self._places.__getitem__)
        edges = {n: self._followed(n) for n in order}
        on_arrival = not node.peer or self.sources.only_on_arrival(node)
        held = self._unbounded(order, edges, node, on_arrival)
        if held is not None:
            return held
        periods_s = {n: self._period_s(n) for n in order}
        computed = [] if self.is_measured(node) else [*filter(self._may_be_computed, order)]
        return Timeline(self.sources, order, edges, periods_s, computed).oldest(node, on_arrival)

    def _may_be_computed(self, node: InputNode) -> bool:
        """Whether a value may be sent that is computed from none that has an age."""
        return any(
            all(arrival for _, arrival in reads) for reads in self.reads_by_state(node).values()
        )

    def _period_s(self, node: InputNode) -> Fraction:
        """Between two time stamps of a reader; a device reads whenever something is sent."""
        if node.peer:
            return self._periods_s[node.reader]
        sent = self.sources.origin(node)
        assert isinstance(sent, Sent)
        return self._periods_s[sent.sender.qualified_name]

    def _place(self, node: InputNode) -> None:
        """Order a value, and those upstream of it, that are not ordered yet."""
        new = reachable(
            () if node in self._places else (node,),
            lambda here: (above for above, _ in self._reads(here) if above not in self._places),
        )
        inside: ReadEdges = {
            n: tuple(e for e in self._reads(n) if e[0] not in self._places) for n in new
        }
        order = self._order(inside)
        for n in order:
            earlier = tuple(e for e in self._reads(n) if e[0] in self._places and e[0] not in new)
            self._edges[n] = tuple(sorted((*inside[n], *earlier)))
            self._places[n] = len(self._places)
            if isinstance(self.sources.origin(n), Measured) or any(
                m in self._measured for m, _ in self._edges[n]
            ):
                self._measured.add(n)

    def _reads(self, node: InputNode) -> tuple[ReadEdge, ...]:
        source = self.sources.origin(node)
        return source.reads if isinstance(source, Sent) else ()

    def _order(self, edges: ReadEdges) -> list[InputNode]:
        """Every node after those that it is computed from; edges that make a loop are left out."""
        try:
            return list(TopologicalSorter(_targets(edges)).static_order())
        except CycleError:
            pairs = ((n, m) for n, reads in edges.items() for m, _ in reads)
            found = components(list(edges), pairs)
            part = {n: number for number, each in enumerate(found) for n in each.states}
            for n, reads in edges.items():
                edges[n] = tuple(e for e in reads if part[e[0]] != part[n])
            return list(TopologicalSorter(_targets(edges)).static_order())

    def _unbounded(
        self, order: list[InputNode], edges: ReadEdges, node: InputNode, on_arrival: bool
    ) -> UnboundedAge | None:
        """The first value on the path to `node` whose age nothing limits."""
        held = {node} if not on_arrival else set()
        held |= {n for reads in edges.values() for n, arrival in reads if not arrival}
        for n in order:
            source = self.sources.origin(n)
            if n in held and source is not None and _may_be_silent(source):
                return UnboundedAge(n, source)
        return None


def _may_be_silent(source: Sent | Measured) -> bool:
    return source.is_unlimited if isinstance(source, Measured) else source.silent_state is not None


def _targets(edges: ReadEdges) -> dict[InputNode, list[InputNode]]:
    return {n: [m for m, _ in reads] for n, reads in edges.items()}
