"""A moment of a recording: the last step of each subsystem until then, and its past."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from specc_runtime.forms import Misshapen
from specc_runtime.recording.budget import Budget
from specc_runtime.recording.messages import (
    Shelved,
    beginning_of,
    simulated_s,
    step_of,
    steps_of,
)
from specc_runtime.recording.reading import Metadata, RecordFile, Unusable
from specc_runtime.recording.snapshots import SNAPSHOTS, WRONG, every_snapshot
from specc_runtime.recording.steps import topic_of
from specc_runtime.recording.text import loaded
from specc_runtime.sampling import PLANT

_EARLIER_S = 1e-6
_RECENT = 5
"""Number of last transitions that are kept."""
_OF_SUBSYSTEM = 2000
"""Bytes that are kept for a subsystem besides its messages."""
_LONGEST_ROW = 300


@dataclass(slots=True)
class Seen:
    """A subsystem at the moment.

    `step` is the content of the message of its last step. `memory` is the memory before that step,
    None if lost. The step began in a state entered at `entered_s`. The current state was entered at
    `since_s` by the row `row`. None and "" stand for data that the file does not have.
    """

    name: str
    step: Mapping[str, Any] = field(default_factory=dict)
    memory: Mapping[str, Any] | None = None
    entered_s: float | None = None
    since_s: float | None = None
    row: str = ""
    recent: deque[tuple[float, float, int, str]] = field(
        default_factory=lambda: deque(maxlen=_RECENT)
    )
    """The last transitions: first and last time in s, repetitions in between, text."""
    known_from: int = -1
    """Stamp from which on no step is missing."""
    _texts: tuple[bytes, bytes] = b"", b""
    """The messages of the last step but one (empty if lost) and of the last step."""
    _stamp: int = -2
    _held_bytes: int = 0

    def take(self, time_s: float, text: bytes, budget: Budget) -> None:
        """Note the next step. Raises Misshapen, and Unusable."""
        stamp, first, _, before, row, transition = beginning_of(text)
        if first != self._stamp + 1:
            self._texts, self.known_from = (b"", b""), stamp
            self.since_s, self.row = None, ""
        self._texts, self._stamp = (self._texts[1], text), stamp
        self.entered_s = self.since_s
        if row != -1 or not before:
            self.since_s, self.row = time_s, transition[:_LONGEST_ROW]
            self._note(time_s)
        previous = self._held_bytes
        self._held_bytes = max(previous, sum(map(len, self._texts)))
        budget.keep(self._held_bytes - previous)

    def _note(self, time_s: float) -> None:
        begin_s, times = time_s, 1
        if self.recent and self.recent[-1][-1] == self.row:
            begin_s, _, times, _ = self.recent.pop()
            times += 1
        if self.row:
            self.recent.append((begin_s, time_s, times, self.row))

    def finish(self) -> None:
        """Decode the last messages. Raises Misshapen."""
        before, last = self._texts
        self.step = step_of(last)
        if self.step["state"] != self.step.get("before") and not self.step.get("transition"):
            self.since_s, self.row = float(self.step["time"]), ""  # it failed after its row
        if before:
            memory = step_of(before).get("memory")
            self.memory = memory if isinstance(memory, dict) else None

    def go_on_from(self, stamp: int, saved: Mapping[str, Any]) -> None:
        """Fill lost data from a snapshot after the step of that stamp."""
        last = self.step["stamp"]
        if not self.known_from - 1 <= stamp < last or not saved["state"]:
            return
        if self.entered_s is None:  # no transition is known since then
            self.entered_s = float(saved["entered"])
            self.since_s = self.entered_s if self.since_s is None else self.since_s
        if self.memory is None and stamp == last - 1:
            self.memory = {name: data for name, data in saved["memory"].items() if "." not in name}


def seen_at(file: Path, time_s: float, only: str, reading: RecordFile) -> list[Seen]:
    """The subsystems with a step until then, or `only` the named one.

    Raises Unusable, also for a moment that is not in the file.
    """
    shelf, found = Shelved(0), dict[str, Seen]()  # no values stored aside
    begin_s, end_s = float("inf"), 0.0
    for topic, at_s, text in steps_of(reading, shelf, images=False):
        if topic == topic_of(PLANT):
            continue
        begin_s, end_s = min(begin_s, at_s), max(end_s, at_s)
        if at_s > time_s + _EARLIER_S or only not in ("", topic[1:]):
            continue
        if topic not in found:
            reading.budget.keep(_OF_SUBSYSTEM + len(topic))
            found[topic] = Seen(topic[1:])
        with _telling(file, topic, at_s):
            found[topic].take(at_s, text, reading.budget)
    _check_inside(file, time_s, begin_s, max(end_s, simulated_s(shelf.report) or 0.0))
    for topic, one in found.items():
        with _telling(file, topic, one.since_s or 0.0):
            one.finish()
    _fill(file, [one for one in found.values() if one.entered_s is None or one.memory is None])
    return list(found.values())


def last_steps(file: Path, time_s: float) -> dict[str, Mapping[str, Any]]:
    """The last step of each subsystem until then; none for a moment that is not in the file."""
    try:
        return {one.name: one.step for one in seen_at(file, time_s, "", RecordFile(file))}
    except Unusable:
        return {}


def violations(file: Path, time_s: float) -> list[tuple[str, float]]:
    """Requirements that were violated by then, and since when, as the report in the file says."""
    report: Mapping[str, str] = {}
    for record in RecordFile(file, {SNAPSHOTS}):
        if isinstance(record, Metadata) and record.name == "report":
            report = record.metadata
    try:
        entries = loaded(report["report"].encode())["requirements"]
        violated = [e for e in entries if e["verdict"] == "violated"]
        found = [(str(e["that"]), float(e["time_s"])) for e in violated if e["time_s"] is not None]
    except WRONG:  # there is none, or it is not one of a run
        return []
    return [(that, since_s) for that, since_s in found if 0 <= since_s <= time_s + _EARLIER_S]


@contextmanager
def _telling(file: Path, topic: str, time_s: float) -> Iterator[None]:
    """Turn Misshapen into Unusable, with the topic and time of the message."""
    try:
        yield
    except Misshapen as error:
        raise Unusable(f"{file}: {topic} at {time_s:.12g} s: {error}") from None


def _check_inside(file: Path, time_s: float, begin_s: float, end_s: float) -> None:
    if begin_s > end_s:
        raise Unusable(f"{file} has no steps")
    if time_s > end_s + _EARLIER_S:
        raise Unusable(f"{file} ends at {end_s:.12g} s, before {time_s:.12g} s")
    if time_s < begin_s - _EARLIER_S:
        raise Unusable(f"{file} begins at {begin_s:.12g} s, after {time_s:.12g} s")


def _fill(file: Path, seen: list[Seen]) -> None:
    """Fill data that messages lack from snapshots: of a continued run, or of lost parts."""
    lacking = [one for one in seen if one.known_from > 0]
    for snapshot in every_snapshot(file) if lacking else ():
        for one in lacking:
            try:
                if type(stamp := snapshot["stamps"][one.name]) is int:
                    one.go_on_from(stamp, snapshot["subsystems"][one.name])
            except WRONG:  # not a snapshot
                continue
