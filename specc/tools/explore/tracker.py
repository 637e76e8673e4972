"""Tracks requirements while machines are stepped: their readings, conditions and obligations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from specc.model import expr as m
from specc.model.requirement import Reading, Requirement
from specc.model.system import System
from specc.proof import InputName
from specc.tools.explore.contracts import Conclusions, ContractWatch, Move, unsigned
from specc.tools.explore.monitor import Monitor, MonitorState, TruthValue
from specc.tools.explore.partial import (
    AbstractValue,
    KnownValues,
    is_known,
    is_literal,
    residual,
    static_values,
)
from specc.tools.explore.regions import value_leaves
from specc.tools.explore.transitions import FAILED, MachineState
from specc.tools.explore.values import ABSENT, PRESENT, UNKNOWN, Interner, ValueTable
from specc.tools.explore.walker import Walker

_Ticks = tuple[int, int, tuple[TruthValue, ...], int]
"""A call of a monitor: its index, the number of its state, truth of conditions, ticks."""
Visible = Iterable[tuple[int, InputName, int]]
"""Machine and output of values that have just become visible, with their numbers."""


PRUNED = -1
"""The tracker state of what is not followed, since a contract is surely broken."""


class TrackerState(NamedTuple):
    """Numbers of the obligations, and of the last visible value of each reading.

    `watched` are the numbers of the values whose changes are asked, -1 where unknown; none before
    the first tick. `contracts` are the numbers of obligations of contracts, `ages` for how many
    ticks each visible value has not changed, as far as contracts ask.
    """

    states: tuple[int, ...]
    values: tuple[int, ...]
    watched: tuple[int, ...] = ()
    contracts: tuple[int, ...] = ()
    ages: tuple[int, ...] = ()


class Sight(NamedTuple):
    """The number of a tracker state, and the visible values that have, or may have, changed."""

    state: int
    changes: tuple[tuple[int, TruthValue], ...] = ()


class RequirementTracker:
    """Tracks some requirements over the machines of a slice.

    Values are seen as the monitors of a run see them: state and memory from the step on, outputs
    from the tick at which they become visible.
    """

    def __init__(
        self,
        required: Sequence[Requirement],
        probes: Sequence[Requirement],
        walkers: Sequence[Walker],
        values: ValueTable,
        system: System,
        tick_s: Fraction,
        contracts: Sequence[ContractWatch] = (),
        conclusions: Conclusions | None = None,
    ) -> None:
        """Violations of `probes` are not reported. `tick_s` is the base tick of the whole system.

        What surely breaks one of the `contracts` is not followed.

        Raises UnsupportedFormulaError.
        """
        requirements = [*required, *probes]
        self._requirement_count = len(required)
        self.monitors = [Monitor(requirement, tick_s) for requirement in requirements]
        self._verdicts: list[set[TruthValue]] = [set() for _ in requirements]
        self._open_after_failure, self._unknown_conditions = set[int](), set[int]()
        """The requirements that were open after a failure, and those with conditions that were
        unknown for another reason than that a machine had failed."""
        self.absent_values: list[set[str]] = [set() for _ in requirements]
        """By requirement, absent values that made conditions unknown; "" for other reasons."""
        self._walkers = {walker.name: walker for walker in walkers}
        self._system = system
        self._index = {walker.name: index for index, walker in enumerate(walkers)}
        self._values = values
        self._contracts = contracts
        self._conclusions = conclusions
        self._deciding = [n for n, each in enumerate(contracts) if each.walker is None]
        """The contracts that may decide conditions of requirements on what devices report."""
        every = [*requirements, *(each.contract for each in contracts)]
        found = {x.name: x for requirement in every for x in requirement.readings}
        self._readings = tuple(found.values())
        sent = {
            (x.subsystem, x.element, x.initial): x
            for x in self._readings
            if x.kind == "sent" and x.subsystem in self._index
        }
        self.sent_readings = tuple(sent.values())
        self._slots = {key: slot for slot, key in enumerate(sent)}
        self._locations = [self._locate(reading) for reading in self._readings]
        self._slots_of_output: dict[tuple[int, InputName], list[int]] = {}
        for slot, x in enumerate(sent.values()):
            output = self._index[x.subsystem], (x.element[0], x.element[1])
            self._slots_of_output.setdefault(output, []).append(slot)
        # Only constants of the system: parameters of a description may have the same names.
        self._constants = KnownValues({}, {c.name: c.value for c in system.constants}, tick_s)
        self._state_numbers, self._obligation_numbers = Interner(), Interner()
        self._monitor_cache: dict[_Ticks, tuple[int, frozenset[TruthValue]]] = {}
        self._truth_cache: dict[tuple[object, ...], tuple[tuple[TruthValue, ...], ...]] = {}
        self._holding_cache: dict[tuple[object, ...], tuple[TruthValue, ...]] = {}
        self._step_cache: dict[tuple[object, ...], tuple[int, tuple[int, ...]]] = {}
        self._observed = [
            _ObservedMachine(walker, [place for place in self._locations if place[0] == index])
            for index, walker in enumerate(walkers)
        ]
        obligations = tuple(
            self._obligation_numbers.number(monitor.initial_state) for monitor in self.monitors
        )
        first = tuple(self._initial_value(reading) for reading in sent.values())
        self._slots_read = {
            x.name: self._slots[x.subsystem, x.element, x.initial]
            for x in self._readings
            if x.kind == "sent" and x.subsystem in self._index
        }
        monitors = [*self.monitors, *(each.monitor for each in contracts)]
        self._watched = tuple(
            dict.fromkeys(each.atoms[place] for each in monitors for place in sorted(each.watched))
        )
        self._watched_numbers = Interner()
        self._plain_refs = {
            m.MemoryRef(x.name, type=x.type) for x in self._readings if not x.asks_presence
        }
        begun = tuple(
            self._obligation_numbers.number(each.monitor.initial_state) for each in contracts
        )
        self._longest_lag = max((each.lag for each in contracts), default=0)
        ages = tuple(-1 for _ in first) if contracts else ()
        self.initial_state = self._state_numbers.number(
            TrackerState(obligations, first, (), begun, ages)
        )
        self.has_contracts = bool(contracts)
        self._is_plain = not (self._watched or contracts)
        """Whether it knows nothing of ticks before but obligations."""

    def _initial_value(self, reading: Reading) -> int:
        if reading.initial is None:
            return ABSENT
        reader, peer, element = reading.initial
        subsystem = next(s for s in self._system.subsystems if s.qualified_name == reader)
        init, known = subsystem.inputs[peer, element].init, static_values(subsystem, self._system)
        return (
            UNKNOWN
            if init is None
            else self._values.number_of(reading.name, residual(init, known), known)
        )

    def state(self, state_number: int) -> TrackerState:
        """The obligations and seen values with a number."""
        found: TrackerState = self._state_numbers.by_number[state_number]
        return found

    def truths_now(
        self, seen: Sequence[int], machine_states: Sequence[MachineState]
    ) -> tuple[TruthValue, ...]:
        """Whether each requirement about single ticks holds now.

        `seen` are the numbers of the last visible values of the `sent_readings`.
        """
        now = self._reading_values(seen, machine_states)
        if now not in self._holding_cache:
            self._holding_cache[now] = tuple(
                monitor.holds_now(atoms)
                for monitor, atoms in zip(self.monitors, self._truths(now), strict=True)
            )
        return self._holding_cache[now]

    def observed(self, machine: int, state: int) -> int:
        """The number of what readings observe of a machine in a state, by number."""
        return self._observed[machine][state]

    def with_visible(self, state_number: int, visible: Visible) -> Sight:
        """The values after some have become visible."""
        before, renewed = state_number, set[int]()
        for machine, output, value in visible:
            for slot in self._slots_of_output.get((machine, output), ()):
                state_number = self._with_value(state_number, slot, value)
                renewed.add(slot)
        if self._is_plain:
            return Sight(state_number)
        was, now = self.state(before).values, self.state(state_number).values
        changes = [(slot, self._has_changed(was[slot], now[slot])) for slot in sorted(renewed)]
        return Sight(state_number, tuple(each for each in changes if each[1] is not False))

    def after_ticks(
        self,
        sight: Sight,
        observed: tuple[int, ...],
        ticks: int,
        moves: Sequence[Move | None] = (),
    ) -> tuple[int, tuple[int, ...]]:
        """The obligations after some ticks with constant values, and the violations on them.

        `observed` are numbers of what readings observe of each machine, `moves` the steps at the
        first tick, None of a machine that failed. See `proves` about one that has failed. The
        obligations are `PRUNED` if a contract is surely broken.
        """
        key: tuple[object, ...] = sight, observed, ticks
        changes = dict(sight.changes)
        answers: tuple[tuple[TruthValue, ...], ...] = ()
        if self._contracts:
            answers = tuple(
                self._answers(each, sight.state, changes, moves) for each in self._contracts
            )
            key = *key, answers
        if key not in self._step_cache:
            pairs = zip(self._observed, observed, strict=True)
            machine_states = [each.examples[number] for each, number in pairs]
            # What contracts decide may turn out otherwise at each tick.
            at_once = 1 if self._deciding else ticks
            found = self._step(self.state(sight.state), machine_states, at_once, changes, answers)
            violated = set(found[1])
            for _ in range(ticks - at_once):
                if found[0] == PRUNED:
                    break
                found = self._step(self.state(found[0]), machine_states, 1, {}, answers)
                violated.update(found[1])
            self._step_cache[key] = found[0], tuple(sorted(violated))
        return self._step_cache[key]

    def _has_changed(self, before: int, after: int) -> TruthValue:
        """Whether a value that is renewed has changed."""
        one, other = self._values.value(before), self._values.value(after)
        if is_known(one) and is_known(other):
            return unsigned(one) != unsigned(other)
        if before == after or not {UNKNOWN, PRESENT}.isdisjoint((before, after)):
            return None
        return True if ABSENT in (before, after) else None

    def _answers(
        self,
        watch: ContractWatch,
        state_number: int,
        changes: Mapping[int, TruthValue],
        moves: Sequence[Move | None],
    ) -> tuple[TruthValue, ...]:
        """What the step of the observer of a contract says of its measured conditions."""
        move = next((each for each in moves if each and each.machine == watch.observer), None)
        if move is None:
            return ()
        state = self.state(state_number)
        known = self._known_values(self._reading_values(state.values, ()))
        found = list[TruthValue]()
        for atom in watch.measured_atoms:
            slots = self._slots_in(atom)
            is_old = all(self._age(state, slot, changes) >= watch.lag for slot in slots)
            found.append(watch.answer(atom, known, move) if is_old else None)
        return tuple(found)

    def _slots_in(self, atom: m.Expr) -> list[int]:
        """The visible values that a condition reads."""
        return [self._slots_read[n] for n in sorted(_reading_names(atom)) if n in self._slots_read]

    def _age(self, state: TrackerState, slot: int, changes: Mapping[int, TruthValue]) -> int:
        """For how many ticks a visible value has not changed, as far as contracts ask."""
        return 0 if slot in changes else min(state.ages[slot] + 1, self._longest_lag)

    def _with_value(self, state_number: int, slot: int, value: int) -> int:
        """The tracker state with another visible value."""
        state = self.state(state_number)
        seen = state.values
        if seen[slot] == value:
            return state_number
        values = (*seen[:slot], value, *seen[slot + 1 :])
        return self._state_numbers.number(state._replace(values=values))

    def _step(
        self,
        tracker_state: TrackerState,
        machine_states: Sequence[MachineState],
        ticks: int,
        changes: Mapping[int, TruthValue],
        answers: Sequence[tuple[TruthValue, ...]],
    ) -> tuple[int, tuple[int, ...]]:
        now = self._reading_values(tracker_state.values, machine_states)
        failed = any(local.clock == FAILED for local in machine_states)
        states, violated = [], []
        watched = self._watched_now(now) if self._watched else ()
        changed = dict(
            zip(self._watched, self._watched_changes(tracker_state, watched, changes), strict=True)
        )
        ages = tuple(
            min(self._age(tracker_state, slot, changes) + ticks - 1, self._longest_lag)
            for slot in range(len(tracker_state.ages))
        )
        contracts = []
        for number, state in enumerate(tracker_state.contracts):
            watch = self._contracts[number]
            atoms = self._contract_atoms(watch, now, tracker_state, changes, answers[number])
            after, verdicts = self._step_monitor(~number, state, atoms, ticks, changed)
            if False in verdicts:
                return PRUNED, ()
            contracts.append(after)
        zipped = zip(tracker_state.states, self._truths(now), strict=True)
        for index, (state, found) in enumerate(zipped):
            atoms = found
            if self._deciding and None in found:
                atoms = self._decided(index, found, now, tracker_state, changed)
            after, verdicts = self._step_monitor(index, state, atoms, ticks, changed)
            self._verdicts[index] |= verdicts - {None} if failed else verdicts
            if failed and None in verdicts:
                self._open_after_failure.add(index)
            if False in verdicts and index < self._requirement_count:
                violated.append(index)
            states.append(after)
        reached = TrackerState(tuple(states), tracker_state.values, watched, tuple(contracts), ages)
        return self._state_numbers.number(reached), tuple(violated)

    def _decided(
        self,
        index: int,
        atoms: tuple[TruthValue, ...],
        now: tuple[object, ...],
        state: TrackerState,
        changed: Mapping[m.Expr, TruthValue],
    ) -> tuple[TruthValue, ...]:
        """The truth of conditions at one tick: one that would break a contract is not so."""
        known, found, monitor = self._known_values(now), list(atoms), self.monitors[index]
        for place, atom in enumerate(monitor.atoms):
            if atoms[place] is None and place not in monitor.watched:
                assumed = residual(atom, known)
                for truth in (True, False):
                    if any(
                        self._would_break(number, assumed, truth, known, state, changed)
                        for number in self._deciding
                    ):
                        found[place] = not truth
        return tuple(found)

    def _would_break(
        self,
        number: int,
        assumed: m.Expr,
        truth: bool,
        known: KnownValues,
        state: TrackerState,
        changed: Mapping[m.Expr, TruthValue],
    ) -> bool:
        """Whether a contract is surely broken at this tick if a condition has a truth value."""
        watch = self._contracts[number]
        assert self._conclusions is not None  # there are contracts
        atoms = tuple(
            self._conclusions.under(assumed, truth, residual(atom, known))
            if place not in watch.monitor.watched
            else None
            for place, atom in enumerate(watch.monitor.atoms)
        )
        begun = state.contracts[number]
        return False in self._step_monitor(~number, begun, atoms, 1, changed)[1]

    def _watched_now(self, now: tuple[object, ...]) -> tuple[int, ...]:
        """The numbers of the values whose changes are asked."""
        known = self._known_values(now)
        found = [residual(value, known) for value in self._watched]
        for value in found:
            self._note_unclear(value, known)
        return tuple(
            self._watched_numbers.number(unsigned(value)) if is_literal(value) else -1
            for value in found
        )

    def _watched_changes(
        self, state: TrackerState, watched: tuple[int, ...], changes: Mapping[int, TruthValue]
    ) -> Iterator[TruthValue]:
        """Whether each of these values changed at this tick; they do at the first one."""
        if not state.watched:
            yield from (True for _ in self._watched)
            return
        for value, was, number in zip(self._watched, state.watched, watched, strict=True):
            names, slots = _reading_names(value), self._slots_in(value)
            is_sent = len(names) == len(slots) and not m.is_live(value)
            if is_sent and not any(slot in changes for slot in slots):
                yield False
            elif is_sent and value in self._plain_refs:
                yield changes[slots[0]]
            else:
                yield None if -1 in (was, number) else was != number

    def _contract_atoms(
        self,
        watch: ContractWatch,
        now: tuple[object, ...],
        state: TrackerState,
        changes: Mapping[int, TruthValue],
        answers: Sequence[TruthValue],
    ) -> tuple[TruthValue, ...]:
        """The truth of the conditions of a contract as its observer saw them."""
        number = self._contracts.index(watch)
        begun: MonitorState = self._obligation_numbers.by_number[state.contracts[number]]
        # Before the run has begun for the observer, it saw no measurements.
        measured = {} if begun.waiting else dict(zip(watch.measured_atoms, answers, strict=False))
        known, found = self._known_values(now), list[TruthValue]()
        for atom in watch.monitor.atoms:
            is_old = all(self._age(state, s, changes) >= watch.lag for s in self._slots_in(atom))
            if atom in measured:
                found.append(measured[atom])
            elif watch.is_measured(atom) or not is_old:
                found.append(None)
            else:
                found += _truth_values([residual(atom, known)])
        return tuple(found)

    def _step_monitor(
        self,
        index: int,
        state: int,
        atoms: tuple[TruthValue, ...],
        ticks: int,
        changed: Mapping[m.Expr, TruthValue] | None = None,
    ) -> tuple[int, frozenset[TruthValue]]:
        """A step of one monitor, cached: steps of all often differ in other monitors only.

        Watched values change at the first tick, if at all. Monitors of contracts have negative
        indexes.
        """
        monitor = self.monitors[index] if index >= 0 else self._contracts[~index].monitor
        first = atoms
        if monitor.watched and changed is not None:
            first, atoms = (
                tuple(
                    (changed[monitor.atoms[i]] if is_first else False)
                    if i in monitor.watched
                    else truth
                    for i, truth in enumerate(atoms)
                )
                for is_first in (True, False)
            )
        key = index, state, (*first, *atoms), ticks
        if key not in self._monitor_cache:
            before = self._obligation_numbers.by_number[state]
            after, verdicts = monitor.step(before, first, 1 if first != atoms else ticks)
            if first != atoms and ticks > 1:
                after, more = monitor.step(after, atoms, ticks - 1)
                verdicts |= more
            self._monitor_cache[key] = self._obligation_numbers.number(after), frozenset(verdicts)
        return self._monitor_cache[key]

    def _reading_values(
        self, seen: Sequence[int], machine_states: Sequence[MachineState]
    ) -> tuple[object, ...]:
        """The abstract values of readings: states, or numbers; None for those that have none.

        Nothing is known of a machine that has failed.
        """
        found = list[object]()
        for index, kind, slot in self._locations:
            if index < 0:
                found.append(None)
            elif machine_states and machine_states[index].clock == FAILED:
                found.append(_FAILED_VALUE)
            elif kind == "sent":
                found.append(seen[slot])
            elif not machine_states:
                found.append(None)
            elif kind == "memory":
                found.append(machine_states[index].memory[slot])
            else:
                found.append(machine_states[index].state)
        return tuple(found)

    def _locate(self, reading: Reading) -> tuple[int, str, int]:
        """The machine that has a reading, -1 if there is none, and where it is there."""
        index, slot = self._index.get(reading.subsystem, -1), 0
        if reading.kind == "reported":
            index = -1
        if reading.kind == "memory" and index >= 0:
            slot = self._walkers[reading.subsystem].memory_slots.get(reading.element[0], -1)
            index = index if slot >= 0 else -1
        if reading.kind == "sent" and index >= 0:
            slot = self._slots[reading.subsystem, reading.element, reading.initial]
        return index, reading.kind, slot

    def _truths(self, now: tuple[object, ...]) -> tuple[tuple[TruthValue, ...], ...]:
        """The truth of the conditions of each monitor."""
        if now not in self._truth_cache:
            self._truth_cache[now] = self._compute_truths(now)
        return self._truth_cache[now]

    def _compute_truths(self, now: tuple[object, ...]) -> tuple[tuple[TruthValue, ...], ...]:
        known, pairs = self._known_values(now), list(zip(self._readings, now, strict=True))
        absent = {x.name for x, found in pairs if found == ABSENT}
        failed = {x.name for x, found in pairs if found is _FAILED_VALUE}
        truths = []
        for index, monitor in enumerate(self.monitors):
            residuals = [residual(atom, known) for atom in monitor.atoms]
            truths.append(_truth_values(residuals))
            for place, (atom, condition) in enumerate(zip(monitor.atoms, residuals, strict=True)):
                if isinstance(condition, m.Truth) or place in monitor.watched:
                    continue
                self._note_unclear(condition, known)
                self.absent_values[index] |= _reading_names(atom) & absent or {""}
                if not _reading_names(condition) or not _reading_names(condition) <= failed:
                    self._unknown_conditions.add(index)
        return tuple(truths)

    def _known_values(self, now: tuple[object, ...]) -> KnownValues:
        memory: dict[str, AbstractValue] = {}
        for reading, found in zip(self._readings, now, strict=True):
            value = self._value(reading, found)
            if value is not None:
                memory[reading.name] = value
        return replace(self._constants, memory=memory, _residuals={})

    def _value(self, reading: Reading, found: object) -> AbstractValue | None:
        if isinstance(found, str):
            return m.Member(found, type=reading.type)
        if not isinstance(found, int):
            return None
        if reading.asks_presence:
            return m.FALSE if found == ABSENT else m.TRUE
        if reading.kind == "memory":
            return self._walkers[reading.subsystem].memory_value(reading.element[0], found)
        return self._values.value(found)

    def _note_unclear(self, condition: m.Expr, known: KnownValues) -> None:
        """Note values whose region is not enough for a decision."""
        if known.reads_region(condition):
            names = _reading_names(condition)
            self._values.widened |= {
                _assignment_target(x) for x in self._readings if x.name in names
            }

    def ends_early(self, index: int) -> bool:
        """Whether a failure left a requirement open on some trace."""
        return index in self._open_after_failure

    def proves(self, index: int) -> bool:
        """Whether a requirement was met on all traces, as far as they were explored.

        A verdict that a failure leaves open is no violation, since the run is over, unless
        something else may have left it open.
        """
        is_open = index in self._open_after_failure and index in self._unknown_conditions
        return not is_open and not self._verdicts[index] & {None, False}


class _ObservedMachine(dict[int, int]):
    """Number of a machine state -> number of the part that readings observe, and if it failed."""

    def __init__(self, walker: Walker, places: Iterable[tuple[int, str, int]]) -> None:
        self.walker = walker
        self._state, self._slots, self._seen = False, list[int](), Interner()
        self.examples: list[MachineState] = []
        """A state for each number of such a part."""
        for _, kind, slot in places:
            self._state |= kind == "state"
            self._slots += [slot] if kind == "memory" else []

    def __missing__(self, number: int) -> int:
        local: MachineState = self.walker.states.by_number[number]
        memory = tuple([local.memory[slot] for slot in self._slots])
        shown = local.clock == FAILED, local.state if self._state else "", memory
        seen = self._seen.number(shown)
        if seen == len(self.examples):
            self.examples.append(local)
        return self.setdefault(number, seen)


_FAILED_VALUE = object()
"""Stands for the values of a machine that has failed."""


def _reading_names(expr: m.Expr) -> set[str]:
    """The readings that an expression names."""
    return {leaf.name for leaf in value_leaves(expr) if isinstance(leaf, m.MemoryRef)}


def _truth_values(exprs: Iterable[m.Expr]) -> tuple[TruthValue, ...]:
    return tuple(each.value if isinstance(each, m.Truth) else None for each in exprs)


def _assignment_target(reading: Reading) -> str:
    """The target of the assignments that write a reading; copies have no requirements."""
    name, *element = reading.element
    return f"{reading.subsystem}.{'.'.join(('y', name, *element) if element else (name,))}"
