"""Names what keeps a run from going on: an operator that hangs, in Python or outside of it."""

from __future__ import annotations

import faulthandler
import itertools
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType

from specc_runtime.clock import WallClock
from specc_runtime.faults import Frames, StepAbandoned, computed_at
from specc_runtime.interruption import SIGNALS, Interruption
from specc_runtime.printing import say
from specc_runtime.subsystem import Subsystem, contents
from specc_runtime.track import outcome_of

PATIENCE_S = 10.0
"""Wall time without progress after which what is under way is reported."""


class Watchdog:
    """While entered, tells on standard error what has been under way for too long.

    Its thread needs the interpreter. Where something holds that, `faulthandler` prints the stacks
    of all threads without it.
    """

    def __init__(
        self,
        progress: Callable[[], int],
        clock: WallClock,
        patience_s: float = PATIENCE_S,
        *,
        elsewhere: Callable[[], list[str]] = list,
    ) -> None:
        """`progress` gives a number that changes as long as the run goes on.

        `elsewhere` tells what other processes compute for it.
        """
        self._elsewhere = elsewhere
        self._progress = progress
        self._clock = clock
        self._patience_s = patience_s
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="specc-watchdog", daemon=True)

    def __enter__(self) -> Watchdog:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()
        faulthandler.cancel_dump_traceback_later()

    def _watch(self) -> None:
        # A signal that this thread gets does not wake the main one, which alone handles it.
        signal.pthread_sigmask(signal.SIG_BLOCK, (*SIGNALS, signal.SIGALRM))
        seen, since_s, is_reported = self._progress(), self._clock.now_s(), False
        self._arm()
        while not self._over.wait(self._patience_s / 4):
            self._arm()
            now_s, tick = self._clock.now_s(), self._progress()
            if tick != seen:
                seen, since_s, is_reported = tick, now_s, False
            elif not is_reported and now_s - since_s >= self._patience_s:
                is_reported = True
                for line in self._elsewhere() or under_way():
                    self._tell(f"no progress for {self._patience_s:g} s: {line}")

    def _tell(self, line: str) -> None:
        try:
            say(f"{line}; Ctrl-C ends the run")
        except (OSError, ValueError):  # standard error is closed
            self._over.set()

    def _arm(self) -> None:
        stream = sys.__stderr__
        try:
            number = stream.fileno() if stream is not None else -1
        except (OSError, ValueError):
            number = -1
        if number >= 0:
            faulthandler.dump_traceback_later(self._patience_s, file=number)


def under_way() -> list[str]:
    """What the threads of this process are computing: subsystems, else the innermost function."""
    if steps := steps_under_way():
        return steps
    main = threading.main_thread().ident or 0
    frame = sys._current_frames().get(main)
    inner = traceback.extract_stack(frame)[-1] if frame else None
    return (
        [f"in {inner.name} ({inner.filename.rsplit('/', 1)[-1]}:{inner.lineno})"] if inner else []
    )


def steps_under_way() -> list[str]:
    """The steps that threads of this process are computing."""
    return [text for stack in _stacks() if (text := _step(stack))]


def frames_of(subsystem: Subsystem) -> Frames:
    """The frames of the step of a subsystem that is under way in some thread."""
    for stack in _stacks():
        for index, (frame, _) in enumerate(stack):
            if frame.f_code is outcome_of.__code__ and frame.f_locals["subsystem"] is subsystem:
                return list(itertools.takewhile(_is_interrupted, stack[index + 1 :]))
    return []


def _is_interrupted(at: tuple[FrameType, int]) -> bool:
    """Whether a frame does not belong to a signal handler."""
    return at[0].f_code is not Interruption.on_alarm.__code__


def left(subsystem: Subsystem, error: BaseException) -> StepAbandoned:
    """The fault of a step that is under way in another thread and is not waited for."""
    fault = StepAbandoned(subsystem.name, subsystem.state, error)
    frames = frames_of(subsystem)
    fault.inputs = contents(subsystem.x)
    fault.origin, operator = computed_at(frames, type(subsystem).__module__)
    if operator:
        fault.culprit = f"operator {operator}"
    if frames:
        inner, line = frames[-1]
        file = inner.f_code.co_filename.rsplit("/", 1)[-1]
        fault.place = f"{inner.f_code.co_name} ({file}:{line})"
    return fault


def _step(stack: list[tuple[FrameType, int]]) -> str:
    for frame, _ in stack:
        if frame.f_code is outcome_of.__code__:
            subsystem: Subsystem = frame.f_locals["subsystem"]
            origin, operator = computed_at(stack, type(subsystem).__module__)
            inner, line = stack[-1]
            file = inner.f_code.co_filename.rsplit("/", 1)[-1]
            culprit = f"operator {operator}" if operator else f"subsystem {subsystem.name}"
            numbers = ", ".join(map(str, origin.equations))
            parts = [f"{culprit} in {subsystem.name} {subsystem.state}".strip()]
            parts += [f"eq. {numbers}"] if numbers else []
            return ", ".join((*parts, f"{inner.f_code.co_name} ({file}:{line})"))
    return ""


def _stacks() -> Iterator[list[tuple[FrameType, int]]]:
    """Every thread's frames with their lines, from the outermost to the innermost."""
    for innermost in sys._current_frames().values():
        yield list(traceback.walk_stack(innermost))[::-1]
