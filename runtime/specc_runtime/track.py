"""One subsystem under way: it starts steps and commits what came of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from specc_runtime.buffers import Sent
from specc_runtime.faults import Fault
from specc_runtime.records import StepRecord
from specc_runtime.runner import Runner
from specc_runtime.sampling import Port
from specc_runtime.system import Scheduled


class Track:
    """`pending` tells whether a step was started at `started_tick` and is not committed yet.

    `last` is the record of the last step that the others have seen.
    """

    __slots__ = (
        "_scheduled", "_send", "_watch", "last", "name", "pending", "ports", "runner", "stamp",
        "started_tick",
    )  # fmt: skip

    def __init__(
        self,
        scheduled: Scheduled,
        runner: Runner,
        send: Mapping[str, Callable[[Any], Sent]],
        ports: tuple[Port, ...],
        watch: tuple[str, ...],
    ) -> None:
        """`send` gives for each state what sends its outputs."""
        self.name = scheduled.subsystem.name
        self.runner = runner
        self.ports = ports
        self.stamp = -1
        self.started_tick = 0
        self.pending = False
        self.last: StepRecord | None = None
        self._scheduled = scheduled
        self._send = send
        self._watch = watch

    @property
    def visible_tick(self) -> int:
        """When the others may see the step that is pending."""
        return self.started_tick + self._scheduled.ticks

    def start(self, tick: int) -> None:
        """Begin the next step."""
        self.stamp += 1
        self.started_tick = tick
        self.pending = True
        self.runner.start()

    def commit(self, tick_s: float) -> StepRecord:
        """Make the pending step visible; raises the fault that it ended in."""
        self.pending = False
        outcome = self.runner.outcome()
        if isinstance(outcome, Fault):
            raise outcome
        subsystem = self._scheduled.subsystem
        state = subsystem.state
        watched: Sent = ()
        if self._watch:
            memory = subsystem.memory
            watched = tuple([(name, getattr(memory, name, None)) for name in self._watch])
        time_s = self.started_tick * tick_s
        sent = self._send[state](subsystem.y)
        self.last = StepRecord(self.name, self.stamp, time_s, state, outcome, sent, watched)
        return self.last
