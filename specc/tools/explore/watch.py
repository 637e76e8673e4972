"""Monitors of requirements while machines are stepped: values of conditions, obligations."""

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
from specc.tools.explore.moves import OVER, Local
from specc.tools.explore.partial import (
    AbstractValue,
    Known,
    filled,
    static,
)
from specc.tools.explore.regions import leaves
from specc.tools.explore.values import ABSENT, UNKNOWN, Numbers, ValueNumbers
from specc.tools.explore.walker import Walker

_Ticks = tuple[int, int, tuple[TruthValue, ...], int]
"""A call of a monitor: its index, the number of its state, truth of conditions, ticks."""
Visible = Iterable[tuple[int, InputName, int]]
"""Machine and output of values that have just become visible, with their numbers."""


class Watched(NamedTuple):
    """Numbers of the obligations, and of the value of each reading that was seen last."""

    states: tuple[int, ...]
    seen: tuple[int, ...]


class Watch:
    """Follows some requirements over the machines of a slice.

    Values are seen as the monitors of a run see them: state and memory from the step on, outputs
    from the tick at which they become visible.
    """

    def __init__(
        self,
        required: Sequence[Requirement],
        probes: Sequence[Requirement],
        walkers: Sequence[Walker],
        values: ValueNumbers,
        system: System,
        tick_s: Fraction,
    ) -> None:
        """Violations of `probes` are not told. `tick_s` is the base tick of the whole system.

        Raises NotFollowedError.
        """
        requirements = [*required, *probes]
        self._required = len(required)
        self.monitors = [Monitor(requirement, tick_s) for requirement in requirements]
        self._said: list[set[TruthValue]] = [set() for _ in requirements]
        self._left_open, self._unclear = set[int](), set[int]()
        """The requirements that were open after a failure, and those with conditions that were
        unknown for another reason than that a machine had failed."""
        self.lacking: list[set[str]] = [set() for _ in requirements]
        """Of each: values that were absent where a condition was unknown; "" if it was for more."""
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
        self._slots = {key: slot for slot, key in enumerate(sent)}
        self._places = [self._place(reading) for reading in self._readings]
        self._shown: dict[tuple[int, InputName], list[int]] = {}
        for slot, x in enumerate(sent.values()):
            output = self._index[x.subsystem], (x.element[0], x.element[1])
            self._shown.setdefault(output, []).append(slot)
        # Only constants of the system: parameters of a description may have the same names.
        self._known = Known({}, {c.name: c.value for c in system.constants}, tick_s)
        self._numbers, self._left = Numbers(), Numbers()
        self._followed: dict[_Ticks, tuple[int, frozenset[TruthValue]]] = {}
        self._answers: dict[tuple[object, ...], tuple[tuple[TruthValue, ...], ...]] = {}
        self._steps: dict[tuple[int, tuple[int, ...], int], tuple[int, tuple[int, ...]]] = {}
        self._exposed = [
            _Exposed(walker, [place for place in self._places if place[0] == index])
            for index, walker in enumerate(walkers)
        ]
        begun = tuple(self._left.of(monitor.begin) for monitor in self.monitors)
        first = tuple(self._initial(reading) for reading in sent.values())
        self.begin = self._numbers.of(Watched(begun, first))

    def _initial(self, reading: Reading) -> int:
        if reading.initial is None:
            return ABSENT
        reader, peer, element = reading.initial
        subsystem = next(s for s in self._system.subsystems if s.qualified_name == reader)
        init, known = subsystem.inputs[peer, element].init, static(subsystem, self._system)
        return (
            UNKNOWN if init is None else self._values.of(reading.name, filled(init, known), known)
        )

    def at(self, number: int) -> Watched:
        """The obligations and seen values with a number."""
        found: Watched = self._numbers.things[number]
        return found

    def of(self, watched: Watched) -> int:
        """The number of obligations and seen values."""
        return self._numbers.of(watched)

    def known(self, number: int, locals_: Sequence[Local]) -> Known:
        """The values of the readings in a configuration."""
        seen = self.at(number).seen
        return self._known_of(self._now(seen, locals_))

    def truth(self, index: int, number: int, locals_: Sequence[Local]) -> TruthValue:
        """Whether a requirement about single ticks holds in a configuration."""
        atoms = self._truths(self._now(self.at(number).seen, locals_))[index]
        begin = self._left.of(self.monitors[index].begin)
        (holds,) = self._monitored(index, begin, atoms, 1)[1]
        return holds

    def conditions(self, known: Known) -> list[list[m.Expr]]:
        """The conditions of each monitor, with known values filled in."""
        return [[filled(atom, known) for atom in monitor.atoms] for monitor in self.monitors]

    def moving(self, index: int, state: int, atoms: Iterable[m.Expr]) -> int:
        """For how many ticks such conditions only move deadlines and ages of a monitor."""
        return self.monitors[index].moving(self._left.things[state], _truths(atoms))

    def moved(self, index: int, state: int, atoms: Iterable[m.Expr], ticks: int) -> int:
        """The state of a monitor after so many ticks with such conditions."""
        return self._monitored(index, state, _truths(atoms), ticks)[0]

    def after(
        self, number: int, visible: Visible, machines: Sequence[int], ticks: int
    ) -> tuple[int, tuple[int, ...]]:
        """The obligations after some ticks with constant values, and the violations on them.

        `machines` are by the numbers of their `Local`. See `proves` about one that has failed.
        """
        for machine, output, value in visible:
            for slot in self._shown.get((machine, output), ()):
                number = self._shows(number, slot, value)
        exposed = tuple([known[n] for known, n in zip(self._exposed, machines, strict=True)])
        key = number, exposed, ticks
        if key not in self._steps:
            each = zip(self._exposed, machines, strict=True)
            locals_ = [known.walker.locals.things[n] for known, n in each]
            self._steps[key] = self._step(self._numbers.things[number], locals_, ticks)
        return self._steps[key]

    def _shows(self, number: int, slot: int, value: int) -> int:
        """The obligations with another value that is seen."""
        states, seen = self._numbers.things[number]
        if seen[slot] == value:
            return number
        return self._numbers.of(Watched(states, (*seen[:slot], value, *seen[slot + 1 :])))

    def _step(
        self, watched: Watched, locals_: Sequence[Local], ticks: int
    ) -> tuple[int, tuple[int, ...]]:
        now = self._now(watched.seen, locals_)
        over = any(local.clock == OVER for local in locals_)
        states, violated = [], []
        zipped = zip(watched.states, self._truths(now), strict=True)
        for index, (state, atoms) in enumerate(zipped):
            after, said = self._monitored(index, state, atoms, ticks)
            self._said[index] |= said - {None} if over else said
            if over and None in said:
                self._left_open.add(index)
            if False in said and index < self._required:
                violated.append(index)
            states.append(after)
        return self._numbers.of(Watched(tuple(states), watched.seen)), tuple(violated)

    def _monitored(
        self, index: int, state: int, atoms: tuple[TruthValue, ...], ticks: int
    ) -> tuple[int, frozenset[TruthValue]]:
        """A step of one monitor, cached: steps of all often differ in other monitors only."""
        key = index, state, atoms, ticks
        if key not in self._followed:
            after, said = self.monitors[index].step(self._left.things[state], atoms, ticks)
            self._followed[key] = self._left.of(after), frozenset(said)
        return self._followed[key]

    def _now(self, seen: tuple[int, ...], locals_: Sequence[Local]) -> tuple[object, ...]:
        """The abstract values of readings: states, or numbers; None for those that have none.

        Nothing is known of a machine that has failed.
        """
        found = list[object]()
        for index, kind, slot in self._places:
            if index < 0:
                found.append(None)
            elif locals_[index].clock == OVER:
                found.append(_FAILED)
            elif kind == "sent":
                found.append(seen[slot])
            elif kind == "memory":
                found.append(locals_[index].memory[slot])
            else:
                found.append(locals_[index].state)
        return tuple(found)

    def _place(self, reading: Reading) -> tuple[int, str, int]:
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
        if now not in self._answers:
            self._answers[now] = self._judged(now)
        return self._answers[now]

    def _judged(self, now: tuple[object, ...]) -> tuple[tuple[TruthValue, ...], ...]:
        known, pairs = self._known_of(now), list(zip(self._readings, now, strict=True))
        absent = {x.name for x, found in pairs if found == ABSENT}
        failed = {x.name for x, found in pairs if found is _FAILED}
        truths = []
        for index, monitor in enumerate(self.monitors):
            said = [filled(atom, known) for atom in monitor.atoms]
            truths.append(_truths(said))
            for atom, left in zip(monitor.atoms, said, strict=True):
                if isinstance(left, m.Truth):
                    continue
                self._widen(left, known)
                self.lacking[index] |= _named(atom) & absent or {""}
                if not _named(left) or not _named(left) <= failed:
                    self._unclear.add(index)
        return tuple(truths)

    def _known_of(self, now: tuple[object, ...]) -> Known:
        memory: dict[str, AbstractValue] = {}
        for reading, found in zip(self._readings, now, strict=True):
            value = self._value(reading, found)
            if value is not None:
                memory[reading.name] = value
        return replace(self._known, memory=memory, _lets={})

    def _value(self, reading: Reading, found: object) -> AbstractValue | None:
        if isinstance(found, str):
            return m.Member(found, type=reading.type)
        if not isinstance(found, int):
            return None
        if reading.asks_presence:
            return m.FALSE if found == ABSENT else m.TRUE
        if reading.kind == "memory":
            return self._walkers[reading.subsystem].valued(reading.element[0], found)
        return self._values.value(found)

    def _widen(self, left: m.Expr, known: Known) -> None:
        """Note values whose region is not enough for a decision."""
        if known.is_unclear(left):
            asked = _named(left)
            self._values.widened |= {_target(x) for x in self._readings if x.name in asked}

    def ends_early(self, index: int) -> bool:
        """Whether a failure left a requirement open on some trace."""
        return index in self._left_open

    def proves(self, index: int) -> bool:
        """Whether a requirement was met on all traces, as far as they were followed.

        A verdict that a failure leaves open is no violation, since the run is over, unless
        something else may have left it open.
        """
        is_open = index in self._left_open and index in self._unclear
        return not is_open and not self._said[index] & {None, False}


class _Exposed(dict[int, int]):
    """Number of a `Local` -> number of what readings have of it, and whether it has failed."""

    def __init__(self, walker: Walker, places: Iterable[tuple[int, str, int]]) -> None:
        self.walker = walker
        self._state, self._slots, self._seen = False, list[int](), Numbers()
        for _, kind, slot in places:
            self._state |= kind == "state"
            self._slots += [slot] if kind == "memory" else []

    def __missing__(self, number: int) -> int:
        local: Local = self.walker.locals.things[number]
        memory = tuple([local.memory[slot] for slot in self._slots])
        shown = local.clock == OVER, local.state if self._state else "", memory
        return self.setdefault(number, self._seen.of(shown))


_FAILED = object()
"""Stands for the values of a machine that has failed."""


def _named(expr: m.Expr) -> set[str]:
    """The readings that an expression names."""
    return {leaf.name for leaf in leaves(expr) if isinstance(leaf, m.MemoryRef)}


def _truths(said: Iterable[m.Expr]) -> tuple[TruthValue, ...]:
    return tuple(each.value if isinstance(each, m.Truth) else None for each in said)


def _target(reading: Reading) -> str:
    """The target of the assignments that write a reading; copies have no requirements."""
    name, *element = reading.element
    return f"{reading.subsystem}.{'.'.join(('y', name, *element) if element else (name,))}"
