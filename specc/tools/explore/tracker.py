"""Tracks requirements while machines are stepped: their readings, conditions and obligations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from specc.model import expr as m
from specc.model.requirement import Reading, Requirement
from specc.model.system import System
from specc.proof import InputName
from specc.tools.explore.monitor import Monitor, TruthValue
from specc.tools.explore.partial import (
    AbstractValue,
    KnownValues,
    residual,
    static_values,
)
from specc.tools.explore.regions import value_leaves
from specc.tools.explore.transitions import FAILED, MachineState
from specc.tools.explore.values import ABSENT, UNKNOWN, Interner, ValueTable
from specc.tools.explore.walker import Walker

_Ticks = tuple[int, int, tuple[TruthValue, ...], int]
"""A call of a monitor: its index, the number of its state, truth of conditions, ticks."""
Visible = Iterable[tuple[int, InputName, int]]
"""Machine and output of values that have just become visible, with their numbers."""


class TrackerState(NamedTuple):
    """Numbers of the obligations, and of the last visible value of each reading."""

    states: tuple[int, ...]
    values: tuple[int, ...]


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
    ) -> None:
        """Violations of `probes` are not reported. `tick_s` is the base tick of the whole system.

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
        found = {x.name: x for requirement in requirements for x in requirement.readings}
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
        self._step_cache: dict[tuple[int, tuple[int, ...], int], tuple[int, tuple[int, ...]]] = {}
        self._observed = [
            _ObservedMachine(walker, [place for place in self._locations if place[0] == index])
            for index, walker in enumerate(walkers)
        ]
        obligations = tuple(
            self._obligation_numbers.number(monitor.initial_state) for monitor in self.monitors
        )
        first = tuple(self._initial_value(reading) for reading in sent.values())
        self.initial_state = self._state_numbers.number(TrackerState(obligations, first))

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

    def after_ticks(
        self, state_number: int, visible: Visible, machines: Sequence[int], ticks: int
    ) -> tuple[int, tuple[int, ...]]:
        """The obligations after some ticks with constant values, and the violations on them.

        `machines` are numbers of machine states. See `proves` about one that has failed.
        """
        for machine, output, value in visible:
            for slot in self._slots_of_output.get((machine, output), ()):
                state_number = self._with_value(state_number, slot, value)
        observed = tuple([known[n] for known, n in zip(self._observed, machines, strict=True)])
        key = state_number, observed, ticks
        if key not in self._step_cache:
            each = zip(self._observed, machines, strict=True)
            machine_states = [known.walker.states.by_number[n] for known, n in each]
            self._step_cache[key] = self._step(
                self._state_numbers.by_number[state_number], machine_states, ticks
            )
        return self._step_cache[key]

    def _with_value(self, state_number: int, slot: int, value: int) -> int:
        """The tracker state with another visible value."""
        states, seen = self._state_numbers.by_number[state_number]
        if seen[slot] == value:
            return state_number
        return self._state_numbers.number(
            TrackerState(states, (*seen[:slot], value, *seen[slot + 1 :]))
        )

    def _step(
        self, tracker_state: TrackerState, machine_states: Sequence[MachineState], ticks: int
    ) -> tuple[int, tuple[int, ...]]:
        now = self._reading_values(tracker_state.values, machine_states)
        failed = any(local.clock == FAILED for local in machine_states)
        states, violated = [], []
        zipped = zip(tracker_state.states, self._truths(now), strict=True)
        for index, (state, atoms) in enumerate(zipped):
            after, verdicts = self._step_monitor(index, state, atoms, ticks)
            self._verdicts[index] |= verdicts - {None} if failed else verdicts
            if failed and None in verdicts:
                self._open_after_failure.add(index)
            if False in verdicts and index < self._requirement_count:
                violated.append(index)
            states.append(after)
        return self._state_numbers.number(TrackerState(tuple(states), tracker_state.values)), tuple(
            violated
        )

    def _step_monitor(
        self, index: int, state: int, atoms: tuple[TruthValue, ...], ticks: int
    ) -> tuple[int, frozenset[TruthValue]]:
        """A step of one monitor, cached: steps of all often differ in other monitors only."""
        key = index, state, atoms, ticks
        if key not in self._monitor_cache:
            after, verdicts = self.monitors[index].step(
                self._obligation_numbers.by_number[state], atoms, ticks
            )
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
            elif machine_states[index].clock == FAILED:
                found.append(_FAILED_VALUE)
            elif kind == "sent":
                found.append(seen[slot])
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
            for atom, condition in zip(monitor.atoms, residuals, strict=True):
                if isinstance(condition, m.Truth):
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
        for _, kind, slot in places:
            self._state |= kind == "state"
            self._slots += [slot] if kind == "memory" else []

    def __missing__(self, number: int) -> int:
        local: MachineState = self.walker.states.by_number[number]
        memory = tuple([local.memory[slot] for slot in self._slots])
        shown = local.clock == FAILED, local.state if self._state else "", memory
        return self.setdefault(number, self._seen.number(shown))


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
