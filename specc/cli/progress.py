"""How far many runs, or a search, are: a line on a terminal that changes, or lines of a log."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from specc.cli import streams
from specc.diagnostics.phrases import counted

if TYPE_CHECKING:
    from specc.tools.explore.graph import Graph

_LOGGED_S = 10.0
"""Wall time between two lines of a log."""
_SEARCH_S = 1.0
"""Wall time between two lines about a search."""
_PASSES = 3
"""Of a search at most: coarse, with time counted, and with all values."""


class RunProgress:
    """How many runs are done and how long the rest may take: a line that changes, or a log."""

    def __init__(self, count: int, before: int) -> None:
        self._count, self._before = count, before
        self._begun_s = self._shown_s = time.monotonic()
        self._live = sys.stderr.isatty()

    def update(self, done: int) -> None:
        """So many runs are done now, besides those from before."""
        now_s = time.monotonic()
        if now_s - self._shown_s < (0.2 if self._live else _LOGGED_S):
            return
        self._shown_s = now_s
        words = f"{self._before + done} of {counted(self._count, 'run')}"
        if done:
            left = self._count - self._before - done
            words += f", {_duration((now_s - self._begun_s) / done * left)} left"
        if self._live:
            streams.update_status_line(words)
        else:
            streams.print_message(words)

    def close(self) -> None:
        """The last line is no longer true."""
        if self._live:
            streams.update_status_line("")


class SearchProgress:
    """How far a search is: a line on a terminal that changes; nothing elsewhere."""

    def __init__(self) -> None:
        self._shown_s = time.monotonic()
        self._live, self._is_shown = sys.stderr.isatty(), False

    def update(self, graph: Graph) -> None:
        """A graph is explored so far now."""
        now_s = time.monotonic()
        if not self._live or now_s - self._shown_s < _SEARCH_S:
            return
        self._shown_s, self._is_shown = now_s, True
        composition, states, here = graph.composition, len(graph.configurations), len(graph.edges)
        streams.update_status_line(
            f"{', '.join(composition.names)}: {grouped(states)} state{'s' * (states != 1)}, "
            f"{grouped(states - here)} waiting, {float(graph.depth_s(here)):.3g} s into the runs, "
            f"pass {composition.precision.pass_number} of {_PASSES}"
        )

    def close(self) -> None:
        """The last line is no longer true."""
        if self._is_shown:
            streams.update_status_line("")


def grouped(number: int) -> str:
    """A number with a space between thousands."""
    return f"{number:,}".replace(",", " ")


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
