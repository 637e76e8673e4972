"""The requirements of a system: they follow a run, and give their part of its report."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Literal

from specc_runtime.records import StepRecord
from specc_runtime.requirement import Encode, Requirement
from specc_runtime.sampling import PLANT
from specc_runtime.temporal import UNKNOWN, Atom

__all__ = ["ABSENT", "Reading", "Requirement", "Requirements"]


@dataclass(frozen=True, slots=True)
class Reading:
    """A value that requirements name: `element` of `subsystem`, kept as `attribute`.

    Ground truth of the plant has a value at every tick. A sent value counts from the tick at which
    it becomes visible, any other value from the time stamp of its step. `initial` is the input,
    with its subsystem, whose initial value counts until a value is sent.
    """

    attribute: str
    subsystem: str
    kind: Literal["state", "memory", "sent", "reported", "observed"]
    element: str = ""
    initial: tuple[str, str] | None = None
    asks_presence: bool = False


ABSENT: Any = object()


def _found(reading: Reading, record: StepRecord, sent: Mapping[str, Any], subsystem: Any) -> Any:
    """The value after a committed step; `subsystem` is None for ground truth."""
    if reading.kind == "state":
        return record.state
    if reading.kind in ("sent", "observed"):
        return sent.get(reading.element, ABSENT)
    source = subsystem.memory if reading.kind == "memory" else subsystem.x
    return getattr(source, reading.element, ABSENT)


def _encoded(reading: Reading, value: Any) -> Any:
    return value is not ABSENT if reading.asks_presence else value


class _Numbered:
    """The values of ticks as plain data, equal ones once, with a number for each."""

    def __init__(self, encode: Encode) -> None:
        self.encoded: list[dict[str, Any]] = []
        self._encode = encode
        self._numbers: dict[int, int] = {}

    def number(self, values: Mapping[str, Any]) -> int:
        """The number of these values, which must not change later."""
        if id(values) not in self._numbers:
            self._numbers[id(values)] = len(self.encoded)
            self.encoded.append(self._encode(values))
        return self._numbers[id(values)]


class _Alike:
    """Requirements that read the same subsystems, so that they judge the same ticks."""

    def __init__(
        self, requirements: list[Requirement], readings: list[Reading], of: Requirements
    ) -> None:
        self.requirements = requirements
        self.values = type(of.values)()
        self.tick = 0
        self.last_ticks = {reading.subsystem: 0 for reading in readings}
        self.readings: defaultdict[str, list[Reading]] = defaultdict(list)
        self._atoms = [atom for each in requirements for atom in each.formula.atoms()]
        self._known: Mapping[str, Any] = {}
        self._changes: defaultdict[int, dict[str, Any]] = defaultdict(dict)
        for reading in readings:
            self.readings[reading.subsystem].append(reading)

    def change(self, reading: Reading, tick: int, value: Any) -> None:
        """Note a new value, or an unknown one, from this tick on."""
        self._changes[tick][reading.attribute] = value

    def begin(self) -> None:
        """Evaluate conditions on the values before the first step."""
        for atom in self._atoms:
            atom.update()

    def advance(self, tick: int) -> None:
        """Judge the ticks before `tick` whose values are all known."""
        last = min(tick, *self.last_ticks.values()) if self.last_ticks else tick
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

    def saved(self, encode: Encode) -> dict[str, Any]:
        """The state of the monitors, as plain data."""
        changes = {}
        for tick, change in self._changes.items():
            gone = [name for name, value in change.items() if value is ABSENT]
            there = {name: value for name, value in change.items() if value is not ABSENT}
            changes[str(tick)] = [encode(there), gone]
        earlier = _Numbered(encode)  # requirements share values, over more or fewer ticks
        each = [requirement.saved(earlier.number) for requirement in self.requirements]
        return {
            "tick": self.tick,
            "settled": self.last_ticks,
            "known": encode(self._known),
            "changes": changes,
            "earlier": earlier.encoded,
            "each": each,
        }

    def restore(
        self, saved: Any, tick: int, due: Mapping[str, int], values_of: Encode, *, is_other: bool
    ) -> list[str]:
        """See `Requirements`; with `saved` None the past is unknown.

        `due` has the tick of each subsystem's next step, at which its earlier outputs are visible.
        """
        begun = {"tick": tick, "settled": {}, "known": {}, "changes": {}, "earlier": (), "each": []}
        saved = saved or begun
        self.tick = min(tick, int(saved["tick"]))
        self.last_ticks = {
            name: min(int(saved["settled"].get(name, tick)), due[name]) for name in self.last_ticks
        }
        self._known = values_of(saved["known"])
        self._changes.clear()
        owners = {r.attribute: name for name, found in self.readings.items() for r in found}
        for at, (there, gone) in sorted(saved["changes"].items(), key=lambda item: int(item[0])):
            for name, value in (values_of(there) | dict.fromkeys(gone, ABSENT)).items():
                if name in owners:
                    seen = int(at) if int(at) <= tick else due[owners[name]]
                    self._changes[seen][name] = value
        known = {each["that"]: each for each in saved["each"]}
        earlier = [values_of(values) for values in saved["earlier"]]
        lost: list[str] = []
        for each in self.requirements:
            past = known.get(each.that)
            if past is None or not each.is_of(past) or (is_other and each.formula.depth < math.inf):
                show = partial(self._show, atoms=list(each.formula.atoms()))
                missing = each.judge_anew(self.tick, past, earlier.__getitem__, show)
                if past is None or missing:
                    of = "nothing" if past is None else "too little"
                    lost.append(f"{of} is known of the past for: {each.that}")
            else:
                each.restore(past, earlier.__getitem__)
                if is_other:
                    lost.append(f"what was so before stays as it was judged for: {each.that}")
        self._show(self._known, self._atoms)
        return lost

    def _show(self, values: Mapping[str, Any], atoms: Iterable[Atom]) -> None:
        """Evaluate some conditions on these values."""
        for name in vars(type(self.values)).get("__slots__", ()):
            if name not in values and hasattr(self.values, name):
                delattr(self.values, name)
        for name, value in values.items():
            setattr(self.values, name, value)
        for atom in atoms:
            atom.update()

    def abandon(self, tick: int) -> None:
        """Ticks that are not judged by then are unknown."""
        for atom in self._atoms:
            atom.now = UNKNOWN
        for requirement in self.requirements:
            requirement.finish(max(0, tick - self.tick))
        self.tick = max(self.tick, tick)


class Requirements:
    """The requirements of a system; a generated class adds readings and formulas.

    Conditions are evaluated on `values`.
    """

    readings: ClassVar[tuple[Reading, ...]]

    values: Any
    requirements: tuple[Requirement, ...]

    def follow(self, subsystems: Mapping[str, tuple[Any, int]], tick_s: float) -> None:
        """Begin a run of these subsystems, each with its period in ticks.

        Only `x` and `memory` of a subsystem are read.
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
                    one.change(reading, 0, _encoded(reading, self._initial(reading)))
            one.begin()

    def _judged(self) -> Iterator[_Alike]:
        """The groups of requirements, each after putting its values in the place of `values`."""
        for group in self._groups:
            self.values = group.values
            yield group

    @property
    def observed(self) -> frozenset[str]:
        """Names of the ground truth that requirements read."""
        return frozenset(r.element for r in self.readings if r.kind == "observed")

    def _initial(self, reading: Reading) -> Any:
        if reading.initial is None:
            return ABSENT
        reader, element = reading.initial
        return getattr(self._subsystems[reader][0].x, element, ABSENT)

    def __call__(self, record: StepRecord) -> None:
        """Note a committed step."""
        name = record.subsystem
        groups = [group for group in self._groups if name in group.last_ticks]
        if not groups:
            return
        subsystem = self._subsystems[name][0]
        start = round(record.time_s / self._tick_s)
        visible = start + 1 if name == PLANT else round(record.visible_s / self._tick_s)
        sent = dict(record.sent)
        for group in groups:
            for reading in group.readings[name]:
                value = _found(reading, record, sent, subsystem)
                if value is not ABSENT or reading.kind == "observed":
                    seen = visible if reading.kind == "sent" else start
                    group.change(reading, seen, _encoded(reading, value))
            group.last_ticks[name] = visible

    def advance(self, tick: int) -> None:
        """Judge the ticks before `tick`, each requirement as far as its values are known."""
        for group in self._judged():
            group.advance(tick)

    def finish(self, tick: int) -> None:
        """End the run after so many ticks; values that are not settled by then are unknown."""
        for group in self._groups:
            for name, last_tick in group.last_ticks.items():
                for reading in group.readings[name]:
                    group.change(reading, last_tick, ABSENT)
                group.last_ticks[name] = max(last_tick, tick)
        self.advance(tick)
        self.abandon(tick)

    def abandon(self, tick: int) -> None:
        """End the run after so many ticks; ticks that are not judged yet are unknown."""
        for group in self._groups:
            group.abandon(tick)

    def saved(self, encode: Encode) -> list[dict[str, Any]]:
        """The state of the monitors, as plain data."""
        return [group.saved(encode) for group in self._groups]

    def restore(
        self, saved: Any, tick: int, values_of: Encode, *, is_other: bool = False
    ) -> list[str]:
        """Go on from a saved state at a tick; returns the requirements with too short a past.

        If `is_other`, the state is of another specification: its verdicts stay, and open ticks are
        judged by the requirements of this one.

        Raises LookupError, TypeError, ValueError for other data.
        """
        known = {frozenset(each["settled"]): each for each in saved}
        due = {name: -(-tick // ticks) * ticks for name, (_, ticks) in self._subsystems.items()}
        lost: list[str] = []
        for group in self._judged():
            past = known.get(frozenset(group.last_ticks))
            lost += group.restore(past, tick, due, values_of, is_other=is_other)
        return lost

    @property
    def violated(self) -> bool:
        """Whether a requirement is violated."""
        return any(item.verdict == "violated" for item in self.requirements)

    def as_data(self) -> list[dict[str, Any]]:
        """The entry of each requirement in the report."""
        return [item.as_data(self._tick_s) for item in self.requirements]
