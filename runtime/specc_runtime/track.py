"""One subsystem under way: its steps, here or in a worker thread, and what came of them."""

from __future__ import annotations

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future

from specc_runtime.ageing import Ageing
from specc_runtime.buffers import Put, Sent, sender
from specc_runtime.clock import WallClock
from specc_runtime.faults import AxiomViolated, DeviceFailed, Fault, StepAbandoned, StepFailed
from specc_runtime.interruption import Abandoned
from specc_runtime.records import StepRecord
from specc_runtime.sampling import Port, compute_deferred
from specc_runtime.subsystem import Subsystem, contents, input_name
from specc_runtime.system import Scheduled
from specc_runtime.timing import Quantiles
from specc_runtime.workers import Workers

Outcome = int | Fault
"""The transition taken or -1, or why the step failed."""


class Track:
    """Starts steps and commits what came of them.

    `pending` tells whether a step was started at `started_tick` and is not committed yet; `last` is
    the record of the last step that the others have seen; `late` is what was committed and sent
    before they may see it. `entered` is the stamp of the step that entered the state, `skipped`
    the number of periods before `stamp` in which no step began, `first_skipped` the first of them.
    `lateness` has for each period of a run in real time how long after its time a step began, that
    of a later period if it was skipped.
    """

    __slots__ = (
        "_readers", "_scheduled", "_send", "_watch", "ageing", "began_s", "entered",
        "first_skipped", "last", "late", "lateness", "name", "pending", "ports", "runner",
        "skipped", "stamp", "started_tick",
    )  # fmt: skip

    def __init__(
        self,
        scheduled: Scheduled,
        runner: Runner,
        readers: Mapping[str, Sequence[Put]],
        ports: tuple[Port, ...],
        watch: tuple[str, ...],
        ageing: Ageing | None = None,
    ) -> None:
        """`readers` has for each output the setters of those who read it.

        `ageing` has the ages of what it reads and sends, if any of them matters.
        """
        self.name = scheduled.subsystem.name
        self.runner = runner
        self.ports = ports
        self.ageing = ageing
        self.stamp = -1
        self.began_s = -math.inf
        """When the last step began by the clock of a run in real time."""
        self.started_tick = 0
        self.entered = 0
        self.skipped = 0
        self.first_skipped: int | None = None
        self.pending = False
        self.last: StepRecord | None = None
        self.lateness: Quantiles | None = None
        self.late: Sent = ()
        self._scheduled = scheduled
        self._readers = readers
        self._send = {
            state: sender(elements, [readers[element] for element in elements])
            for state, elements in scheduled.subsystem.sends.items()
        }
        self._watch = watch

    @property
    def ticks(self) -> int:
        """From one step to the next."""
        return self._scheduled.ticks

    @property
    def visible_tick(self) -> int:
        """When the others may see the step that is pending, if it is done by then."""
        return (self.stamp + 1) * self._scheduled.ticks

    @property
    def is_under_way(self) -> bool:
        """Whether a step was started whose outcome is not there yet."""
        return self.pending and not self.runner.is_done

    def note_late(self, tick: int, now_s: float, tick_s: float) -> None:
        """Count how late the periods are up to that of this tick, in which a step begins now."""
        if self.lateness is not None:
            periods = range(self.stamp + 1, tick // self.ticks + 1)
            self.lateness.add_overdue(now_s, self.ticks * tick_s, periods)

    def late_until(self, tick: int, now_s: float, tick_s: float) -> Quantiles:
        """The `lateness`, with periods up to that of this tick in which no step has begun."""
        late = copy.deepcopy(self.lateness) or Quantiles()
        over = range(self.stamp + 1, tick // self.ticks + 1)
        late.add_overdue(now_s, self.ticks * tick_s, over)
        return late

    def start(self, tick: int) -> None:
        """Begin the step of the period that this tick is in."""
        stamp = tick // self.ticks
        if skipped := stamp - self.stamp - 1:
            self.skipped += skipped
            if self.first_skipped is None:
                self.first_skipped = self.stamp + 1
        self.stamp = stamp
        self.started_tick = tick
        self.pending = True
        self.runner.start(skipped)

    def is_owed(self, gap: int, tick: int) -> bool:
        """Whether a step is due at a tick since its own one was in the `gap` that ends there.

        A gap is told by its first tick. A step is not owed within half a period of the next one.
        """
        own = tick - tick % self.ticks
        return gap <= own < tick and 2 * (own + self.ticks - tick) >= self.ticks

    def skipped_until(self, tick: int) -> int:
        """Periods in a row, with the one of this tick, in which no step began."""
        return tick // self.ticks - self.stamp

    def next_tick(self, tick: int) -> int:
        """When it is due, from this tick on."""
        return -(-tick // self.ticks) * self.ticks

    def go_on(self, tick: int, entered_tick: float | None) -> None:
        """Be between two steps at a tick, the next one that of its time.

        It has entered its state about at `entered_tick`; None if the next step is its first one.
        """
        self.stamp = self.next_tick(tick) // self.ticks - 1
        self.started_tick = self.stamp * self.ticks
        first = self.stamp + 1
        self.entered = first if entered_tick is None else round(entered_tick / self.ticks)

    def commit(
        self, tick_s: float, visible: int | None = None, *, is_early: bool = False
    ) -> StepRecord:
        """Make the pending step visible, at a tick; raises the fault that it ended in.

        If that `is_early`, what it sent is `late`, and nobody sees it yet. Nobody ever does if it
        was too old.
        """
        self.pending = False
        outcome = self.runner.outcome()
        if isinstance(outcome, Fault):
            raise outcome
        if outcome >= 0:
            self.entered = self.stamp
        subsystem = self._scheduled.subsystem
        state = subsystem.state
        watched: Sent = ()
        if self._watch:
            memory = subsystem.memory
            watched = tuple([(name, getattr(memory, name, None)) for name in self._watch])
        time_s = self.started_tick * tick_s
        visible = self.visible_tick if visible is None else visible
        is_too_old = self.ageing is not None and self.ageing.end(visible, is_early=is_early)
        if is_early or is_too_old:
            names = subsystem.sends[state]
            sent = sender(names, [()] * len(names))(subsystem.y)
            self.late = () if is_too_old else sent
        else:
            sent = self._send[state](subsystem.y)
        visible_s = visible * tick_s
        record = self.name, self.stamp, time_s, state, outcome, sent, watched, visible_s
        self.last = StepRecord(*record)
        return self.last

    def show(self) -> None:
        """Let the others see what is `late`."""
        if self.ageing is not None:
            self.ageing.show()
        late, self.late = self.late, ()
        for element, value in late:
            for put in self._readers[element]:
                put(value)


class Runner(ABC):
    """Starts a step and gives its outcome later; `busy_s` is the wall time of all steps.

    A step begins with the deferred samples among its inputs `sensed`; `clear` lowers the fresh
    flags of the `inbox`, where new inputs go. Who wants to know how long steps take gives it
    `durations`.
    """

    durations: Quantiles | None = None
    begins: Callable[[], None] | None = None
    """Called in a run in real time when a step begins."""

    def __init__(
        self,
        subsystem: Subsystem,
        sensed: tuple[str, ...],
        clear: Callable[[], None],
        clock: WallClock,
    ) -> None:
        self.subsystem = subsystem
        self.inbox = subsystem.x
        self.busy_s = 0.0
        self._sensed = sensed
        self._clear = clear
        self._now_s = clock.now_s

    @abstractmethod
    def start(self, skipped: int = 0) -> None:
        """Begin the step, so many periods `skipped`. New inputs belong to the next one now."""

    @property
    @abstractmethod
    def is_done(self) -> bool:
        """Whether the outcome is there, so that nobody has to wait for it."""

    @abstractmethod
    def outcome(self) -> Outcome:
        """What came of the step that was started, once it is there."""

    def left(self, error: BaseException) -> Fault | None:
        """The fault of a step that is under way in another process and is not waited for."""
        return None

    def _step(self) -> Outcome:
        if self.begins is not None:
            self.begins()
        begin_s = self._now_s()
        outcome = outcome_of(self.subsystem, self._sensed)
        self._took(self._now_s() - begin_s)
        return outcome

    def _took(self, duration_s: float) -> None:
        """Note how long a step was."""
        self.busy_s += duration_s
        if self.durations is not None:
            self.durations.add(duration_s)


class InlineRunner(Runner):
    """Steps at once, in the thread of the executor."""

    _outcome: Outcome = -1
    is_done = True

    def start(self, skipped: int = 0) -> None:
        """See `Runner`."""
        if skipped:
            self.subsystem.skip(skipped)
        self._outcome = self._step()
        self._clear()

    def outcome(self) -> Outcome:
        """See `Runner`."""
        return self._outcome


class WorkerRunner(Runner):
    """Steps in a pool, on a copy of the inputs, while the executor goes on."""

    def __init__(
        self,
        subsystem: Subsystem,
        sensed: tuple[str, ...],
        clear: Callable[[], None],
        clock: WallClock,
        pool: Workers,
    ) -> None:
        super().__init__(subsystem, sensed, clear, clock)
        self._pool = pool
        self._future: Future[Outcome] | None = None

    def start(self, skipped: int = 0) -> None:
        """See `Runner`."""
        if skipped:
            self.subsystem.skip(skipped)
        self.subsystem.x = copy.copy(self.inbox)
        self._clear()
        self._future = self._pool.submit(self._step)

    @property
    def is_done(self) -> bool:
        """See `Runner`."""
        return self._future is None or self._future.done()

    def outcome(self) -> Outcome:
        """See `Runner`."""
        return -1 if self._future is None else self._future.result()


def outcome_of(
    subsystem: Subsystem, sensed: tuple[str, ...], step: Callable[[], Outcome] | None = None
) -> Outcome:
    """One step; whatever goes wrong in it becomes a fault, with the broken axioms first.

    Without a `step` that stands for it, it is the subsystem's own.
    """
    try:
        compute_deferred(subsystem.x, sensed)
        outcome: Outcome = subsystem.step() if step is None else step()
    except DeviceFailed as failed:
        return failed
    except BaseException as error:  # noqa: BLE001  # whatever an operator raises ends the run as a fault
        outcome = _fault(subsystem, error)
    if not subsystem.violations:
        return outcome
    axioms = [subsystem.axioms[index] for index in subsystem.violations]
    violated = AxiomViolated(subsystem.name, subsystem.state, axioms)
    violated.inputs = contents(subsystem.x)
    violated.__cause__ = outcome if isinstance(outcome, Fault) else None
    return violated


def _fault(subsystem: Subsystem, error: BaseException) -> Fault:
    """The fault of a step that raised an exception, with all that is known of it."""
    if isinstance(error, Fault):
        fault = error
    else:
        module = type(subsystem).__module__
        if isinstance(error, AttributeError) and error.obj is subsystem.x:
            name = input_name(subsystem, error.name or "")
            absent = LookupError(f"{name} has no value")
            error = absent.with_traceback(error.__traceback__)
        kind = StepAbandoned if isinstance(error, Abandoned) else StepFailed
        fault = kind(subsystem.name, subsystem.state, error, module)
    fault.inputs = fault.inputs or contents(subsystem.x)
    key = subsystem.state, fault.origin.condition
    rows = [str(row) for row in subsystem.transitions if (row.source, row.condition) == key]
    fault.row = fault.row or "; ".join(rows)
    return fault
