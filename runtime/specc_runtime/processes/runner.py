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
from dataclasses import replace
from typing import Any

from specc_runtime.buffers import slots
from specc_runtime.clock import WallClock
from specc_runtime.faults import DeviceFailed, Fault, StepAbandoned, error_text
from specc_runtime.hosting.memory import Extent
from specc_runtime.plant import Deferred
from specc_runtime.processes.channel import Garbled, Gone
from specc_runtime.processes.child import Left, Order, ResumePoint
from specc_runtime.processes.crossing import Receiver, Sender
from specc_runtime.processes.fault_data import fault_of
from specc_runtime.processes.worker import Worker
from specc_runtime.sampling import compute_deferred
from specc_runtime.subsystem import Subsystem, contents
from specc_runtime.track import Outcome, Runner, outcome_of


class ProcessEnded(Fault):
    """The process that computed a step has ended: an operator ended it, or the system did."""


class ProcessRunner(Runner):
    """Steps in a process of its own.

    Deferred samples belong to the plant, which stays here: they are computed in a thread, and the
    step begins over there when they are. Those that have a reference are read over there; here
    only if the run itself looks at them.
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
        self._sent_views: dict[str, Any] = {}
        """References that were told last, by elements."""
        self._used: dict[Extent, Any] = {}
        """Those whose bytes the process may use."""
        self._given: set[int] = set()
        """Descriptors of memory that it has."""
        self._y, self._memory = Receiver(layout.y), Receiver(layout.memory)
        self._outcome: Outcome | None = -1
        self._begun: Future[Outcome] | None = None
        self._is_first = True

    def start(self, skipped: int = 0) -> None:
        """See `Runner`."""
        self.subsystem.x = x = copy.copy(self.inbox)
        self._clear()
        self._outcome = None
        deferred = {n: v for n in self._sensed if type(v := getattr(x, n, None)) is Deferred}
        views = {n: v.reference for n, v in deferred.items() if v.reference is not None}
        if len(views) < len(deferred):
            self._begun = self._worker.feeder.submit(lambda: self._begin(skipped, views))
        else:
            self._end(self._begin(skipped, views))

    def _begin(self, skipped: int, views: dict[str, Any]) -> Outcome:
        """Compute the inputs and order the step; -1, or the fault that kept it from beginning.

        `views` are the references of those that are read over there.
        """
        if self.begins is not None:
            self.begins()
        here = tuple([name for name in self._sensed if name not in views])
        return outcome_of(self.subsystem, here, lambda: self._order(skipped, views))

    def _order(self, skipped: int, views: dict[str, Any]) -> int:
        subsystem, worker = self.subsystem, self._worker
        names = [n for n in self._names if n not in views] if views else self._names
        changes = self._x.changes(subsystem.x, names)
        new = {name: view for name, view in views.items() if self._sent_views.get(name) is not view}
        descriptors = {view.descriptor for view in new.values()} - self._given
        self._sent_views, self._given = views, self._given | descriptors
        self._used |= {view.extent: view for view in new.values()}
        compute_deferred(subsystem.x, tuple([name for name in views if name in worker.observed]))
        subsystem.note_inputs()
        order = Order(changes, {name: view.extent for name, view in new.items()}, skipped)
        if self._is_first:
            self._is_first = False
            order = replace(order, remembered=worker.remembered, place=self._place())
        with suppress(Gone):  # who asks for the outcome finds out why
            worker.channel.send(order, *descriptors)
        return -1

    def _place(self) -> ResumePoint | None:
        """Where the mirror is if the run goes on from a snapshot."""
        subsystem, layout = self.subsystem, self._worker.layout
        if not subsystem.state:
            return None
        names = [element.attribute for element in layout.memory]
        memory = Sender(layout.memory).changes(subsystem.memory, names)
        return ResumePoint(subsystem.state, vars(subsystem).get("_periods"), memory)

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
                left = self._worker.channel.receive()
                if not isinstance(left, Left):
                    raise Garbled(f"a value of the type {type(left).__name__}")
                self._outcome = self._mirror(left)
            except Gone:
                self._outcome = self._fault_of_end(self._worker.why_ended())
            except Garbled as garbled:
                self._outcome = self._fault_of_end(self._worker.ended_for(garbled))
        return self._outcome

    def _mirror(self, left: Left) -> Outcome:
        """Make the mirror what the step has left behind."""
        mirror = self.subsystem
        mirror.state, mirror.violations = sys.intern(left.state), left.violations
        if left.periods is not None:
            vars(mirror)["_periods"] = left.periods
        self._used = {extent: self._used[extent] for extent in left.extents_in_use}
        self._took(left.busy_s)
        if isinstance(left.outcome, int):
            self._y.take(mirror.y, left.y)
            self._memory.take(mirror.memory, left.memory)
            return left.outcome
        is_of_device = issubclass(left.outcome.kind, DeviceFailed)
        return fault_of(left.outcome, {} if is_of_device else self._inputs())

    def _fault_of_end(self, why: str) -> Fault:
        subsystem = self.subsystem
        fault = ProcessEnded(subsystem.name, subsystem.state, why)
        fault.inputs = self._inputs()
        return fault

    def _inputs(self) -> dict[str, object]:
        """What the step was given, with what only its process has read."""
        with suppress(DeviceFailed):
            compute_deferred(self.subsystem.x, self._sensed)
        return contents(self.subsystem.x)

    def left(self, error: BaseException) -> Fault | None:
        """See `Runner`."""
        if self._outcome is not None or self._begun is not None:
            return None
        subsystem = self.subsystem
        inputs = self._inputs()
        answer = self._worker.where()
        fault: Fault = StepAbandoned(subsystem.name, subsystem.state, error)
        if answer is not None:
            fault = fault_of(answer, inputs)
        fault.message, fault.__cause__, fault.inputs = error_text(error), error, inputs
        return fault
