"""How old values are in a run: when they were measured, and what they were computed from.

A value is as old as the oldest measurement that it was computed from in the step that sent it.
What nothing measured is behind counts from the step that computed it, as a constant or out of
memory; what others compute of it is as old, if nothing that was measured is ever behind that.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from specc_runtime.ages import AgeRules, MaxAge, MaxCommandAge
from specc_runtime.buffers import AGE, FRESH, LATE, slots
from specc_runtime.faults import TooOld
from specc_runtime.plant import NO_SAMPLE
from specc_runtime.sampling import Sensor
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System

_ROUNDING = 1.0 + 1e-9  # ages are multiples of a rounded tick


class Stamp(NamedTuple):
    """When a value was computed, and the oldest measurement behind it, in base ticks.

    `measured` is None without one; `device` is the element that was measured.
    """

    computed: float
    measured: float | None = None
    device: str = ""

    @property
    def since(self) -> float:
        """The tick from which its age counts."""
        return self.computed if self.measured is None else self.measured


class Clock:
    """Ages in s of what is so many ticks old, as the decimals that a specification writes."""

    def __init__(self, tick_s: float) -> None:
        tick = Fraction(tick_s).limit_denominator(10**9)
        self._numerator, self._denominator = tick.numerator, tick.denominator
        self._tick_s = tick_s

    def age_s(self, since: float, tick: float) -> float:
        """How old it is at a tick; what was measured after it is new."""
        return max(0, tick - since) * self._numerator / self._denominator

    def ticks(self, time_s: float) -> float:
        """A time in ticks, whole ones where it is that of a tick."""
        ticks = time_s / self._tick_s
        whole = round(ticks)
        return whole if abs(ticks - whole) < _WHOLE else ticks


_WHOLE = 1e-6


class Ageing:
    """The ages of what one subsystem reads and sends; `followed` are the inputs that matter.

    `received` has the stamps of the inputs that other subsystems sent, `known` those of all inputs
    of the step that is under way, `came` the inputs that were fresh in it; `held_inputs` has those
    of outputs that were committed before the others may see them.
    """

    __slots__ = (
        "_age_slots", "_asked_fresh", "_behind", "_clock", "_commands", "_late_slots", "_limits",
        "_readers", "_senders", "_sensors", "_subsystem", "_x", "before", "came", "fault",
        "followed", "held_inputs", "known", "received", "tick",
    )  # fmt: skip

    def __init__(self, subsystem: Subsystem, rules: AgeRules, clock: Clock) -> None:
        name, x = subsystem.name, subsystem.x
        own = slots(x)
        self._subsystem, self._x, self._clock = subsystem, x, clock
        self._age_slots = [(e, AGE + e) for e in own if AGE + e in own]
        self._late_slots = [(e, LATE + e) for e in own if LATE + e in own]
        self._behind = {
            (state, each.output): each
            for each in rules.behind
            if each.subsystem == name
            for state in each.states
        }
        self._limits = [each for each in rules.limits if each.subsystem == name]
        self._commands = {c.output: c for c in rules.commands if c.subsystem == name}
        fresh = {e for each in self._behind.values() for e in each.fresh}
        read = {e for each in self._behind.values() for e in (*each.held, *each.fresh)}
        read |= {e for e, _ in self._age_slots} | {each.element for each in self._limits}
        self.followed = frozenset(read)
        fresh |= {each.element for each in self._limits if each.fresh}
        self._asked_fresh = [(e, FRESH + e) for e in sorted(fresh)]
        self._sensors: dict[str, Sensor] = {}
        self._senders: dict[str, str] = {}
        self._readers: dict[str, list[tuple[Ageing, str]]] = {}
        self.received: dict[str, Stamp] = {}
        self.known: dict[str, Stamp] = {}
        self.came: frozenset[str] = frozenset()
        self.held_inputs: dict[str, Stamp] = {}
        self.before = ""
        self.fault: TooOld | None = None
        self.tick = 0

    @property
    def asks(self) -> bool:
        """Whether anything has to be done before its steps."""
        return bool(self.followed or self._late_slots or self._commands)

    def connect(self, output: str, reader: Ageing, element: str) -> None:
        """What is sent as an output, another subsystem reads as an input."""
        reader._senders[element] = self._subsystem.name
        if element in reader.followed:
            self._readers.setdefault(output, []).append((reader, element))
            if hasattr(reader._x, element):  # an initial value, there from the start
                reader.received[element] = Stamp(0)

    def sense(self, element: str, sensor: Sensor) -> None:
        """An input comes from a sensor."""
        self._sensors[element] = sensor

    def begin(self, tick: int, late: Callable[[str], int]) -> None:
        """Note the ages of all inputs, and write what is asked for into the buffer.

        Called before a step of this tick, when everything has arrived; `late` is for how many
        periods in a row a subsystem has begun no step.
        """
        x = self._x
        known = self.known = dict(self.received)
        for element, sensor in self._sensors.items():
            if sensor.value is not NO_SAMPLE:
                measured = self._clock.ticks(sensor.measured_s)
                known[element] = Stamp(measured, measured, sensor.name)
        if len(known) < len(self.followed):
            # A run may go on from one that kept no ages.
            old = [e for e in self.followed if e not in known and hasattr(x, e)]
            self.received |= dict.fromkeys(old, Stamp(tick))
            known |= self.received
        self.came = frozenset([e for e, flag in self._asked_fresh if getattr(x, flag, True)])
        self.before = self._subsystem.state
        self.tick = tick
        for element, slot in self._age_slots:
            if element in known:
                setattr(x, slot, self._clock.age_s(known[element].since, tick))
        for element, slot in self._late_slots:
            setattr(x, slot, late(self._senders[element]))

    def end(self, visible_tick: int, *, is_early: bool) -> bool:
        """Note the `fault` of the step that has ended if what it read, or sends at a tick, is too
        old; else tell the readers how old it is, or later, at `show`, if that `is_early`.
        """
        self.fault = self._judged(visible_tick)
        if self.fault is None:
            state, sends = self._subsystem.state, self._subsystem.sends[self._subsystem.state]
            stamps = {o: self._stamp(state, o) for o in self._readers if o in sends}
            if is_early:
                self.held_inputs = stamps
            else:
                self._tell(stamps)
        return self.fault is not None

    def show(self) -> None:
        """Tell the readers what was held back."""
        inputs, self.held_inputs = self.held_inputs, {}
        self._tell(inputs)

    def _judged(self, visible_tick: int) -> TooOld | None:
        state = self._subsystem.state
        for limit in self._limits:
            element, stamp = limit.element, self.known.get(limit.element)
            is_read = self.before in limit.asked or state in limit.used
            if stamp is None or not is_read or (limit.fresh and element not in self.came):
                continue
            if text := self._too_old(stamp, self.tick, limit):
                sender = self._senders.get(element)
                blamed = f"subsystem {sender}" if sender else f"device {stamp.device}"
                return self._fault(f"input {limit.name} {text}", blamed)
        for output in self._subsystem.sends[state] if self._commands else ():
            command = self._commands.get(output)
            if command is None:
                continue
            if text := self._too_old(self._stamp(state, output), visible_tick, command):
                fault = self._fault(f"command {command.device} {text}")
                fault.device = command.device
                return fault
        return None

    def _fault(self, message: str, culprit: str = "") -> TooOld:
        return TooOld(self._subsystem.name, self._subsystem.state, message, culprit)

    def _too_old(self, stamp: Stamp, tick: int, limit: MaxAge | MaxCommandAge) -> str:
        """What is wrong with an age; empty if nothing is, or a measurement is still to come."""
        if stamp.measured is None and not limit.computed:
            return ""
        age_s = self._clock.age_s(stamp.since, tick)
        if age_s <= limit.most_s * _ROUNDING:
            return ""
        origin = "counted from its computation" if limit.computed else f"measured by {stamp.device}"
        return f"is {age_s:.6g} s old, {origin}; `max_age` is {limit.most_s:g} s"

    def _tell(self, stamps: Mapping[str, Stamp]) -> None:
        for output, stamp in stamps.items():
            for reader, element in self._readers.get(output, ()):
                # Not changed in place: a run may go back to what was before.
                reader.received = {**reader.received, element: stamp}

    def _stamp(self, state: str, output: str) -> Stamp:
        rule = self._behind.get((state, output))
        read = () if rule is None else (*rule.held, *(e for e in rule.fresh if e in self.came))
        known = [self.known[element] for element in read if element in self.known]
        measured = [stamp for stamp in known if stamp.measured is not None]
        if rule is not None and rule.computed:
            return Stamp(min((stamp.computed for stamp in known), default=self.tick))
        if not measured:
            return Stamp(self.tick)
        oldest = min(measured, key=lambda stamp: stamp.since)
        return Stamp(self.tick, oldest.measured, oldest.device)

    def saved(self, tick_s: float) -> dict[str, Any]:
        """Stamps in s, by input and by output that was held back."""
        return {
            name: {
                e: [s.computed * tick_s, _in_s(s.measured, tick_s), s.device] for e, s in of.items()
            }
            for name, of in (("received", self.received), ("held", self.held_inputs))
        }

    def restore(self, saved: Any) -> None:
        """Go on with those; raises LookupError, TypeError, ValueError for other data."""
        self.received = self._read(saved.get("received", {}), self.followed)
        self.held_inputs = self._read(saved.get("held", {}), self._readers)

    def _read(self, saved: Any, known: Collection[str]) -> dict[str, Stamp]:
        ticks = self._clock.ticks
        found = {}
        for element, (computed_s, measured_s, device) in saved.items():
            if element in known:
                measured = None if measured_s is None else ticks(float(measured_s))
                found[element] = Stamp(ticks(float(computed_s)), measured, str(device))
        return found


def _in_s(ticks: float | None, tick_s: float) -> float | None:
    return None if ticks is None else ticks * tick_s


def ageing(system: System, sensors: Mapping[str, Sensor]) -> dict[str, Ageing]:
    """Subsystem -> the ages of what it reads and sends; those alone of which any matters."""
    rules, clock = system.ages or AgeRules(), Clock(system.tick_s)
    every = {s.subsystem.name: Ageing(s.subsystem, rules, clock) for s in system.subsystems}
    used = {name for name, each in every.items() if each.asks}
    for item in system.connections:
        every[item.source].connect(item.output, every[item.target], item.input)
        if item.input in every[item.target].followed:
            used.add(item.source)
    for sensed in system.plant.inputs if system.plant else ():
        if sensed.element in every[sensed.subsystem].followed and sensed.sensor in sensors:
            every[sensed.subsystem].sense(sensed.element, sensors[sensed.sensor])
    return {name: each for name, each in every.items() if name in used}
