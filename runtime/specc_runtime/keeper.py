"""Keeps the report on the disk while a run goes on, for the case that it is killed."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from specc_runtime.clock import WallClock
from specc_runtime.companion import View
from specc_runtime.report import write
from specc_runtime.session import Session

INTERVAL_S = 5.0
"""Wall time between two versions of the report."""


class Keeper:
    """Writes the report of a session at its beginning and from time to time."""

    period_s = 0.01

    def __init__(self, session: Session, path: Path, clock: WallClock) -> None:
        self._session = session
        self._path = path
        self._clock = clock
        self._write()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        if self._clock.now_s() - self._written_s >= INTERVAL_S:
            self._write()

    def close(self) -> None:
        """See `Companion`."""

    def _write(self) -> None:
        self._written_s = self._clock.now_s()
        with suppress(OSError):  # whether the whole report can be written is told at the end
            write(self._session.report(), self._path)
