"""The composition of the machines of a slice, stepped together on their timeline.

A configuration is the state of the slice between two base ticks at which some machine is due: of
each machine its state and memory, its input buffers, and its outputs that are computed but not yet
visible (logical execution time).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import product
from math import lcm
from typing import NamedTuple

from specc.analysis.rates import base_tick
from specc.model.requirement import Requirement
from specc.proof import InputName
from specc.reachable import reachable
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.moves import OVER, Local, Move, SentValues
from specc.tools.explore.symmetry import Copies, Permutation, copies_in
from specc.tools.explore.values import MOST_VALUES, Numbers, ValueNumbers
from specc.tools.explore.walker import Walker
from specc.tools.explore.watch import Visible, Watch


class Precision(NamedTuple):
    """How exact an abstraction is.

    `exact`: time in states is counted in periods. `most`: bound on the values of an element.
    """

    exact: bool = False
    most: int | None = MOST_VALUES

    def refines(self, other: Precision) -> bool:
        """Whether every run of this abstraction is one of the other abstraction, too."""
        return self.exact >= other.exact and (self.most is None or self.most == other.most)


COARSEST = Precision()


Slot = tuple[int, InputName]
"""A machine and one of its inputs."""


class MachineState(NamedTuple):
    """A machine in a configuration: buffers hold twice the number of a value, plus 1 if fresh."""

    local: int
    buffers: tuple[int, ...]
    pending: SentValues


class Configuration(NamedTuple):
    """All machines, by the numbers of their parts, after base tick `phase` of the hyperperiod.

    `watched` is the number of the obligations that requirements still leave.
    """

    phase: int
    parts: tuple[int, ...]
    watched: int = 0


class Edge(NamedTuple):
    """A step to another configuration.

    `overtaken` are values that were overwritten before their reader saw them. `violated` are
    requirements, by index. `turn` is the permutation that put copies in order: for each machine
    its index before; empty if they were in order. `ends`: a machine failed, and its outputs are
    due, so the run ends. If there is a `loop` of edges, it is taken so many `times`, with values
    that change by constants; `moves` are then all of its first time.
    """

    target: int
    moves: tuple[tuple[int, Move], ...]
    """Those of the machines that were due, by the index of the machine."""
    overtaken: tuple[tuple[int, InputName], ...] = ()
    violated: tuple[int, ...] = ()
    turn: Permutation = ()
    ends: bool = False
    loop: tuple[Edge, ...] = ()
    times: int = 1


class _Result(NamedTuple):
    """A machine after a step, with its number and its move; whether it has failed."""

    part: MachineState
    number: int
    move: tuple[int, Move]
    ends: bool


class Composition:
    """The machines of one slice."""

    def __init__(
        self,
        names: tuple[str, ...],
        abstraction: Abstraction,
        precision: Precision = COARSEST,
        *,
        watched: Sequence[Requirement] = (),
        probes: Sequence[Requirement] = (),
        symmetric: bool = True,
        still: bool = False,
    ) -> None:
        """`watched` are the requirements; `probes` are judged too but violate nothing.

        If `symmetric`, copies of an agent are put into one order, unless there are requirements.
        If `still`, there is only one trace, on which nothing happens that can be avoided.
        """
        self.values = ValueNumbers(precision.most, abstraction.cuts)
        self.names = names
        self.precision = precision
        self._still = still
        self.walkers = tuple(
            Walker(cone, kept.subsystem, self.values, exact=precision.exact)
            for name in names
            for cone, kept in [(abstraction.cone(name), abstraction.kept[name])]
        )
        of_kinds = symmetric and not watched and len(names) > 1
        self.copies = copies_in(names, abstraction) if of_kinds else []
        self._views: dict[tuple[int, int, MachineState], tuple[tuple[int, ...], ...]] = {}
        self._exchanges: dict[tuple[int, int, MachineState, tuple[int, ...]], MachineState] = {}
        for first, index in self._alike():
            self.walkers[index].join(self.walkers[first])
        periods = [walker.cone.period_s for walker in self.walkers]
        self.tick_s = base_tick(periods)
        self.ticks = [int(period / self.tick_s) for period in periods]
        self.hyperperiod = lcm(*self.ticks)
        self._receivers = self._connected(abstraction)
        self._parts = [Numbers() for _ in names]
        for first, index in self._alike():
            self._parts[index] = self._parts[first]
        self._things: list[list[MachineState]] = [numbers.things for numbers in self._parts]
        self._stepped: list[dict[int, tuple[_Result, ...]]] = [{} for _ in names]
        self.due = [self._due(phase) for phase in range(self.hyperperiod)]
        self._until = [self._until_next(phase) for phase in range(self.hyperperiod)]
        system, whole_s = abstraction.facts.system, abstraction.tick_s
        self.lasts = [int(ticks * self.tick_s / whole_s) for ticks in self._until]
        self.watch: Watch | None = None
        if watched:
            self.watch = Watch(watched, probes, self.walkers, self.values, system, whole_s)

    def _alike(self) -> Iterator[tuple[int, int]]:
        """Pairs of equal machines: the one of the first copy, and the one of another copy."""
        for copies in self.copies:
            for copy in copies.machines[1:]:
                yield from zip(copies.machines[0], copy, strict=True)

    @cached_property
    def widened(self) -> set[str]:
        """The targets with too many values to follow, once everything was explored."""
        said = self.values.widened
        return {
            f"{walker.name}.{target.removeprefix(f'{walker.kind}.')}"
            for walker in self.walkers
            for target in said
            if target.startswith(f"{walker.kind}.")
        }

    def _connected(self, abstraction: Abstraction) -> dict[tuple[int, InputName], tuple[int, int]]:
        """Sender and output -> reader and slot of its buffer."""
        found = {}
        for reader, walker in enumerate(self.walkers):
            for key, slot in walker.slots.items():
                sent = abstraction.sender_of(walker.name, key)
                assert sent is not None  # else it would not be kept
                found[self.names.index(sent[0]), sent[1]] = reader, slot
        return found

    def _due(self, phase: int) -> tuple[int, ...]:
        return tuple(i for i, ticks in enumerate(self.ticks) if phase % ticks == 0)

    def _until_next(self, phase: int) -> int:
        """The base ticks of the slice until a machine is due again."""
        return min((phase // ticks + 1) * ticks for ticks in self.ticks) - phase

    def passed(self, phase: int, edge: Edge) -> int:
        """The base ticks of the slice that an edge from a phase takes."""
        passed = 0
        for _ in edge.loop or (edge,):
            passed += self._until[(phase + passed) % self.hyperperiod]
        return edge.times * passed

    def states(self, configuration: Configuration) -> tuple[str, ...]:
        """The states of all machines."""
        return tuple(local.state for local in self.locals_of(configuration))

    def locals_of(self, configuration: Configuration) -> list[Local]:
        """All machines of a configuration, without their buffers."""
        parts = zip(self.walkers, self.parts_of(configuration), strict=True)
        return [walker.locals.things[part.local] for walker, part in parts]

    def parts_of(self, configuration: Configuration) -> list[MachineState]:
        """All machines of a configuration, with their buffers."""
        found = zip(self._things, configuration.parts, strict=True)
        return [things[number] for things, number in found]

    @property
    def is_timed(self) -> bool:
        """Whether time in a state matters at all."""
        return any(walker.clocks.is_timed for walker in self.walkers)

    def numbered(
        self, phase: int, parts: Sequence[MachineState], watched: int = 0
    ) -> Configuration:
        """The configuration of some parts."""
        pairs = zip(self._parts, parts, strict=True)
        return Configuration(phase, tuple([numbers[part] for numbers, part in pairs]), watched)

    def _watched(
        self, phase: int, parts: Sequence[MachineState], before: int, visible: Visible
    ) -> tuple[int, tuple[int, ...]]:
        """The number of what monitors know, and the requirements violated in these ticks."""
        if self.watch is None:
            return 0, ()
        machines = [part.local for part in parts]
        return self.watch.after(before, visible, machines, self.lasts[phase])

    def start(self) -> tuple[Configuration, Edge]:
        """The configurations after time 0, at which each machine executes its initial behaviour."""
        parts, moves = list[MachineState](), list[tuple[int, Move]]()
        for index, walker in enumerate(self.walkers):
            buffers = tuple(2 * number for number in walker.begin())
            begun = walker.start(buffers)
            parts.append(MachineState(begun.local, buffers, begun.move.sent))
            moves.append((index, begun.move))
        begin = self.watch.begin if self.watch else 0
        watched, violated = self._watched(0, parts, begin, ())
        return self.numbered(0, parts, watched), Edge(0, tuple(moves), (), violated)

    def following(self, here: Configuration) -> Iterator[tuple[Configuration, Edge]]:
        """The edges from a configuration, none at the end of a run; `target` is not set yet."""
        phase = (here.phase + self._until[here.phase]) % self.hyperperiod
        due = self.due[phase]
        parts = self.parts_of(here)
        if OVER in [self.walkers[i].locals.things[parts[i].local].clock for i in due]:
            return
        visible = [(i, *sent) for i in due for sent in parts[i].pending] if self.watch else ()
        before, numbers = list(parts), list(here.parts)
        overtaken = self.deliver(due, parts)
        for i, part in enumerate(parts):
            if part is not before[i]:
                numbers[i] = self._parts[i][part]
        each = [self._results(i, numbers[i]) for i in due]
        if self._still:
            each = [tuple(sorted(results, key=_happens)[:1]) for results in each]
        for results in product(*each):
            for i, result in zip(due, results, strict=True):
                parts[i], numbers[i] = result.part, result.number
            ordered, turn = self.ordered(parts) if self.copies else (parts, ())
            watched, violated = self._watched(phase, ordered, here.watched, visible)
            made = Configuration(phase, tuple(numbers), watched)
            if ordered is not parts:
                made = self.numbered(phase, ordered, watched)
            moves = tuple([result.move for result in results])
            ends = True in [result.ends for result in results]
            yield made, Edge(-1, moves, overtaken, violated, turn, ends)

    def _results(self, index: int, number: int) -> tuple[_Result, ...]:
        """A machine after each outcome of a step, its buffers read."""
        if number not in self._stepped[index]:
            part: MachineState = self._parts[index].things[number]
            seen, found = tuple([n & ~1 for n in part.buffers]), []
            for local, move, ends in self.walkers[index].step(part.local, part.buffers):
                after = MachineState(local, seen, move.sent)
                found.append(_Result(after, self._parts[index][after], (index, move), ends))
            self._stepped[index][number] = tuple(found)
        return self._stepped[index][number]

    def ordered(self, parts: list[MachineState]) -> tuple[list[MachineState], Permutation]:
        """The machines with copies in order, and the permutation: for each its index before."""
        turn = list(range(len(parts)))
        for number, copies in enumerate(self.copies):
            seen = self._seen(number, parts)
            order = sorted(range(len(seen)), key=seen.__getitem__)
            if order == list(range(len(seen))):
                continue
            before, parts = parts, list(parts)
            for place, copy in enumerate(order):
                pairs = zip(copies.machines[place], copies.machines[copy], strict=True)
                for index, was in pairs:
                    parts[index], turn[index] = before[was], was
            for index in copies.others:
                key = number, index, parts[index], tuple(order)
                if key not in self._exchanges:
                    self._exchanges[key] = self._exchanged(index, parts[index], copies, order)
                parts[index] = self._exchanges[key]
        return parts, () if turn == list(range(len(parts))) else tuple(turn)

    def _seen(self, number: int, parts: list[MachineState]) -> list[tuple[object, ...]]:
        """The sort key of each copy: its machines, and the values that others hold and send."""
        copies = self.copies[number]
        own = [tuple([parts[index] for index in copy]) for copy in copies.machines]
        views = (self._view(number, index, parts[index]) for index in copies.others)
        return list(zip(own, *views, strict=True))

    def _view(self, number: int, index: int, part: MachineState) -> tuple[tuple[int, ...], ...]:
        """The values that a machine outside the copies holds and sends of each copy."""
        key = number, index, part
        if key not in self._views:
            copies = self.copies[number]
            slots, pending = self.walkers[index].slots, dict(part.pending)
            links = copies.inputs[index], copies.outputs[index]
            self._views[key] = tuple(
                (
                    *(part.buffers[slots[name]] for name in inputs if name in slots),
                    *(pending.get(name, -1) for name in outputs),
                )
                for inputs, outputs in zip(*links, strict=True)
            )
        return self._views[key]

    def _exchanged(
        self, index: int, part: MachineState, copies: Copies, order: list[int]
    ) -> MachineState:
        """A machine whose elements to and from copies are exchanged as the order says."""
        walker = self.walkers[index]
        inputs = copies.renamed(copies.inputs[index], order)
        outputs = copies.renamed(copies.outputs[index], order)
        buffers = list(part.buffers)
        for old, new in inputs.items():
            if old in walker.slots:
                buffers[walker.slots[new]] = part.buffers[walker.slots[old]]
        pending = tuple(sorted((outputs.get(key, key), number) for key, number in part.pending))
        return MachineState(walker.renamed(part.local, inputs), tuple(buffers), pending)

    def real(self, frame: Permutation, index: int, key: InputName, *, is_sent: bool) -> InputName:
        """The name of an element in a real run, where `frame` maps machines to real ones."""
        for copies in self.copies:
            key = copies.real(frame, index, key, is_sent=is_sent)
        return key

    def before(self, turn: Permutation, slot: Slot) -> Slot:
        """Where an input was before copies were put in order by `turn`."""
        if not turn:
            return slot
        index, key = slot
        return turn[index], self.real(turn, index, key, is_sent=False)

    def orbit(self, slot: Slot) -> list[Slot]:
        """An input with those that it becomes where copies are exchanged."""
        exchanges = [
            exchange for copies in self.copies for exchange in copies.exchanges(self.names)
        ]
        return [*reachable([slot], lambda here: (self.before(turn, here) for turn in exchanges))]

    def of_kind(self, index: int, key: InputName) -> tuple[str, InputName]:
        """An input by machine and name, the same for all that copies make of it."""
        first, key = min(self.orbit((index, key)))
        return self.names[first], key

    def real_move(self, frame: Permutation, index: int, move: Move) -> tuple[int, Move]:
        """The move of a machine with the names of that run."""
        if not self.copies:
            return index, move
        sent = tuple((self.real(frame, index, k, is_sent=True), n) for k, n in move.sent)
        lost = tuple((self.real(frame, index, k, is_sent=False), e) for k, e in move.lost)
        return frame[index], move._replace(sent=sent, lost=lost)

    def real_overtaken(self, frame: Permutation, edge: Edge) -> tuple[tuple[int, InputName], ...]:
        """The overtaken values with the names of that run."""
        if not self.copies:
            return edge.overtaken
        return tuple((frame[i], self.real(frame, i, k, is_sent=False)) for i, k in edge.overtaken)

    def deliver(
        self, due: tuple[int, ...], parts: list[MachineState]
    ) -> tuple[tuple[int, InputName], ...]:
        """Make outputs of the last time stamp visible; returns the values that were overtaken."""
        overtaken = []
        for i in due:
            for key, number in parts[i].pending:
                place = self._receivers.get((i, key))
                if place is None:
                    continue
                reader, slot = place
                local, buffers, pending = parts[reader]
                before, new = buffers[slot], 2 * number + 1
                name = self.walkers[reader].inputs[slot]
                if before % 2 and (before != new or name in self.walkers[reader].events):
                    overtaken.append((reader, name))
                if before != new:
                    buffers = (*buffers[:slot], new, *buffers[slot + 1 :])
                    parts[reader] = MachineState(local, buffers, pending)
        return tuple(overtaken)


def _happens(result: _Result) -> tuple[bool, bool]:
    """Sort key: whether a step ends the run, and whether it takes an avoidable row."""
    _, move = result.move
    return result.ends, move.row >= 0 and bool(move.free)
