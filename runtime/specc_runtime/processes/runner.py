"""Has the steps of a subsystem computed by a process of its own, and gives what they leave behind.

The subsystem object of the run is a mirror of the one over there: commits, recordings, snapshots,
requirements and faults look at it and find what they would find if it had made the step.
"""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress

from specc_runtime.buffers import slots
from specc_runtime.clock import WallClock
from specc_runtime.faults import Fault, StepAbandoned, said
from specc_runtime.plant import Deferred
from specc_runtime.processes.channel import Gone
from specc_runtime.processes.child import Left, Order, Place
from specc_runtime.processes.crossing import Receiver, Sender
from specc_runtime.processes.fault_data import fault_of
from specc_runtime.processes.worker import Worker
from specc_runtime.subsystem import Subsystem, contents
from specc_runtime.track import Outcome, Runner, outcome_of


class ProcessEnded(Fault):
    """The process that computed a step has ended: an operator ended it, or the system did."""


class ProcessRunner(Runner):
    """Steps in a process of its own.

    Deferred samples belong to the plant, which stays here: they are computed in a thread, and the
    step begins over there when they are.
    """

    def __init__(
        self,
        subsystem: Subsystem,
        sensed: tuple[str, ...],
        clear: Callable[[], None],
        clock: WallClock,
        worker: Worker,
    ) -> None:
        super().__init__(subsystem, sensed, clear, clock)
        self._worker = worker
        layout = worker.layout
        self._names = slots(subsystem.x)
        self._x = Sender(layout.x)
        self._y, self._memory = Receiver(layout.y), Receiver(layout.memory)
        self._outcome: Outcome | None = -1
        self._begun: Future[Outcome] | None = None
        self._is_first = True

    def start(self, skipped: int = 0) -> None:
        """See `Runner`."""
        self.subsystem.x = x = copy.copy(self.inbox)
        self._clear()
        self._outcome = None
        if any(type(getattr(x, name, None)) is Deferred for name in self._sensed):
            self._begun = self._worker.feeder.submit(lambda: self._begin(skipped))
        else:
            self._end(self._begin(skipped))

    def _begin(self, skipped: int) -> Outcome:
        """Compute the inputs and order the step; -1, or the fault that kept it from beginning."""
        return outcome_of(self.subsystem, self._sensed, lambda: self._order(skipped))

    def _order(self, skipped: int) -> int:
        subsystem = self.subsystem
        subsystem.note_inputs()
        changes = self._x.changes(subsystem.x, self._names)
        order = Order(changes, skipped)
        if self._is_first:
            self._is_first = False
            order = Order(changes, skipped, self._worker.remembered, self._place())
        with suppress(Gone):  # who asks for the outcome finds out why
            self._worker.channel.send(order)
        return -1

    def _place(self) -> Place | None:
        """Where the mirror is if the run goes on from a snapshot."""
        subsystem, layout = self.subsystem, self._worker.layout
        if not subsystem.state:
            return None
        names = [element.attribute for element in layout.memory]
        memory = Sender(layout.memory).changes(subsystem.memory, names)
        return Place(subsystem.state, vars(subsystem).get("_periods"), memory)

    def _end(self, begun: Outcome) -> None:
        if isinstance(begun, Fault):
            self._outcome = begun

    @property
    def is_done(self) -> bool:
        """See `Runner`."""
        if self._outcome is None and self._begun is not None and self._begun.done():
            self._end(self._begun.result())
            self._begun = None
        if self._outcome is not None:
            return True
        return self._begun is None and self._worker.channel.is_answered

    def outcome(self) -> Outcome:
        """See `Runner`."""
        if self._outcome is None and self._begun is not None:
            self._end(self._begun.result())
            self._begun = None
        if self._outcome is None:
            try:
                self._outcome = self._taken(self._worker.channel.receive())
            except Gone:
                self._outcome = self._fault_of_end()
        return self._outcome

    def _taken(self, left: Left) -> Outcome:
        """Make the mirror what the step has left behind."""
        mirror = self.subsystem
        mirror.state, mirror.violations = sys.intern(left.state), left.violations
        if left.periods is not None:
            vars(mirror)["_periods"] = left.periods
        self._took(left.busy_s)
        if isinstance(left.outcome, int):
            self._y.take(mirror.y, left.y)
            self._memory.take(mirror.memory, left.memory)
            return left.outcome
        return fault_of(left.outcome, contents(mirror.x))

    def _fault_of_end(self) -> Fault:
        subsystem = self.subsystem
        fault = ProcessEnded(subsystem.name, subsystem.state, self._worker.why_ended())
        fault.inputs = contents(subsystem.x)
        return fault

    def left(self, error: BaseException) -> Fault | None:
        """See `Runner`."""
        if self._outcome is not None or self._begun is not None:
            return None
        subsystem = self.subsystem
        inputs = contents(subsystem.x)
        answer = self._worker.where()
        fault: Fault = StepAbandoned(subsystem.name, subsystem.state, error)
        if answer is not None:
            fault = fault_of(answer, inputs)
        fault.message, fault.__cause__, fault.inputs = said(error), error, inputs
        return fault
