"""The messages of a recording about its requirements: the verdicts until a moment."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

from specc_runtime.forms import object_schema
from specc_runtime.recording.log import Log
from specc_runtime.recording.text import dumped
from specc_runtime.requirement import Requirement

REQUIREMENTS = "/requirements"
_PERIOD_S = 0.5
"""Simulated time between two messages at least, while no verdict changes."""
_SCHEMA = object_schema(
    {
        "requirements": {
            "type": "array",
            "description": "in the order of the report",
            "items": object_schema(
                {
                    "verdict": {"enum": ["holds", "violated", "open", "unknown"]},
                    "margin": {"type": ["number", "null"]},
                    "time_s": {
                        "type": ["number", "null"],
                        "description": "the first moment that makes the verdict",
                    },
                }
            ),
        }
    }
)


class Verdicts:
    """Writes verdict and margin of each requirement, at once if a verdict changes."""

    def __init__(self, log: Log, requirements: Sequence[Requirement], tick_s: float) -> None:
        self._channel = log.channel(REQUIREMENTS, "specc.Requirements", _SCHEMA)
        self._requirements, self._tick_s = requirements, tick_s
        self._written: list[dict[str, Any]] = []
        self._next_s = -inf

    def note(self, time_s: float, *, is_last: bool = False) -> None:
        """Write what is known now, if it is new."""
        now = [each.so_far(self._tick_s) for each in self._requirements]
        changes = [each["verdict"] for each in now] != [each["verdict"] for each in self._written]
        if now != self._written and (changes or is_last or time_s >= self._next_s):
            self._channel.add(time_s, dumped({"requirements": now}))
            self._written, self._next_s = now, time_s + _PERIOD_S
