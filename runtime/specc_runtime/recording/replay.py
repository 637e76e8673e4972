"""Replay: recorded inputs go to generated code, whose steps are compared with the recorded ones.

The file decides which values go in, never which code runs: values are built by the layouts of the
generated package.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

from specc_runtime.buffers import AGE, FRESH, LATE
from specc_runtime.faults import Fault
from specc_runtime.forms import Layout, Misshapen, NotRecorded
from specc_runtime.loading import load_layouts, load_system
from specc_runtime.recording.cells import Cells, Shelf
from specc_runtime.recording.messages import (
    NOTHING,
    Shelved,
    about,
    first_of,
    step_of,
    steps_of,
    within,
)
from specc_runtime.recording.reading import RecordFile, Unusable
from specc_runtime.recording.required import Watch
from specc_runtime.recording.resuming import Resumption, Resumptions
from specc_runtime.recording.snapshots import WRONG, snapshot_of
from specc_runtime.recording.steps import (
    beside,
    lag_name,
    passage_of,
    remembered,
    topic_of,
)
from specc_runtime.recording.text import dumped, loaded
from specc_runtime.sampling import PLANT
from specc_runtime.snapshot import Values
from specc_runtime.stepping import Stepper
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System
from specc_runtime.track import outcome_of


@dataclass(frozen=True, slots=True)
class Difference:
    """The first step of a subsystem that differs from the recording.

    `what` is "row", "fault", "state" (a recorded state does not exist any more), or an element:
    `y.c.T_c`, a name of memory. `state` is the state in which the step began, empty in the first
    step. `row` is the text of the row taken now or, if none is, of the recorded row. `condition` is
    the first condition with another value, `behaviour` the state whose behaviour ran. `recorded`
    and `now` are the two values as texts.
    """

    subsystem: str
    stamp: int
    time_s: float
    state: str
    what: str
    recorded: str
    now: str
    row: str = ""
    condition: str = ""
    behaviour: str = ""


@dataclass(slots=True)
class Outcome:
    """The result for a subsystem: the number of equal steps, and the reason why they ended."""

    subsystem: str
    steps: int = 0
    difference: Difference | None = None
    unknown: str = ""
    """The reason why it cannot be compared further."""
    left_out: set[str] = field(default_factory=set)
    """Outputs and memory of which the file has only the type, so they are not compared."""
    gaps: list[tuple[float, float]] = field(default_factory=list)
    """Intervals in s that could not be compared, since parts of the file are lost."""


class _Replayed:
    """A subsystem that gets the recorded inputs until its first difference."""

    def __init__(
        self,
        subsystem: Subsystem,
        layout: Layout,
        exact: bool,
        shelf: Shelved,
        resumed: Callable[[str, int], Resumption | None],
    ) -> None:
        """`resumed` returns a snapshot from which a step of a stamp, or a later one, can follow."""
        self.outcome = Outcome(subsystem.name)
        self._resumed = resumed
        self._subsystem = subsystem
        self._stepper = Stepper(subsystem)
        self._layout = layout
        self._fetch = shelf
        self._aside = Shelf(None, exact)
        self._y = Cells("", layout.y, brief=not exact)
        memory = remembered(layout, exact)
        self._memory = Cells("", memory, brief=not exact)
        self.outcome.left_out.update(m.name[0] for m in layout.memory if m not in memory)
        self._fed: dict[str, tuple[Any, Any]] = {}
        self._flagged = beside(subsystem, layout.x, FRESH)
        self._lagging = [(k, e) for k in (AGE, LATE) for e in beside(subsystem, layout.x, k)]
        self._stamp = 0
        self._gone = ""

    def begin(self, values: Values, saved: Mapping[str, Any], stamp: int) -> None:
        """Go on after the step of this stamp; raises one of WRONG for data that is no snapshot."""
        self._stamp = stamp + 1
        if saved["state"] in self._layout.ends:
            list(values.place(self._subsystem, saved, stamp))
        else:
            self._gone = str(saved["state"])

    @property
    def is_over(self) -> bool:
        """Whether nothing more can be compared."""
        return bool(self.outcome.difference or self.outcome.unknown)

    def step(self, text: bytes) -> None:
        """Make the next step and compare; raises Misshapen if the text is no message of a step."""
        entry = step_of(text)
        stamp, first = entry["stamp"], first_of(entry)
        is_behind = stamp < self._stamp and bool(self.outcome.gaps)
        if first != self._stamp and not is_behind and not self._resume(stamp):
            self.outcome.unknown = f"the steps from stamp {self._stamp} on are missing"
        if self._stamp not in (first, stamp) or self.is_over:
            return
        if skipped := stamp - self._stamp:
            self._stepper.skip(skipped)
            self._stamp = stamp
        if self._gone:
            here = self.outcome.subsystem, entry["stamp"], float(entry["time"]), self._gone
            self.outcome.difference = Difference(*here, "state", self._gone, "no such state")
            return
        try:
            self._feed(entry)
        except NotRecorded as missing:
            if not self._resume(stamp + 1):
                self.outcome.unknown = f"stamp {stamp} reads {missing}"
            return
        before = self._subsystem.state
        outcome = outcome_of(self._subsystem, ())
        self.outcome.difference = self._difference(entry, before, outcome)
        if self.outcome.difference is None:
            self.outcome.steps += 1
            self._stamp += 1

    def _resume(self, stamp: int) -> bool:
        """Go on after a lost part, with the step of this stamp or a later one, if possible."""
        first = self._stamp
        try:
            found = self._resumed(self.outcome.subsystem, stamp)
            if found is None:
                return False
            self.begin(found.values, found.saved, found.stamp)
        except WRONG:  # not a snapshot
            return False
        period_s = self._subsystem.period_s
        self.outcome.gaps.append((first * period_s, self._stamp * period_s))
        self._fed.clear()
        return True

    def _feed(self, entry: Mapping[str, Any]) -> None:
        fresh = entry["fresh"]
        arrives: dict[str, Any] = {}
        there: dict[str, Any] = {}
        absent: list[str] = []
        for element in self._flagged:
            if ".".join(element.name) not in fresh:
                name = ".".join(("x", *element.name))
                raise NotRecorded(f"whether {name} is fresh, which nothing asked then")
        for element in self._layout.x:
            data = within(entry["x"], element)
            if data is NOTHING:
                absent.append(element.attribute)
                continue
            last = self._fed.get(element.attribute)
            if last is None or last[0] != data:
                try:
                    value = element.form.value(data, self._fetch)
                except NotRecorded as missing:
                    name = ".".join(("x", *element.name))
                    raise NotRecorded(f"{name}: {missing}") from None
                last = self._fed[element.attribute] = data, value
            is_fresh = fresh.get(".".join(element.name), False) is True
            (arrives if is_fresh else there)[element.attribute] = last[1]
        there |= dict(self._lags(entry, absent))
        self._stepper.feed(arrives, there, absent)

    def _lags(self, entry: Mapping[str, Any], absent: Collection[str]) -> Iterator[tuple[str, Any]]:
        """How far behind inputs are, by slots; raises NotRecorded, Misshapen."""
        for kind, element in self._lagging:
            name, of = ".".join(element.name), entry.get(lag_name(kind), {})
            if not isinstance(of, dict):
                raise Misshapen("a message with values of other types than a step has")
            value = of.get(name)
            if type(value) not in (int, float):
                if element.attribute in absent:
                    continue
                raise NotRecorded(f"the {lag_name(kind)} of x.{name}, for which nothing asked then")
            yield kind + element.attribute, value

    def _difference(
        self, entry: Mapping[str, Any], before: str, outcome: int | Fault
    ) -> Difference | None:
        """The first difference from the recording: the row, else an element."""
        here = self.outcome.subsystem, entry["stamp"], float(entry["time"]), before
        failed = entry.get("fault", "")
        if failed or isinstance(outcome, Fault):
            now = outcome.message if isinstance(outcome, Fault) else "no fault"
            same = now == failed
            return None if same else Difference(*here, "fault", failed or "no fault", now)
        subsystem = self._subsystem
        table, ends, state = subsystem.transitions, self._layout.ends, subsystem.state
        passage = passage_of(table, ends, before, outcome, state)
        now, then = passage["transition"], str(entry["transition"])
        if now != then or state != entry["state"]:
            conditions = passage["conditions"]
            known = entry["conditions"]
            changed = (name for name, holds in conditions.items() if known.get(name) is not holds)
            condition = next(changed, "")
            return Difference(
                *here, "row", then or "no row", now or "no row", now or then, condition, state
            )
        if not {"y", "memory"} <= entry.keys():
            raise Misshapen("a step without outputs or memory")
        for cells, part, of in ((self._y, "y", subsystem.y), (self._memory, "", subsystem.memory)):
            computed = _sent(of, subsystem.sends[state]) if part else cells.of_buffer(of)
            for name, recorded, value in _pairs(
                cells, entry[part or "memory"], computed, self._aside
            ):
                what = ".".join(filter(None, (part, name)))
                if _LEFT_OUT.search(recorded):
                    self.outcome.left_out.add(what)
                if recorded != value:
                    texts = recorded.decode(), value.decode()
                    return Difference(*here, what, *texts, now, behaviour=state)
        return None


_MOST_GONE = 100
"""Subsystems missing from the specification that are named at most."""
_LEFT_OUT = re.compile(rb'\{(?:"type":"[^"]*")?\}')
"""Placeholder of an opaque value or an image that is not in the file."""


def _sent(buffer: Any, attributes: tuple[str, ...]) -> tuple[tuple[str, ...], Any]:
    return attributes, [getattr(buffer, name) for name in attributes]


def _pairs(
    cells: Cells, recorded: Any, computed: tuple[tuple[str, ...], Any], aside: Shelf
) -> Iterator[tuple[str, bytes, bytes]]:
    """Names of elements with the texts of both values; `nothing` for a missing one."""
    now = {  # read again: single and double precision are not spelled alike
        attribute: dumped(loaded(cells.cells[attribute].text(value, aside)))
        for attribute, value in zip(*computed, strict=True)
    }
    for attribute, element in cells.elements.items():
        data = within(recorded, element)
        then = NOTHING if data is NOTHING else dumped(data)
        yield ".".join(element.name), then, now.get(attribute, NOTHING)


def _begin_later(
    file: Path, tick: str, system: System, replayed: Mapping[str, _Replayed], watch: Watch | None
) -> None:
    """Begin where the recorded run began, itself a continuation. Raises Unusable."""
    try:
        saved, shelf = snapshot_of(file, tick)
        if saved is None:
            for one in replayed.values():
                one.outcome.unknown = "there is no snapshot of where the run began"
            return
        values = Values(system, load_layouts(system), shelf)
        for one in replayed.values():
            name = one.outcome.subsystem
            if name in saved["subsystems"]:
                one.begin(values, saved["subsystems"][name], saved["stamps"][name])
        if watch is not None:
            watch.begin(saved, values)
    except WRONG as error:
        raise Unusable(f"{file}: the snapshot that it begins with is damaged: {error}") from error


def replay(
    package: Path,
    base: Path,
    file: Path,
    only: str = "",
    until_s: float = inf,
    reading: RecordFile | None = None,
) -> tuple[list[Outcome], Watch | None]:
    """Replay a recording with a generated package: the outcome of each subsystem.

    The second result judges the requirements; it is None without any, or with a subsystem `only`.
    `reading` tells afterwards which parts of the file could not be read.

    Raises Unusable for the file, and what `load_system` and `load_layouts` raise.
    """
    recorded_about = about(file)
    system = load_system(package, base)
    layouts = load_layouts(system)
    exact = recorded_about.get("exact") == "true"
    reading = RecordFile(file) if reading is None else reading
    shelf = Shelved(most_bytes=reading.budget.most_bytes)
    resumptions = Resumptions(file, system, layouts)

    def resumed(subsystem: str, stamp: int) -> Resumption | None:
        return resumptions.next(subsystem, stamp) if reading.damaged else None

    replayed = {
        topic_of(s.subsystem.name): _Replayed(
            s.subsystem, layouts[s.subsystem.name], exact, shelf, resumed
        )
        for s in system.subsystems
        if only in ("", s.subsystem.name)
    }
    outcomes = [one.outcome for one in replayed.values()]
    watch = None if only or system.requirements is None else Watch(system, layouts, shelf)
    if tick := recorded_about.get("from"):
        _begin_later(file, tick, system, replayed, watch)
    gone: set[str] = set()
    for topic, time_s, text in steps_of(reading, shelf):
        one = replayed.get(topic)
        if watch is not None and time_s <= until_s:
            try:
                watch.take(topic, text)
            except Misshapen as error:
                raise Unusable(f"{file}: {topic} at {time_s:g} s: {error}") from None
        is_gone = one is None and not only and topic != topic_of(PLANT)
        if is_gone and topic not in gone and len(gone) < _MOST_GONE:
            gone.add(topic)
            outcomes.append(Outcome(topic[1:], unknown="the specification does not have it"))
        if one is not None and not one.is_over and time_s <= until_s:
            try:
                one.step(text)
            except Misshapen as error:
                raise Unusable(f"{file}: {topic} at {time_s:g} s: {error}") from None
    for outcome in outcomes:
        if not outcome.steps and not outcome.difference and not outcome.unknown:
            outcome.unknown = "no step of it was recorded"
    if watch is not None:
        watch.finish(until_s)
    return outcomes, watch
