"""Going on after lost parts of a recording, at the next complete snapshot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from specc_runtime.forms import Layout
from specc_runtime.recording.budget import Budget, Unusable
from specc_runtime.recording.snapshots import every_snapshot, snapshot_of
from specc_runtime.snapshot import Values
from specc_runtime.system import System

_BYTES = 100
"""Bytes for each stamp that is kept."""


class Resumption(NamedTuple):
    """The start of a subsystem: the source of values, its part of a snapshot, its last stamp."""

    values: Values
    saved: Mapping[str, Any]
    stamp: int


class Resumptions:
    """The complete snapshots of a recording."""

    def __init__(self, file: Path, system: System, layouts: Mapping[str, Layout]) -> None:
        self._file, self._system, self._layouts = file, system, layouts
        self._stamps: list[tuple[str, Mapping[str, Any]]] | None = None
        """The tick of each snapshot, and the stamps of the last steps before it."""
        self._read: dict[str, tuple[Any, Values] | None] = {}
        """The results of looking up ticks; a complete snapshot is kept."""
        self._budget = Budget(file)

    def next(self, subsystem: str, stamp: int) -> Resumption | None:
        """The snapshot from which the step of that stamp, or a later one, follows; None if none.

        None, too, if too much would have to be read: each snapshot takes a pass over the file.
        """
        try:
            return self._next(subsystem, stamp)
        except Unusable:
            return None

    def _next(self, subsystem: str, stamp: int) -> Resumption | None:
        if self._stamps is None:
            self._stamps = []
            for snapshot in every_snapshot(self._file, self._budget):
                self._budget.keep(_BYTES * len(snapshot["stamps"]))
                self._stamps.append((str(snapshot["tick"]), snapshot["stamps"]))
        for tick, stamps in self._stamps:
            last = stamps.get(subsystem)
            if type(last) is not int or last + 1 < stamp:
                continue
            if (found := self._at(tick)) is not None:
                saved, values = found
                return Resumption(values, saved["subsystems"][subsystem], last)
        return None

    def _at(self, tick: str) -> tuple[Any, Values] | None:
        if tick not in self._read:
            self._read = {tick: None for tick, snapshot in self._read.items() if snapshot is None}
            self._read[tick] = None
            saved, shelf = snapshot_of(self._file, tick, self._budget)
            if saved is not None and shelf.is_whole:
                self._read[tick] = saved, Values(self._system, self._layouts, shelf)
        return self._read[tick]
