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
from specc.tools.explore.contracts import Conclusions, Move, contract_watches
from specc.tools.explore.symmetry import Copies, Permutation, copies_in
from specc.tools.explore.tracker import PRUNED, RequirementTracker, Visible
from specc.tools.explore.transitions import FAILED, MachineState, SentValues, Transition
from specc.tools.explore.values import MOST_VALUES, Interner, ValueTable
from specc.tools.explore.walker import Walker


class Precision(NamedTuple):
    """How exact an abstraction is.

    `counts_time`: time in states is counted in periods. `max_values` bounds those
    of an element.
    """

    counts_time: bool = False
    max_values: int | None = MOST_VALUES

    def refines(self, other: Precision) -> bool:
        """Whether every run of this abstraction is one of the other abstraction, too."""
        return self.counts_time >= other.counts_time and (
            self.max_values is None or self.max_values == other.max_values
        )


COARSEST = Precision()


Slot = tuple[int, InputName]
"""A machine and one of its inputs."""


class MachineConfiguration(NamedTuple):
    """A machine in a configuration: buffers hold twice the number of a value, plus 1 if fresh."""

    state: int
    buffers: tuple[int, ...]
    pending: SentValues


class Configuration(NamedTuple):
    """All machines, by the numbers of their parts, after base tick `phase` of the hyperperiod.

    `tracker_state` is the number of the obligations that requirements still have.
    """

    phase: int
    parts: tuple[int, ...]
    tracker_state: int = 0


class Edge(NamedTuple):
    """A step to another configuration.

    `overwritten` are values that were overwritten before their reader saw them. `violated` are
    requirements, by index. `permutation` is the one that put copies in order: for each machine
    its index before; empty if they were in order. `ends_run`: a machine failed, and its outputs are
    due, so the run ends.
    """

    target: int
    transitions: tuple[tuple[int, Transition], ...]
    """Those of the machines that were due, by the index of the machine."""
    overwritten: tuple[tuple[int, InputName], ...] = ()
    violated: tuple[int, ...] = ()
    permutation: Permutation = ()
    ends_run: bool = False


class _Result(NamedTuple):
    """A machine after a step, with its number and its move; whether it has failed; the step."""

    part: MachineConfiguration
    number: int
    transition: tuple[int, Transition]
    ends_run: bool
    step: Move


class Composition:
    """The machines of one slice."""

    def __init__(
        self,
        names: tuple[str, ...],
        abstraction: Abstraction,
        precision: Precision = COARSEST,
        *,
        requirements: Sequence[Requirement] = (),
        probes: Sequence[Requirement] = (),
        contracts: Sequence[Requirement] = (),
        symmetric: bool = True,
        only_forced: bool = False,
    ) -> None:
        """`probes` are judged like `requirements` but violate nothing. Steps that surely break
        `contracts` are not followed.

        If `symmetric`, copies of an agent are put into one order, unless a requirement reads them.
        If `only_forced`, there is only one trace, on which nothing happens that can be avoided.
        """
        self.values = ValueTable(precision.max_values, abstraction.domains)
        self.names = names
        self.precision = precision
        self._only_forced = only_forced
        self.walkers = tuple(
            Walker(
                cone,
                machine.subsystem,
                self.values,
                exact=precision.counts_time,
                observed={
                    x.element[0]
                    for each in (*requirements, *probes, *contracts)
                    for x in each.readings
                    if x.kind == "memory" and x.subsystem == name
                },
            )
            for name in names
            for cone, machine in [(abstraction.cone(name), abstraction.machines[name])]
        )
        self.copies = copies_in(names, abstraction) if symmetric and len(names) > 1 else []
        readings = [reading for each in (*requirements, *probes) for reading in each.readings]
        copied = {names[i] for each in self.copies for machines in each.machines for i in machines}
        # What is sent may be sent to a copy.
        if any(x.kind == "sent" or x.subsystem in copied for x in readings):
            self.copies = []
        self._link_cache: dict[
            tuple[int, int, MachineConfiguration], tuple[tuple[int, ...], ...]
        ] = {}
        self._exchanges: dict[
            tuple[int, int, MachineConfiguration, tuple[int, ...]], MachineConfiguration
        ] = {}
        for first, index in self._equal_machines():
            self.walkers[index].share_results(self.walkers[first])
        periods = [walker.cone.period_s for walker in self.walkers]
        self.tick_s = base_tick(periods)
        self.ticks = [int(period / self.tick_s) for period in periods]
        self.hyperperiod = lcm(*self.ticks)
        self._receivers = self._find_receivers(abstraction)
        self._part_numbers = [Interner() for _ in names]
        for first, index in self._equal_machines():
            self._part_numbers[index] = self._part_numbers[first]
        self._parts_by_number: list[list[MachineConfiguration]] = [
            numbers.by_number for numbers in self._part_numbers
        ]
        self._step_cache: list[dict[int, tuple[_Result, ...]]] = [{} for _ in names]
        self.due = [self._due(phase) for phase in range(self.hyperperiod)]
        self._ticks_until_due = [self._until_next(phase) for phase in range(self.hyperperiod)]
        system, whole_s = abstraction.facts.system, abstraction.tick_s
        self.durations = [int(ticks * self.tick_s / whole_s) for ticks in self._ticks_until_due]
        self.tracker: RequirementTracker | None = None
        if requirements or probes:
            watches = contract_watches(contracts, requirements, abstraction, self.walkers, whole_s)
            self.tracker = RequirementTracker(
                requirements,
                probes,
                self.walkers,
                self.values,
                system,
                whole_s,
                watches,
                Conclusions(abstraction.facts.ticks),
            )
        self.has_dead_end = False
        """Whether in some configuration every step breaks a contract."""

    def _equal_machines(self) -> Iterator[tuple[int, int]]:
        """Pairs of equal machines: the one of the first copy, and the one of another copy."""
        for copies in self.copies:
            for copy in copies.machines[1:]:
                yield from zip(copies.machines[0], copy, strict=True)

    @cached_property
    def widened(self) -> set[str]:
        """The targets with too many values to track, after exploring."""
        targets = self.values.widened
        return {
            f"{walker.name}.{target.removeprefix(f'{walker.kind}.')}"
            for walker in self.walkers
            for target in targets
            if target.startswith(f"{walker.kind}.")
        }

    def _find_receivers(
        self, abstraction: Abstraction
    ) -> dict[tuple[int, InputName], tuple[int, int]]:
        """Sender and output -> reader and slot of its buffer."""
        found = {}
        for reader, walker in enumerate(self.walkers):
            for key, slot in walker.slots.items():
                sent = abstraction.sender_of(walker.name, key)
                assert sent is not None  # else it would not be tracked
                found[self.names.index(sent[0]), sent[1]] = reader, slot
        return found

    def receiver(self, sender: int, output: InputName) -> tuple[int, int] | None:
        """The machine that tracks an output as its input, and the slot of its buffer."""
        return self._receivers.get((sender, output))

    def _due(self, phase: int) -> tuple[int, ...]:
        return tuple(i for i, ticks in enumerate(self.ticks) if phase % ticks == 0)

    def _until_next(self, phase: int) -> int:
        """The base ticks of the slice until a machine is due again."""
        return min((phase // ticks + 1) * ticks for ticks in self.ticks) - phase

    def elapsed_ticks(self, phase: int) -> int:
        """The base ticks of the slice until a machine is due again after a phase."""
        return self._ticks_until_due[phase]

    def state_names(self, configuration: Configuration) -> tuple[str, ...]:
        """The states of all machines."""
        return tuple(local.state for local in self.machine_states(configuration))

    def machine_states(self, configuration: Configuration) -> list[MachineState]:
        """All machines of a configuration, without their buffers."""
        parts = zip(self.walkers, self.parts_of(configuration), strict=True)
        return [walker.states.by_number[part.state] for walker, part in parts]

    def parts_of(self, configuration: Configuration) -> list[MachineConfiguration]:
        """All machines of a configuration, with their buffers."""
        found = zip(self._parts_by_number, configuration.parts, strict=True)
        return [things[number] for things, number in found]

    @property
    def is_timed(self) -> bool:
        """Whether time in a state or mode matters at all."""
        return any(walker.clocks.is_timed or walker.mode_timers for walker in self.walkers)

    def configuration_of(
        self, phase: int, parts: Sequence[MachineConfiguration], tracker_state: int = 0
    ) -> Configuration:
        """The configuration of some parts."""
        pairs = zip(self._part_numbers, parts, strict=True)
        return Configuration(
            phase, tuple([numbers[part] for numbers, part in pairs]), tracker_state
        )

    def _track(
        self,
        phase: int,
        parts: Sequence[MachineConfiguration],
        before: int,
        visible: Visible,
        moves: Sequence[Move] = (),
    ) -> tuple[int, tuple[int, ...]]:
        """The number of the tracker state, and the requirements violated in these ticks."""
        if self.tracker is None:
            return 0, ()
        machines = [part.state for part in parts]
        return self.tracker.after_ticks(before, visible, machines, self.durations[phase], moves)

    def start(self) -> tuple[Configuration, Edge]:
        """The configuration after time 0, at which each machine executes its initial behaviour.

        It comes with the edge to it.
        """
        parts, moves = list[MachineConfiguration](), list[tuple[int, Transition]]()
        for index, walker in enumerate(self.walkers):
            buffers = tuple(2 * number for number in walker.initial_buffers())
            successor = walker.first_step(buffers)
            parts.append(MachineConfiguration(successor.state, buffers, successor.transition.sent))
            moves.append((index, successor.transition))
        initial_state = self.tracker.initial_state if self.tracker else 0
        tracker_state, violated = self._track(0, parts, initial_state, ())
        self.has_dead_end |= tracker_state == PRUNED
        return self.configuration_of(0, parts, tracker_state), Edge(0, tuple(moves), (), violated)

    def successors(self, here: Configuration) -> Iterator[tuple[Configuration, Edge]]:
        """The edges from a configuration, none at the end of a run; `target` is not set yet."""
        phase = (here.phase + self._ticks_until_due[here.phase]) % self.hyperperiod
        due = self.due[phase]
        parts = self.parts_of(here)
        if FAILED in [self.walkers[i].states.by_number[parts[i].state].clock for i in due]:
            return
        visible = [(i, *sent) for i in due for sent in parts[i].pending] if self.tracker else ()
        before, numbers = list(parts), list(here.parts)
        overwritten = self.deliver(due, parts)
        for i, part in enumerate(parts):
            if part is not before[i]:
                numbers[i] = self._part_numbers[i][part]
        each = [self._step_results(i, numbers[i]) for i in due]
        if self._only_forced:
            each = [tuple(sorted(results, key=_avoidable_last)[:1]) for results in each]
        has_contracts = self.tracker is not None and self.tracker.has_contracts
        is_dead_end = True
        for results in product(*each):
            for i, result in zip(due, results, strict=True):
                parts[i], numbers[i] = result.part, result.number
            ordered, turn = self.sort_copies(parts) if self.copies else (parts, ())
            steps = [each.step for each in results if not each.ends_run] if has_contracts else ()
            tracker_state, violated = self._track(
                phase, ordered, here.tracker_state, visible, steps
            )
            if tracker_state == PRUNED:
                continue
            is_dead_end = False
            configuration = Configuration(phase, tuple(numbers), tracker_state)
            if ordered is not parts:
                configuration = self.configuration_of(phase, ordered, tracker_state)
            moves = tuple([result.transition for result in results])
            ends = True in [result.ends_run for result in results]
            yield configuration, Edge(-1, moves, overwritten, violated, turn, ends)
        self.has_dead_end |= is_dead_end

    def _step_results(self, index: int, number: int) -> tuple[_Result, ...]:
        """A machine after each outcome of a step, its buffers read."""
        if number not in self._step_cache[index]:
            part: MachineConfiguration = self._part_numbers[index].by_number[number]
            walker, found = self.walkers[index], list[_Result]()
            for local, move, ends in walker.successors(part.state, part.buffers):
                seen = walker.after_reading(local, part.buffers)
                after = MachineConfiguration(local, seen, move.sent)
                step = Move(index, part.state, part.buffers, move)
                after_number = self._part_numbers[index][after]
                found.append(_Result(after, after_number, (index, move), ends, step))
            self._step_cache[index][number] = tuple(found)
        return self._step_cache[index][number]

    def sort_copies(
        self, parts: list[MachineConfiguration]
    ) -> tuple[list[MachineConfiguration], Permutation]:
        """The machines with copies in order, and the permutation: for each its index before."""
        turn = list(range(len(parts)))
        for number, copies in enumerate(self.copies):
            seen = self._copy_keys(number, parts)
            order = sorted(range(len(seen)), key=seen.__getitem__)
            if order == list(range(len(seen))):
                continue
            before, parts = parts, list(parts)
            for place, copy in enumerate(order):
                pairs = zip(copies.machines[place], copies.machines[copy], strict=True)
                for index, was in pairs:
                    parts[index], turn[index] = before[was], was
            for index in copies.outside_machines:
                key = number, index, parts[index], tuple(order)
                if key not in self._exchanges:
                    self._exchanges[key] = self._exchange_links(index, parts[index], copies, order)
                parts[index] = self._exchanges[key]
        return parts, () if turn == list(range(len(parts))) else tuple(turn)

    def _copy_keys(
        self, number: int, parts: list[MachineConfiguration]
    ) -> list[tuple[object, ...]]:
        """The sort key of each copy: its machines, and the values that others hold and send."""
        copies = self.copies[number]
        own = [tuple([parts[index] for index in copy]) for copy in copies.machines]
        views = (
            self._links_to_copies(number, index, parts[index]) for index in copies.outside_machines
        )
        return list(zip(own, *views, strict=True))

    def _links_to_copies(
        self, number: int, index: int, part: MachineConfiguration
    ) -> tuple[tuple[int, ...], ...]:
        """The values that a machine outside the copies holds and sends of each copy."""
        key = number, index, part
        if key not in self._link_cache:
            copies = self.copies[number]
            slots, pending = self.walkers[index].slots, dict(part.pending)
            links = copies.inputs[index], copies.outputs[index]
            self._link_cache[key] = tuple(
                (
                    *(part.buffers[slots[name]] for name in inputs if name in slots),
                    *(pending.get(name, -1) for name in outputs),
                )
                for inputs, outputs in zip(*links, strict=True)
            )
        return self._link_cache[key]

    def _exchange_links(
        self, index: int, part: MachineConfiguration, copies: Copies, order: list[int]
    ) -> MachineConfiguration:
        """A machine whose elements to and from copies are exchanged by `order`."""
        walker = self.walkers[index]
        inputs = copies.renamed(copies.inputs[index], order)
        outputs = copies.renamed(copies.outputs[index], order)
        buffers = list(part.buffers)
        for old, new in inputs.items():
            if old in walker.slots:
                buffers[walker.slots[new]] = part.buffers[walker.slots[old]]
        pending = tuple(sorted((outputs.get(key, key), number) for key, number in part.pending))
        return MachineConfiguration(walker.renamed(part.state, inputs), tuple(buffers), pending)

    def real_name(
        self, frame: Permutation, index: int, key: InputName, *, is_sent: bool
    ) -> InputName:
        """The name of an element in a real run, where `frame` maps machines to real ones."""
        for copies in self.copies:
            key = copies.real_name(frame, index, key, is_sent=is_sent)
        return key

    def slot_before(self, turn: Permutation, slot: Slot) -> Slot:
        """Where an input was before copies were put in order by `turn`."""
        if not turn:
            return slot
        index, key = slot
        return turn[index], self.real_name(turn, index, key, is_sent=False)

    def orbit(self, slot: Slot) -> list[Slot]:
        """An input with all that exchanging copies makes of it."""
        exchanges = [
            exchange for copies in self.copies for exchange in copies.exchanges(self.names)
        ]
        return [
            *reachable([slot], lambda here: (self.slot_before(turn, here) for turn in exchanges))
        ]

    def representative(self, index: int, key: InputName) -> tuple[str, InputName]:
        """The first of the inputs that exchanging copies makes of an input, by machine."""
        first, key = min(self.orbit((index, key)))
        return self.names[first], key

    def real_transition(
        self, frame: Permutation, index: int, transition: Transition
    ) -> tuple[int, Transition]:
        """The move of a machine with the names of that run."""
        if not self.copies:
            return index, transition
        sent = tuple((self.real_name(frame, index, k, is_sent=True), n) for k, n in transition.sent)
        lost = tuple(
            (self.real_name(frame, index, k, is_sent=False), e) for k, e in transition.lost
        )
        return frame[index], transition._replace(sent=sent, lost=lost)

    def real_overwritten(self, frame: Permutation, edge: Edge) -> tuple[tuple[int, InputName], ...]:
        """The overwritten values with their names in the real run."""
        if not self.copies:
            return edge.overwritten
        return tuple(
            (frame[i], self.real_name(frame, i, k, is_sent=False)) for i, k in edge.overwritten
        )

    def deliver(
        self, due: tuple[int, ...], parts: list[MachineConfiguration]
    ) -> tuple[tuple[int, InputName], ...]:
        """Make outputs of the last time stamp visible; returns the values that were overwritten."""
        overwritten = []
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
                    overwritten.append((reader, name))
                if before != new:
                    buffers = (*buffers[:slot], new, *buffers[slot + 1 :])
                    parts[reader] = MachineConfiguration(local, buffers, pending)
        return tuple(overwritten)


def _avoidable_last(result: _Result) -> tuple[bool, bool]:
    """Sort key: whether a step ends the run, and whether it takes an avoidable row."""
    _, move = result.transition
    return result.ends_run, move.row >= 0 and bool(move.choices)
