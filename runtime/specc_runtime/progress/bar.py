"""Progress on standard error: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import math
import sys

from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion, View
from specc_runtime.telling import say

BAR_INTERVAL_S = 0.1
LINE_INTERVAL_S = 5.0
"""Wall time between two updates."""


class Bar:
    """A bar of cycles or of simulated time, with the states of all subsystems."""

    period_s = 0.01

    def __init__(self, clock: WallClock) -> None:
        # A run that nobody watches begins without what draws the bar.
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._clock = clock
        self._shown_s = clock.now_s()
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[time]}  {task.fields[states]}"),
        )
        console = Console(stderr=True)
        self._progress = Progress(*columns, console=console, auto_refresh=False, transient=True)
        self._task = self._progress.add_task("", total=None, time="", states="")
        self._progress.start()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        now_s = self._clock.now_s()
        if now_s - self._shown_s >= BAR_INTERVAL_S:
            self._shown_s = now_s
            done, total = _part(view)
            self._progress.update(
                self._task,
                description=_what(view),
                completed=done,
                total=total,
                time=f"{view.time_s:.2f} s",
                states=_states(view),
            )
            self._progress.refresh()

    def close(self) -> None:
        """See `Companion`."""
        self._progress.stop()


class Lines:
    """The same as plain lines, for logs."""

    period_s = 0.1

    def __init__(self, clock: WallClock) -> None:
        self._clock = clock
        self._shown_s = -math.inf
        self._cycles = 0

    def tick(self, view: View) -> None:
        """See `Companion`."""
        now_s = self._clock.now_s()
        if now_s - self._shown_s >= LINE_INTERVAL_S or len(view.fulfilled) != self._cycles:
            self._shown_s = now_s
            self._cycles = len(view.fulfilled)
            text = f"{_what(view)}  {view.time_s:.2f} s  {_states(view)}"
            say(text.strip())

    def close(self) -> None:
        """See `Companion`."""


def progress(clock: WallClock) -> Companion:
    """What suits standard error."""
    return Bar(clock) if sys.stderr.isatty() else Lines(clock)


def _what(view: View) -> str:
    if view.cycles is None:
        done = len(view.fulfilled)
        return f"{done} cycle{'s' * (done > 1)}" if done else "running"
    return f"cycle {min(len(view.fulfilled) + 1, view.cycles)}/{view.cycles}"


def _part(view: View) -> tuple[float, float | None]:
    if view.cycles is not None:
        # One cycle has no measure of its progress: the bar only moves.
        return len(view.fulfilled), view.cycles if view.cycles > 1 else None
    return view.time_s, view.duration_s


def _states(view: View) -> str:
    return "  ".join(f"{name} {state}" for name, state in view.states.items() if state)
