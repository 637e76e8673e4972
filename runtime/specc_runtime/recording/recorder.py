"""Recording a run, without any effect on the values that it computes."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from typing import Any

from specc_runtime.changes import Event
from specc_runtime.clock import WallClock
from specc_runtime.companion import OutputLost, View
from specc_runtime.examination import shortcomings
from specc_runtime.loading import load_layouts
from specc_runtime.options import Options
from specc_runtime.plant import Posed
from specc_runtime.recording.cells import Shelf
from specc_runtime.recording.log import FORMAT, Log
from specc_runtime.recording.pictures import LOOKS
from specc_runtime.recording.scene import PERIOD_S, SceneWriter
from specc_runtime.recording.snapshots import Snapshots
from specc_runtime.recording.steps import Steps, Truth
from specc_runtime.recording.text import dumped
from specc_runtime.recording.verdicts import Verdicts
from specc_runtime.records import StepRecord
from specc_runtime.report import Report, versions
from specc_runtime.sampling import PLANT
from specc_runtime.snapshot import Values
from specc_runtime.system import System

_ROUNDING = 1e-6  # times are multiples of a rounded tick


class SnapshotRecorder:
    """Writes from what a run can be started again; an observer of its records and a companion."""

    is_whole = False
    """Whether it writes steps, and the ground truth."""

    def __init__(
        self, file: Path, options: Options, system: System, clock: WallClock, begin_s: float
    ) -> None:
        """Begin recording, at `begin_s` of simulated time.

        Raises UsageError if the file cannot be written.
        """
        self.log = Log(file, clock)
        self.log.note("specc", _about(options, system, begin_s))
        for name, text in options.texts.items():
            self.log.attach(name, "application/yaml", text.encode())
        self._snapshots = Snapshots(self.log, system, load_layouts(system), begin_s)
        self.file, self.reach = file, self._snapshots.reach
        self.period_s = max(PERIOD_S, system.tick_s)
        self.report: Callable[[], Report] | None = None

    def __call__(self, record: StepRecord) -> None:
        """See a committed step."""

    def keep(self, time_s: float, saved: Callable[[Values], dict[str, Any]]) -> None:
        """See `specc_runtime.companion.Recording`."""
        self._snapshots.keep(time_s, saved)

    def changed(self, change: Event, time_s: float) -> None:
        """See `specc_runtime.companion.Recording`."""
        self._snapshots.changed(change, time_s)

    def tick(self, view: View) -> None:
        """See `Companion`."""

    def close(self) -> None:
        """See `Companion`. Raises OutputLost if a recording is not complete."""
        if self.report is not None:
            report = self.report().as_data()
            self._finish(report)
            text = json.dumps(report, ensure_ascii=False, allow_nan=False)
            # Bytes of a file name that are not UTF-8 are escaped.
            shown = text.encode("utf-8", "backslashreplace").decode()
            self.log.flush()  # the report comes after all steps, also in a file that is cut later
            self.log.note("report", {"report": shown})
        try:
            self.log.close()
        except OutputLost:
            if self.is_whole:
                raise
            # Nobody has asked for the file: a run that starts again says that it lacks something.

    def _finish(self, report: dict[str, Any]) -> None:
        """Write what is known at the end."""


class Recorder(SnapshotRecorder):
    """Writes every step of a run, too."""

    is_whole = True

    def __init__(
        self,
        options: Options,
        system: System,
        plant: Any,
        clock: WallClock,
        begin_s: float = 0.0,
    ) -> None:
        """Begin recording, at `begin_s` of simulated time.

        Raises UsageError if the file cannot be written.
        """
        assert options.record is not None
        super().__init__(options.record, options, system, clock, begin_s)
        layouts = load_layouts(system)
        look = LOOKS.get(options.record_images or "small")
        shelf = Shelf(self.log, options.record_exact or not _has_pictures(), look)
        self._steps = {
            s.subsystem.name: Steps(s.subsystem, layouts[s.subsystem.name], shelf, self.log)
            for s in system.subsystems
        }
        self._truth = Truth(layouts[PLANT], shelf, self.log) if PLANT in layouts else None
        posed = plant is not None and not shortcomings(plant, Posed)
        self._scene = SceneWriter(self.log, plant) if posed else None
        found = system.requirements
        self._verdicts = Verdicts(self.log, found.requirements, system.tick_s) if found else None

    def __call__(self, record: StepRecord) -> None:
        """Write a committed step, or the ground truth of the plant at a tick."""
        if self._truth is not None and record.subsystem == PLANT:
            self._truth.add(record)
        else:
            self._steps[record.subsystem].add(record)

    def tick(self, view: View) -> None:
        """See `Companion`."""
        if self._scene is not None:
            self._scene.note(view.time_s)
        if self._verdicts is not None:
            self._verdicts.note(view.time_s)

    def _finish(self, report: dict[str, Any]) -> None:
        for fault in report["faults"]:
            if fault["subsystem"] in self._steps:
                record = fault["stamp"], fault["time_s"], fault["message"]
                self._steps[fault["subsystem"]].failed(*record)
        if self._verdicts is not None:
            self._verdicts.note(report["simulated_s"], is_last=True)


def _has_pictures() -> bool:
    return find_spec("cv2") is not None


def _about(options: Options, system: System, begin_s: float) -> dict[str, str]:
    """The metadata for a replay."""
    return {
        "format": FORMAT,
        "system": system.name,
        "spec": next(iter(options.texts), ""),
        "seed": str(options.seed),
        "exact": str(options.record_exact).lower(),
        "from": str(ceil(begin_s / system.tick_s - _ROUNDING) or ""),  # as the run does
        "set": dumped(dict(options.built_with)).decode(),
        **({"scenario": options.scenario} if options.scenario else {}),
        "versions": dumped(versions()).decode(),
        "options": dumped(
            {
                "cycles": options.cycles,
                "duration_s": options.duration_s,
                "cycle_limit_s": options.cycle_limit_s,
                "renderer": options.renderer,
                "real_time": options.real_time,
            }
        ).decode(),
    }
