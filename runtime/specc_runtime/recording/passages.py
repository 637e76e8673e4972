"""What the machines of a recorded run did, counted: from which state, by which row, to which state.

Nothing but the beginnings of messages is read. Files come from strangers: each passage is kept once
and paid for.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from specc_runtime.forms import Misshapen
from specc_runtime.recording.budget import Budget
from specc_runtime.recording.messages import (
    Shelved,
    beginning_of,
    report_of,
    simulated_s,
    step_of,
    steps_of,
)
from specc_runtime.recording.reading import RecordFile, Unusable
from specc_runtime.recording.steps import topic_of
from specc_runtime.sampling import PLANT

_OF_PASSAGE = 500
"""Bytes that are kept for a subsystem or a passage, beside its names."""
_FAULT = b',"fault":'
RowPassage = tuple[str, str, str]
"""State before (empty in the first period), row taken (empty for none), state that ran."""


@dataclass(slots=True)
class Passages:
    """How often each machine made each passage, and the report of the run, empty without one.

    A step that failed is no passage: what it asked before it failed is not recorded.
    """

    counts: dict[str, Counter[RowPassage]] = field(default_factory=dict)
    report: Mapping[str, Any] = field(default_factory=dict)
    end_s: float = 0.0

    def take(self, name: str, text: bytes, budget: Budget) -> None:
        """Count the message of a step. Raises Misshapen, Unusable."""
        if _FAULT in text:
            budget.decode(text)
            if step_of(text).get("fault"):
                return
        begun = beginning_of(text)
        passage = begun.before, begun.transition, begun.state
        if name not in self.counts:
            budget.keep(_OF_PASSAGE + len(name))
            self.counts[name] = Counter()
        if passage not in self.counts[name]:
            budget.keep(_OF_PASSAGE + sum(map(len, passage)))
        self.counts[name][passage] += 1


def passages(file: Path, reading: RecordFile) -> Passages:
    """The passages of all machines. Raises Unusable."""
    shelf, found, last_s = Shelved(0), Passages(), 0.0
    for topic, at_s, text in steps_of(reading, shelf, images=False):
        last_s = max(last_s, at_s)
        if topic == topic_of(PLANT):
            continue
        try:
            found.take(topic[1:], text, reading.budget)
        except Misshapen as error:
            raise Unusable(f"{file}: {topic} at {at_s:.12g} s: {error}") from None
    if not found.counts:
        raise Unusable(f"{file} has no steps")
    found.report = report_of(shelf.report)
    found.end_s = reading.end_s(last_s, simulated_s(shelf.report))
    return found
