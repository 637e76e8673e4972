"""Cycles of a task: when one ends, how long it took and what the judge says of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from specc_runtime.records import StepRecord
from specc_runtime.system import System
from specc_runtime.task import Judge


class Cycles:
    """Counts and judges cycles; call it with each record.

    `results` has what the judge said of each cycle, with `simulated_s` and `ended`, which is
    "completed" or why it ended without; `fulfilled` goes with them.
    """

    def __init__(self, system: System, judge: Judge | None, now_s: Callable[[], float]) -> None:
        """`now_s` gives simulated time; no cycle ever ends in a system without a task."""
        self.results: list[dict[str, Any]] = []
        self.fulfilled: list[bool] = []
        self.begun_s = 0.0
        self._judge = judge
        self._now_s = now_s
        self._subsystem = ""
        self._last: frozenset[int] = frozenset()
        if system.task is not None:
            task = system.task
            table = system.scheduled(task.subsystem).subsystem.transitions
            ends = [
                i for i, t in enumerate(table) if (t.source, t.target) == (task.source, task.target)
            ]
            self._subsystem = task.subsystem
            self._last = frozenset(ends)

    def __call__(self, record: StepRecord) -> None:
        """Let the judge see the record; end the cycle if this was its last transition."""
        if self._judge is not None:
            for name, value in record.watched:
                if value is not None:
                    self._judge.watch(name, value)
        if record.transition in self._last and record.subsystem == self._subsystem:
            self.end("completed")

    def end(self, why: str) -> None:
        """End the cycle now. Only a completed one can be fulfilled."""
        now_s = self._now_s()
        found = self._judge.end_cycle() if self._judge else {}
        good = bool(found[self._judge.criterion]) if self._judge else True
        self.fulfilled.append(good and why == "completed")
        self.results.append({**found, "simulated_s": now_s - self.begun_s, "ended": why})
        self.begun_s = now_s
