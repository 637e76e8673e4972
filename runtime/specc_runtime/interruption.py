"""Ctrl-C, SIGTERM and the like as a request: a run ends between two ticks, with its report."""

from __future__ import annotations

import os
import signal
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any

GRACE_S = 2.0
"""Wall time within which what is under way has to end once a run is interrupted."""
SAFE_S = 10.0
"""Wall time that the plant has to take the safe outputs, and to close once it is asked to."""
_MOST_RAISED = 2
"""Times that `Abandoned` is raised in something that catches it and goes on."""
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""What ends a run."""


_HEARD_S = 0.05
"""Wall time in which a signal is heard, unless something blocks that did not notice it."""


class Abandoned(BaseException):
    """Raised in whatever the main thread still does when its time is over."""


class _Reminder:
    """Repeats a signal until the main thread has heard it.

    Python calls handlers between two instructions. A signal that comes after the last one before a
    call that blocks is heard when that returns, which may be never; the next one interrupts it.
    """

    def __init__(self, is_heard: Callable[[int], bool], give_up: Callable[[int], None]) -> None:
        """`give_up` is called with a signal that the main thread has not heard in `GRACE_S`."""
        self._is_heard = is_heard
        self._give_up = give_up
        self._main = threading.get_ident()
        reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        self._previous = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        # What is registered stays to the end of the process: the run must not stay with it.
        forget = weakref.WeakMethod(self._forget)
        os.register_at_fork(after_in_child=lambda: (call := forget()) and call())
        threading.Thread(
            target=self._remind, args=(reader,), name="specc-signals", daemon=True
        ).start()

    def close(self) -> None:
        """End the thread, which may take a moment: the run must not stay with it until then."""
        self._is_heard, self._give_up = lambda _: True, lambda _: None
        signal.set_wakeup_fd(self._previous)
        writer, self._writer = self._writer, -1
        os.close(writer)

    def _forget(self) -> None:
        """What a child process hears is no concern of its parent."""
        if self._writer >= 0:
            signal.set_wakeup_fd(-1)

    def _remind(self, reader: int) -> None:
        # A signal that this thread gets does not wake the main one, which alone handles it.
        signal.pthread_sigmask(signal.SIG_BLOCK, (*SIGNALS, signal.SIGALRM))
        with open(reader, "rb", buffering=0) as numbers:
            while number := numbers.read(1):
                time.sleep(_HEARD_S)
                if self._writer >= 0 and not self._is_heard(number[0]):
                    signal.pthread_kill(self._main, number[0])
                    self._wait(number[0])

    def _wait(self, number: int) -> None:
        begin_s = time.monotonic()
        while self._writer >= 0 and not self._is_heard(number):
            if time.monotonic() - begin_s > GRACE_S:
                return self._give_up(number)
            time.sleep(_HEARD_S)


class Interruption:
    """While entered, the first signal sets `requested`; a second Ctrl-C interrupts as usual.

    Other signals after the first change nothing: plants get their safe outputs and are closed
    before the end. What goes on for longer than `GRACE_S` after the first one, or than `allow`
    says, is abandoned by raising `Abandoned` in it; if it keeps catching that, `last_resort` has to
    end the process.

    `exit_code` is 128 and the number of the signal, as shells have it.
    """

    def __init__(self) -> None:
        self.requested = False
        self.exit_code = 128 + signal.SIGINT
        self._previous: dict[int, Any] = {}
        self._alarm: Any = None
        self._is_heard = False
        self._reminder: _Reminder | None = None
        self._raised = 0
        self._limit_s, self._since = GRACE_S, " after the run was interrupted"
        self.last_resort: Callable[[], None] | None = None
        self._is_loading = False

    def request(self) -> None:
        """Ask the run to end."""
        self.requested = True

    @property
    def is_signalled(self) -> bool:
        """Whether a signal has asked for the end."""
        return self._is_heard

    def __enter__(self) -> Interruption:
        # Python lets only the main thread handle signals; elsewhere they are somebody else's.
        if threading.current_thread() is threading.main_thread():
            heard = [n for n in SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
            self._previous = {n: signal.signal(n, self._on_signal) for n in heard}
            self._alarm = signal.signal(signal.SIGALRM, self.on_alarm)
            self._reminder = _Reminder(self._has_heard, self._unheard)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._reminder is not None:
            self._reminder.close()
        self._restore()
        if self._alarm is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, self._alarm)
            self._alarm = None

    def on_alarm(self, number: int, frame: FrameType | None) -> None:
        """Abandon what is under way; if it keeps catching the exception, end the process."""
        self._raised += 1
        if self._raised > _MOST_RAISED and self.last_resort is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self.last_resort()
        raise self.abandoned()

    def abandoned(self) -> Abandoned:
        """What is raised in what takes too long now."""
        return Abandoned(f"still computing {self._limit_s:g} s{self._since}")

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._is_heard:
            return
        self._is_heard = True
        self.exit_code = 128 + number
        self.request()
        if (usual := self._previous.pop(signal.SIGINT, None)) is not None:
            signal.signal(signal.SIGINT, usual)
        if not any(signal.getitimer(signal.ITIMER_REAL)):
            signal.setitimer(signal.ITIMER_REAL, self._limit_s, self._limit_s)

    def _has_heard(self, number: int) -> bool:
        """Whether the main thread has handled a signal, or need not."""
        if number == signal.SIGALRM:
            return self._raised > 0 or not self._is_loading
        return self._is_heard or number not in SIGNALS

    @contextmanager
    def loading(self) -> Iterator[None]:
        """Meanwhile a signal that is not heard ends the process, with the report, after a while."""
        self._is_loading = True
        try:
            yield
        finally:
            self._is_loading = False

    def _unheard(self, number: int) -> None:
        """Something outside of Python, like the compiler of a model, lets no signal be heard."""
        if self._is_loading and self.last_resort is not None:
            if not self.requested:
                self.exit_code = 128 + number
                self.request()
            self.last_resort()

    def allow(self, *, always: bool) -> None:
        """What comes next may take `SAFE_S`: `always`, or from when the run is interrupted."""
        self._raised = 0
        self._limit_s = SAFE_S
        self._since = " after it began" if always else " after it was to end"
        if self._alarm is not None:
            limit_s = SAFE_S if always or self.requested else 0.0
            signal.setitimer(signal.ITIMER_REAL, limit_s, limit_s)
            if self.requested and not limit_s:  # a signal came between the two lines above
                signal.setitimer(signal.ITIMER_REAL, SAFE_S, SAFE_S)

    def _restore(self) -> None:
        for number, handler in self._previous.items():
            # A handler that was not set from Python reads as None and cannot be set again.
            if handler is not None:
                signal.signal(number, handler)
        self._previous = {}
