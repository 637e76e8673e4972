"""A moment of a recording: the last step of each subsystem until then, and its past."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from specc_runtime.forms import Misshapen
from specc_runtime.recording.budget import Budget, Unusable
from specc_runtime.recording.index import EARLIER_S, Changes, Index, Last, Names, wrong
from specc_runtime.recording.messages import entries_of, step_of
from specc_runtime.recording.snapshots import SNAPSHOTS, WRONG
from specc_runtime.recording.steps import topic_of
from specc_runtime.recording.text import loaded

_RECENT = 5
"""Number of last transitions that are told."""
_MOST_SNAPSHOTS = 100
"""Snapshots that are looked through for what messages lack."""


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
    recent: Sequence[tuple[float, float, int, str]] = ()
    """The last transitions: first and last time in s, repetitions in between, text."""
    known_from: int = -1
    """Stamp from which on no step is missing."""

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


def seen_at(index: Index, time_s: float, only: str = "") -> list[Seen]:
    """The subsystems with a step until then, or `only` the named one.

    Raises Unusable, also for a moment that is not in the file.
    """
    _check_inside(index, time_s)
    machines = {topic_of(n): m for n, m in index.machines.items() if only in ("", n)}
    budget, found = Budget(index.path), []
    for topic, last in index.last(machines, time_s, budget).items():
        try:
            found.append(_seen(topic[1:], last, machines[topic], index.names, budget))
        except Misshapen as error:
            raise wrong(index.path, topic, last.time_s, error) from None
    lacking = [one for one in found if one.entered_s is None or one.memory is None]
    _fill(index, time_s, [one for one in lacking if one.known_from > 0], budget)
    return found


def _seen(name: str, last: Last, changes: Changes, names: Names, budget: Budget) -> Seen:
    """A machine at its last step. Raises Misshapen, and Unusable."""
    number = bisect_right(changes.times_s, last.time_s) - 1
    gap = bisect_right(changes.gaps_s, last.time_s) - 1
    is_after_gap = changes.gaps_s[gap] == last.time_s
    budget.decode(last.text)
    one = Seen(
        name,
        step_of(last.text),
        since_s=changes.since_s(number),
        row=names.texts[changes.rows[number]],
        recent=[*_recent(changes, names, number)][::-1],
        known_from=changes.gap_stamps[gap],
    )
    if not is_after_gap:
        is_change = changes.times_s[number] == last.time_s
        one.entered_s = changes.since_s(number - is_change)
        budget.decode(last.before)
        memory = step_of(last.before).get("memory")
        one.memory = memory if isinstance(memory, dict) else None
    if one.step["state"] != one.step.get("before") and not one.step["transition"]:
        one.since_s, one.row = float(one.step["time"]), ""  # it failed after its row
    return one


def _recent(changes: Changes, names: Names, number: int) -> Iterator[tuple[float, float, int, str]]:
    """The last transitions until a change, the last one first, as `Seen` has them."""
    shown = 0
    while number >= 0 and shown < _RECENT:
        first = changes.runs[number]
        if row := names.texts[changes.rows[number]]:
            yield changes.times_s[first], changes.times_s[number], number - first + 1, row
            shown += 1
        number = first - 1


def last_steps(index: Index, time_s: float) -> dict[str, Mapping[str, Any]]:
    """The last step of each subsystem until then; none for a moment that is not in the file."""
    try:
        return {one.name: one.step for one in seen_at(index, time_s)}
    except Unusable:
        return {}


def violations(index: Index, time_s: float) -> list[tuple[str, float]]:
    """Requirements that were violated by then, and since when, as the report in the file says."""
    return [
        (entry["that"], since_s)
        for since_s, entry in entries_of(index.report, "requirements", ("that", "verdict"))
        if entry["verdict"] == "violated" and 0 <= since_s <= time_s + EARLIER_S
    ]


def _check_inside(index: Index, time_s: float) -> None:
    file, begin_s, end_s = index.path, index.begin_s, index.end_s
    if not index.machines or begin_s > end_s:
        raise Unusable(f"{file} has no steps")
    if time_s > end_s + EARLIER_S:
        raise Unusable(f"{file} ends at {end_s:.12g} s, before {time_s:.12g} s")
    if time_s < begin_s - EARLIER_S:
        raise Unusable(f"{file} begins at {begin_s:.12g} s, after {time_s:.12g} s")


def _fill(index: Index, time_s: float, lacking: list[Seen], budget: Budget) -> None:
    """Fill data that messages lack from snapshots: of a continued run, or of lost parts."""
    texts = index.latest(SNAPSHOTS, time_s, budget) if lacking else ()
    for text in islice(texts, _MOST_SNAPSHOTS):
        try:
            snapshot = loaded(text)
            for one in lacking:
                if type(stamp := snapshot["stamps"][one.name]) is int:
                    one.go_on_from(stamp, snapshot["subsystems"][one.name])
        except WRONG:  # not a snapshot
            continue
        lacking = [one for one in lacking if one.entered_s is None or one.memory is None]
