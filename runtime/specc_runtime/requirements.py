"""What a specification requires of every run: how a run is followed, and what its report says."""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, ClassVar, Literal

from specc_runtime.faults import text_of
from specc_runtime.records import StepRecord
from specc_runtime.sampling import PLANT
from specc_runtime.temporal import (
    TRUE,
    UNKNOWN,
    Formula,
    Judgement,
    check_runs,
    of_judgement,
    read_judgement,
)

Verdict = Literal["met", "violated", "unknown"]
Told = Callable[[Mapping[str, Any]], dict[str, Any]]
"""Makes plain data of values by their attributes, or values of the data."""


class Requirement:
    """What is required, at every tick if it `lasts`, else at the first one; and what became of it.

    `reads` has the attribute of each value that it names, by that name.
    """

    def __init__(
        self,
        that: str,
        because: str,
        formula: Formula,
        reads: Mapping[str, str],
        *,
        lasts: bool = True,
    ) -> None:
        self.that = that
        self.because = because
        self.reads = reads
        self.formula = formula
        self._lasts = lasts
        self.holds = False
        """Whether it does, at the last tick that is judged."""
        self._worst = TRUE
        self._count = 0
        self._over = False
        self._earlier: deque[Mapping[str, Any]] = deque()
        self._first: dict[str, tuple[int, dict[str, Any]]] = {}
        """By the verdict that it makes, the first such tick and the values that are told of it."""

    def step(self, values: Mapping[str, Any]) -> None:
        """Take in a tick with the values that are there then."""
        self._earlier.append(values)
        found = self.formula.step()
        if found is None:
            return
        then = self._earlier.popleft()
        self.holds = found[0][0]
        if self._lasts or not self._count:
            self._judge(found, then)
        self._count += 1

    def _judge(self, found: Judgement, then: Mapping[str, Any]) -> None:
        (low, high), worst = found, self._worst
        self._worst = min(low, worst[0]), min(high, worst[1])
        if not low[0]:
            verdict = "unknown" if high[0] else "violated"
            if verdict not in self._first:
                self._first[verdict] = self._count, self._shown(then)

    def pass_over(self, ticks: int) -> None:
        """Nothing is known of so many ticks; all atoms are unknown."""
        for _ in range(ticks):
            self.step({})

    def finish(self, missed: int) -> None:
        """The run is over, `missed` ticks ago: all that is still to be judged is unknown."""
        self.pass_over(0 if self._over else missed + self.formula.delay)
        self._over = True

    @property
    def verdict(self) -> Verdict:
        """What is known of it; a requirement is met only once the run is over."""
        if not self._worst[1][0]:
            return "violated"
        return "met" if self._over and self._count and self._worst[0][0] else "unknown"

    def as_data(self, tick_s: float) -> dict[str, Any]:
        """The entry of the report; `time_s` is the first tick that makes the verdict."""
        verdict = self.verdict
        margin = {"met": self._worst[0][1], "violated": self._worst[1][1], "unknown": None}[verdict]
        first = self._first.get(verdict)
        return {
            "that": self.that,
            "because": self.because,
            "verdict": verdict,
            "margin": None if margin is None or math.isinf(margin) else margin,
            "time_s": first[0] * tick_s if first else None,
            "values": first[1] if first else {},
        }

    def saved(self, told: Told) -> dict[str, Any]:
        """What it remembers of the run."""
        runs = [list(same) for _, same in groupby(self._earlier, id)]
        return {
            "that": self.that,
            "shape": self.formula.shape,
            "formula": self.formula.saved(),
            "holds": self.holds,
            "worst": of_judgement(self._worst),
            "count": self._count,
            "earlier": [[len(same), told(same[0])] for same in runs],
            "first": self._first,
        }

    def is_of(self, saved: Any) -> bool:
        """Whether that means something to it: it reaches over the same ticks."""
        return bool(saved.get("shape") == self.formula.shape)

    def restore(self, saved: Any, values_of: Told) -> None:
        """Remember that; raises KeyError, TypeError, ValueError for other data."""
        self.formula.restore(saved["formula"])
        self.holds, self._count = bool(saved["holds"]), int(saved["count"])
        self._worst = read_judgement(saved["worst"])
        check_runs(saved["earlier"], self.formula.delay)
        runs = [(int(count), values_of(values)) for count, values in saved["earlier"]]
        self._earlier = deque([values for count, values in runs for _ in range(count)])
        self._first = {str(v): (int(at), dict(shown)) for v, (at, shown) in saved["first"].items()}

    def _shown(self, values: Mapping[str, Any]) -> dict[str, Any]:
        plain = (bool, int, float, str)
        return {
            name: None
            if attribute not in values
            else values[attribute]
            if isinstance(values[attribute], plain)
            else text_of(values[attribute])
            for name, attribute in self.reads.items()
        }


@dataclass(frozen=True, slots=True)
class Reading:
    """A value that requirements name: `element` of `subsystem`, kept as `attribute`.

    What is observed of the plant is a value at every tick.

    What was sent is seen when others see it; all else as it is after the step, from its time stamp
    on. `initial` is the input, with its subsystem, that has the value before anything is sent.
    """

    attribute: str
    subsystem: str
    kind: Literal["state", "memory", "sent", "reported", "observed"]
    element: str = ""
    initial: tuple[str, str] | None = None
    asks_presence: bool = False


ABSENT: Any = object()


def _found(reading: Reading, record: StepRecord, sent: Mapping[str, Any], subsystem: Any) -> Any:
    """The value after a step that is committed; `subsystem` is None of what is observed."""
    if reading.kind == "state":
        return record.state
    if reading.kind in ("sent", "observed"):
        return sent.get(reading.element, ABSENT)
    source = subsystem.memory if reading.kind == "memory" else subsystem.x
    return getattr(source, reading.element, ABSENT)


def _told(reading: Reading, value: Any) -> Any:
    return value is not ABSENT if reading.asks_presence else value


class _Alike:
    """Requirements that read the same subsystems, whose values are known until the same tick."""

    def __init__(
        self, requirements: list[Requirement], readings: list[Reading], of: Requirements
    ) -> None:
        self.requirements = requirements
        self.values = type(of.values)()
        self.tick = 0
        self.settled = {reading.subsystem: 0 for reading in readings}
        self.readings: defaultdict[str, list[Reading]] = defaultdict(list)
        self._atoms = [atom for each in requirements for atom in each.formula.atoms()]
        self._known: Mapping[str, Any] = {}
        self._changes: defaultdict[int, dict[str, Any]] = defaultdict(dict)
        for reading in readings:
            self.readings[reading.subsystem].append(reading)

    def change(self, reading: Reading, tick: int, value: Any) -> None:
        """From this tick on a value is another one, or not known."""
        self._changes[tick][reading.attribute] = value

    def begin(self) -> None:
        """Judge conditions on what there is before anything is known."""
        for atom in self._atoms:
            atom.update()

    def advance(self, tick: int) -> None:
        """Judge the ticks before `tick` of which all values are known."""
        last = min(tick, *self.settled.values()) if self.settled else tick
        while self.tick < last:
            known = self._known
            found = self._changes.pop(self.tick, {})
            changes = {n: v for n, v in found.items() if known.get(n, ABSENT) is not v}
            if changes:
                self._known = {n: v for n, v in {**known, **changes}.items() if v is not ABSENT}
                for name, value in changes.items():
                    if value is ABSENT:
                        delattr(self.values, name)
                    else:
                        setattr(self.values, name, value)
                for atom in self._atoms:
                    if not atom.reads.isdisjoint(changes):
                        atom.update()
            for requirement in self.requirements:
                requirement.step(self._known)
            self.tick += 1

    def saved(self, told: Told) -> dict[str, Any]:
        """What is known of the run so far."""
        changes = {}
        for tick, change in self._changes.items():
            gone = [name for name, value in change.items() if value is ABSENT]
            there = {name: value for name, value in change.items() if value is not ABSENT}
            changes[str(tick)] = [told(there), gone]
        return {
            "tick": self.tick,
            "settled": self.settled,
            "known": told(self._known),
            "changes": changes,
            "each": [requirement.saved(told) for requirement in self.requirements],
        }

    def restore(self, saved: Any, tick: int, values_of: Told) -> list[str]:
        """See `Requirements`; nothing is known of the run if `saved` is None."""
        saved = saved or {"tick": tick, "settled": {}, "known": {}, "changes": {}, "each": []}
        self.tick = min(tick, int(saved["tick"]))
        self.settled = {name: int(saved["settled"].get(name, tick)) for name in self.settled}
        self._known = values_of(saved["known"])
        self._changes.clear()
        for at, (there, gone) in saved["changes"].items():
            self._changes[int(at)] = values_of(there) | dict.fromkeys(gone, ABSENT)
        known = {each["that"]: each for each in saved["each"]}
        known = {
            each.that: known[each.that]
            for each in self.requirements
            if each.that in known and each.is_of(known[each.that])
        }
        new = [each for each in self.requirements if each.that not in known]
        for atom in self._atoms:
            atom.now = UNKNOWN
        for each in new:
            each.pass_over(self.tick)
        for each in self.requirements:
            if each.that in known:
                each.restore(known[each.that], values_of)
        for name in vars(type(self.values)).get("__slots__", ()):
            if name not in self._known and hasattr(self.values, name):
                delattr(self.values, name)
        for name, value in self._known.items():
            setattr(self.values, name, value)
        self.begin()
        return [each.that for each in new]

    def abandon(self, tick: int) -> None:
        """What is not judged by then is unknown."""
        for atom in self._atoms:
            atom.now = UNKNOWN
        for requirement in self.requirements:
            requirement.finish(max(0, tick - self.tick))
        self.tick = max(self.tick, tick)


class Requirements:
    """Those of a system. A generated class has what they read and how they judge it.

    Conditions are judged on `values`.
    """

    readings: ClassVar[tuple[Reading, ...]]

    values: Any
    requirements: tuple[Requirement, ...]

    def follow(self, subsystems: Mapping[str, tuple[Any, int]], tick_s: float) -> None:
        """Begin a run of these subsystems, each with the ticks of its period.

        Of a subsystem, `x` and `memory` are read.
        """
        self._tick_s = tick_s
        self._subsystems: Mapping[str, tuple[Any, int]] = {PLANT: (None, 1), **subsystems}
        owners = {reading.attribute: reading.subsystem for reading in self.readings}
        alike: defaultdict[frozenset[str], list[Requirement]] = defaultdict(list)
        for each in self.requirements:
            alike[frozenset(owners[name] for name in each.reads.values())].append(each)
        self._groups = []
        for group in alike.values():
            read = {name for each in group for name in each.reads.values()}
            self._groups.append(
                _Alike(group, [r for r in self.readings if r.attribute in read], self)
            )
        for one in self._judged():
            for readings in one.readings.values():
                for reading in readings:
                    one.change(reading, 0, _told(reading, self._initial(reading)))
            one.begin()

    def _judged(self) -> Iterator[_Alike]:
        """Those that are alike, each with its values as those that conditions are judged on."""
        for group in self._groups:
            self.values = group.values
            yield group

    @property
    def observed(self) -> frozenset[str]:
        """Names of what is observed of the plant."""
        return frozenset(r.element for r in self.readings if r.kind == "observed")

    def _initial(self, reading: Reading) -> Any:
        if reading.initial is None:
            return ABSENT
        reader, element = reading.initial
        return getattr(self._subsystems[reader][0].x, element, ABSENT)

    def __call__(self, record: StepRecord) -> None:
        """Take note of a step that is committed."""
        name = record.subsystem
        groups = [group for group in self._groups if name in group.settled]
        if not groups:
            return
        subsystem, ticks = self._subsystems[name]
        start = round(record.time_s / self._tick_s)
        sent = dict(record.sent)
        for group in groups:
            for reading in group.readings[name]:
                value = _found(reading, record, sent, subsystem)
                if value is not ABSENT or reading.kind == "observed":
                    # Others see what is sent a period later.
                    seen = start + ticks * (reading.kind == "sent")
                    group.change(reading, seen, _told(reading, value))
            group.settled[name] = start + ticks

    def advance(self, tick: int) -> None:
        """Judge the ticks before `tick`, each requirement as far as what it reads is known."""
        for group in self._judged():
            group.advance(tick)

    def finish(self, tick: int) -> None:
        """The run is over after so many ticks; what is not settled by then is unknown."""
        for group in self._groups:
            for name, settled in group.settled.items():
                for reading in group.readings[name]:
                    group.change(reading, settled, ABSENT)
                group.settled[name] = max(settled, tick)
        self.advance(tick)
        self.abandon(tick)

    def abandon(self, tick: int) -> None:
        """The run is over after so many ticks; those that are not judged yet are unknown."""
        for group in self._groups:
            group.abandon(tick)

    def saved(self, told: Told) -> list[dict[str, Any]]:
        """What is known of the run so far."""
        return [group.saved(told) for group in self._groups]

    def restore(self, saved: Any, tick: int, values_of: Told) -> list[str]:
        """Go on from there at a tick; which of them are new, and know nothing of those before.

        Raises LookupError, TypeError, ValueError for other data.
        """
        known = {frozenset(each["settled"]): each for each in saved}
        new: list[str] = []
        for group in self._judged():
            new += group.restore(known.get(frozenset(group.settled)), tick, values_of)
        return new

    @property
    def violated(self) -> bool:
        """Whether one of them is."""
        return any(item.verdict == "violated" for item in self.requirements)

    def as_data(self) -> list[dict[str, Any]]:
        """What the report says of each."""
        return [item.as_data(self._tick_s) for item in self.requirements]
