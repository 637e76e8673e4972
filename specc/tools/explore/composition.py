"""The composition of the machines of a slice, stepped together on their timeline.

A configuration is the state of the slice between two base ticks at which some machine is due: of
each machine its state and memory, its input buffers, and its outputs that are computed but not yet
visible (logical execution time).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from itertools import product, repeat
from math import lcm
from typing import NamedTuple

from specc.analysis.rates import base_tick
from specc.model.requirement import Requirement
from specc.proof import InputName
from specc.reachable import reachable
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.contracts import Conclusions, Move, contract_watches
from specc.tools.explore.symmetry import Copies, Permutation, copies_in
from specc.tools.explore.tracker import PRUNED, RequirementTracker
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

    @property
    def pass_number(self) -> int:
        """Its place among the abstractions that are tried, from coarse to fine."""
        return 3 if self.max_values is None else 1 + self.counts_time


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


EdgeLabel = tuple[
    tuple[tuple[int, Transition], ...],
    tuple[tuple[int, InputName], ...],
    tuple[int, ...],
    Permutation,
    bool,
]
"""What an edge has besides its target, in the order of `Edge`."""


_Delivery = tuple[int, tuple[tuple[int, InputName], ...]]
"""The number of a machine, and its input whose value was overwritten, if one was."""


class _Results(NamedTuple):
    """The possible results of a step of one machine, column by column.

    `parts` are the numbers of the machine after each, `observed` those of what requirements read,
    if there are any. `moves` are None where a machine failed.
    """

    parts: tuple[int, ...]
    transitions: tuple[tuple[int, Transition], ...]
    ends_run: tuple[bool, ...]
    observed: tuple[int, ...]
    moves: tuple[Move | None, ...]

    def easiest(self) -> _Results:
        """Only a result that ends no run, and takes no avoidable row, if there is one."""
        first = min(
            range(len(self.parts)),
            key=lambda n: (self.ends_run[n], _is_avoidable(self.transitions[n][1])),
        )
        return _Results(
            (self.parts[first],),
            (self.transitions[first],),
            (self.ends_run[first],),
            self.observed[first : first + 1],
            (self.moves[first],),
        )


class _Output(NamedTuple):
    """What others see of a machine when it is due.

    `sent` are the values that it sends: the reader, the slot of its buffer, and what that holds
    then; `shown` are its outputs for requirements, with the numbers of values, `observed` is the
    number of what requirements read of its state.
    """

    sent: tuple[tuple[int, int, int], ...]
    shown: tuple[tuple[int, InputName, int], ...]
    observed: int
    has_failed: bool


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
        formulas = (*requirements, *probes, *contracts)
        readings = [reading for each in formulas for reading in each.readings]
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
        self._step_cache: list[dict[int, _Results]] = [{} for _ in names]
        self._outputs: list[dict[int, _Output]] = [{} for _ in names]
        self._deliveries: list[dict[tuple[int, int, int], _Delivery]] = [{} for _ in names]
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

    def machine_configurations(self, index: int) -> list[MachineConfiguration]:
        """The configurations of a machine, by number."""
        return self._parts_by_number[index]

    @property
    def is_timed(self) -> bool:
        """Whether time in a state or mode matters at all."""
        return any(walker.clocks.is_timed or walker.mode_timers for walker in self.walkers)

    def _numbers_of(self, parts: Sequence[MachineConfiguration]) -> tuple[int, ...]:
        pairs = zip(self._part_numbers, parts, strict=True)
        return tuple([numbers[part] for numbers, part in pairs])

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
        tracker, tracker_state = self.tracker, 0
        violated: tuple[int, ...] = ()
        if tracker:
            tracker_state, violated = tracker.after_ticks(
                tracker.with_visible(tracker.initial_state, ()),
                tuple([tracker.observed(i, part.state) for i, part in enumerate(parts)]),
                self.durations[0],
            )
        self.has_dead_end |= tracker_state == PRUNED
        there = Configuration(0, self._numbers_of(parts), tracker_state)
        return there, Edge(0, tuple(moves), (), violated)

    def successors(self, here: Configuration) -> Iterator[tuple[Configuration, EdgeLabel]]:
        """The steps from a configuration, none at the end of a run, each with where it leads."""
        phase = (here.phase + self._ticks_until_due[here.phase]) % self.hyperperiod
        due, tracker = self.due[phase], self.tracker
        numbers = list(here.parts)
        if any(self._output(i, numbers[i]).has_failed for i in due):
            return
        overwritten = self.deliver(due, numbers)
        results = [self._step_results(i, numbers[i]) for i in due]
        if self._only_forced:
            results = [each.easiest() for each in results]
        arrived: list[tuple[int, ...]] = [(number,) for number in numbers]
        for i, each in zip(due, results, strict=True):
            arrived[i] = each.parts
        seen: Iterable[tuple[int, ...]] = repeat(())
        moved: Iterable[tuple[Move | None, ...]] = repeat(())
        if tracker:
            outputs = [self._output(i, number) for i, number in enumerate(here.parts)]
            visible = [sent for i in due for sent in outputs[i].shown]
            sight = tracker.with_visible(here.tracker_state, visible)
            observable: list[tuple[int, ...]] = [(each.observed,) for each in outputs]
            for i, each in zip(due, results, strict=True):
                observable[i] = each.observed
            seen = product(*observable)
            if tracker.has_contracts:
                moved = product(*[each.moves for each in results])
        is_dead_end, tracker_state, turn = True, 0, Permutation()
        violated: tuple[int, ...] = ()
        for there, transitions, ends_run, observed, moves in zip(
            product(*arrived),  # all products have the same order
            product(*[each.transitions for each in results]),
            map(any, product(*[each.ends_run for each in results])),
            seen,
            moved,
            strict=False,
        ):
            if tracker:
                tracker_state, violated = tracker.after_ticks(
                    sight, observed, self.durations[phase], moves
                )
                if tracker_state == PRUNED:
                    continue
            is_dead_end = False
            if self.copies:
                there, turn = self._in_order(there)
            yield (
                Configuration(phase, there, tracker_state),
                (transitions, overwritten, violated, turn, ends_run),
            )
        self.has_dead_end |= is_dead_end

    def _output(self, index: int, number: int) -> _Output:
        """What others see of a machine at its next step."""
        if number not in self._outputs[index]:
            part, tracker = self._parts_by_number[index][number], self.tracker
            places = [(self._receivers.get((index, key)), n) for key, n in part.pending]
            self._outputs[index][number] = _Output(
                tuple((*place, 2 * n + 1) for place, n in places if place),
                tuple((index, *sent) for sent in part.pending if tracker),
                tracker.observed(index, part.state) if tracker else 0,
                self.walkers[index].states.by_number[part.state].clock == FAILED,
            )
        return self._outputs[index][number]

    def _step_results(self, index: int, number: int) -> _Results:
        """A machine after each outcome of a step, its buffers read."""
        if number not in self._step_cache[index]:
            part: MachineConfiguration = self._part_numbers[index].by_number[number]
            walker, tracker = self.walkers[index], self.tracker
            found = walker.successors(part.state, part.buffers)
            after = [
                MachineConfiguration(
                    local, walker.after_reading(local, part.buffers), transition.sent
                )
                for local, transition, _ in found
            ]
            self._step_cache[index][number] = _Results(
                tuple(self._part_numbers[index][each] for each in after),
                tuple((index, each.transition) for each in found),
                tuple(each.ends_run for each in found),
                tuple(tracker.observed(index, each.state) for each in found) if tracker else (),
                tuple(
                    None if ends_run else Move(index, part.state, part.buffers, transition)
                    for _, transition, ends_run in found
                ),
            )
        return self._step_cache[index][number]

    def _in_order(self, numbers: tuple[int, ...]) -> tuple[tuple[int, ...], Permutation]:
        """Machines by number with copies in order, and the permutation that puts them so."""
        pairs = zip(self._parts_by_number, numbers, strict=True)
        parts, turn = self.sort_copies([things[number] for things, number in pairs])
        return self._numbers_of(parts), turn

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
        self, due: tuple[int, ...], numbers: list[int]
    ) -> tuple[tuple[int, InputName], ...]:
        """Make outputs of the last time stamp visible; returns the values that were overwritten.

        The `numbers` of the machines that read them change.
        """
        overwritten = list[tuple[int, InputName]]()
        sent = [each for i in due for each in self._output(i, numbers[i]).sent]
        for reader, slot, new in sent:
            key = numbers[reader], slot, new
            known = self._deliveries[reader]
            if key not in known:
                known[key] = self._delivered(reader, *key)
            numbers[reader], lost = known[key]
            overwritten += lost
        return tuple(overwritten)

    def _delivered(self, reader: int, number: int, slot: int, new: int) -> _Delivery:
        """A machine with another value in a buffer, and the value that is overwritten, if any."""
        local, buffers, pending = self._parts_by_number[reader][number]
        before, walker = buffers[slot], self.walkers[reader]
        name = walker.inputs[slot]
        is_lost = before % 2 and (before != new or name in walker.events)
        after = MachineConfiguration(local, (*buffers[:slot], new, *buffers[slot + 1 :]), pending)
        return self._part_numbers[reader][after], ((reader, name),) if is_lost else ()


def _is_avoidable(transition: Transition) -> bool:
    return transition.row >= 0 and bool(transition.choices)
