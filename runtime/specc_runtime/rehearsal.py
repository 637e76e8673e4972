"""Runs of generated code whose devices report what a script says, in the forms of recordings."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from types import EllipsisType
from typing import Any

import numpy as np

from specc_runtime.clock import WallClock
from specc_runtime.cycle import Executor, Mark
from specc_runtime.faults import AxiomViolated, Fault
from specc_runtime.forms import Fetch, Form, NotRecorded
from specc_runtime.interruption import Interruption
from specc_runtime.loading import load_layouts, load_system
from specc_runtime.options import Options
from specc_runtime.plant import NO_SAMPLE
from specc_runtime.records import StepRecord
from specc_runtime.session import Session
from specc_runtime.system import PlantSpec, System

Reports = Mapping[str, Sequence[tuple[int, Any]]]
"""Of each sensor what it reports from which base tick on, first from 0; `...` is nothing new."""
GoesOn = Callable[[str, int, str, int, Mapping[str, Any]], bool]
"""Told of each step: its subsystem, stamp, state, row, and what it sent of numbers and vectors, in
the form of recordings. Says whether another tick is to follow."""


@dataclass(frozen=True, slots=True)
class Failure:
    """What ended a run: a fault of a step, or of what a sensor reports (stamp -1)."""

    subsystem: str
    stamp: int
    is_assumption: bool
    message: str


class Rehearsal:
    """The code in a directory, run again and again from its beginning."""

    def __init__(self, package: Path, base: Path) -> None:
        """`base` is where the specification's files are. Raises what `load_system` raises."""
        self._base = base
        self._system = system = load_system(package, base)
        self._module = type(system.subsystems[0].subsystem).__module__.rpartition(".")[0]
        self._forms = _forms(system)
        self.sensors = tuple(self._forms)
        self.ticks = {s.subsystem.name: s.ticks for s in system.subsystems}
        self.tick_s = system.tick_s
        self._plant = Scripted(self._forms) if system.plant is not None else None
        self._executor: Executor | None = None

    def influences(self, subsystem: str) -> list[str]:
        """The sensors that a subsystem gets values of, through as few others as possible first."""
        plant = self._system.plant
        near, found = {subsystem: None}, dict[str, None]()
        for name in _nearest_first(near, self._system):
            inputs = plant.inputs if plant else ()
            found |= dict.fromkeys(i.sensor for i in inputs if i.subsystem == name)
        return list(found)

    def run(
        self,
        reports: Reports,
        ticks: int,
        goes_on: GoesOn,
        since: Mark | None = None,
        keep: Collection[int] = (),
    ) -> tuple[list[Failure], dict[int, Mark]]:
        """A run up to a base tick: what ended it earlier, and the moments to `keep` on the way.

        It begins at a moment of a run `since` which reports are others, which saves time.
        Raises what `plant` raises.
        """
        if self._executor is None:
            self._executor = Executor(self.again(), self._plant, [self._observe], inline=True)
            self._begin = self._executor.mark()
        executor, marks = self._executor, dict[int, Mark]()
        executor.go_back(since or self._begin)
        if self._plant is not None:
            self._plant.follow(reports, executor.tick)
        self._going, self._goes_on = True, goes_on
        with np.errstate(all="ignore"):
            while True:
                if executor.tick in keep:
                    marks[executor.tick] = executor.mark()
                if not (self._going and executor.tick < ticks and executor.advance()):
                    break
            executor.finish()
        return [_failure(fault) for fault in executor.faults], marks

    def _observe(self, record: StepRecord) -> None:
        step = record.subsystem, record.stamp, record.state, record.transition
        self._going = self._goes_on(*step, dict(_plain(record.sent))) and self._going

    def again(self) -> System:
        """The system at its beginning, which nothing disturbs."""
        system: System = import_module(f"{self._module}.system").build(str(self._base))
        task = replace(system.task, disturb=()) if system.task is not None else None
        return replace(system, task=task, triggers=None, plant=_without_panel(system.plant))

    def plant(self, reports: Reports) -> Scripted | None:
        """What stands behind its devices, if there are any.

        Raises NotRecorded, Misshapen for what is no value of an element.
        """
        if self._system.plant is None:
            return None
        plant = Scripted(self._forms)
        plant.follow(reports, 0)
        return plant


def record(
    rehearsal: Rehearsal, reports: Reports, duration_s: float, options: Mapping[str, Any]
) -> list[str]:
    """Record such a run, with these options of a run; gives the verdicts on the requirements.

    Raises OutputLost, UsageError if that cannot be written.
    """
    from specc_runtime.recording.recorder import Recorder

    run_options = Options(Path(), duration_s=duration_s, record_exact=True, inline=True, **options)
    system, plant, clock = rehearsal.again(), rehearsal.plant(reports), WallClock()
    recorder = Recorder(run_options, system, plant, clock)
    session = Session(run_options, system, plant, None, clock, Interruption(), recorder)
    recorder.report = session.report
    try:
        with np.errstate(all="ignore"):
            session.run()
        return [each["verdict"] for each in session.report().requirements]
    finally:
        recorder.close()


def _plain(sent: Iterable[tuple[str, Any]]) -> Iterator[tuple[str, Any]]:
    for name, value in sent:
        if isinstance(value, float):
            yield name, value
        elif isinstance(value, np.ndarray) and value.dtype == float and value.ndim == 1:
            yield name, value.tolist()


def _nearest_first(near: dict[str, None], system: System) -> Iterator[str]:
    """Some subsystems, then those that send them something, and so on."""
    waiting = list(near)
    for name in waiting:
        yield name
        for connection in system.connections:
            if connection.target == name and connection.source not in near:
                near[connection.source] = None
                waiting.append(connection.source)


def _forms(system: System) -> dict[str, Form]:
    layouts = load_layouts(system)
    return {
        item.sensor: element.form
        for item in (system.plant.inputs if system.plant else ())
        for element in layouts[item.subsystem].x
        if element.attribute == item.element
    }


def _failure(fault: Fault) -> Failure:
    if isinstance(fault.__cause__, KeyboardInterrupt):
        raise fault.__cause__
    return Failure(fault.subsystem, fault.stamp, isinstance(fault, AxiomViolated), fault.message)


def _without_panel(plant: PlantSpec | None) -> PlantSpec | None:
    """Devices of which all report, those of the operator as well."""
    if plant is None:
        return None
    return replace(plant, sensors=tuple([replace(s, panel=None) for s in plant.sensors]))


class Scripted:
    """A plant that reports by a script, and takes every command."""

    def __init__(self, forms: Mapping[str, Form]) -> None:
        self._forms = forms

    def follow(self, reports: Reports, tick: int) -> None:
        """Report that, from a base tick on. Raises NotRecorded, Misshapen for other values."""
        self._tick = tick
        self._ticks = {name: [tick for tick, _ in reported] for name, reported in reports.items()}
        self._values = {
            name: [
                NO_SAMPLE if data is ... else _value(self._forms[name], data)
                for _, data in reported
            ]
            for name, reported in reports.items()
        }

    def reset(self, seed: int) -> None:
        """See `Plant`."""

    def sample(self, name: str) -> Any:
        """See `Plant`."""
        return self._values[name][bisect_right(self._ticks[name], self._tick) - 1]

    def actuate(self, name: str, value: Any) -> None:
        """See `Plant`."""

    def advance(self, duration_s: float) -> None:
        """See `Plant`."""
        self._tick += 1

    def close(self) -> None:
        """See `Plant`."""


def _value(form: Form, data: Any) -> Any:
    return data if isinstance(data, EllipsisType) else form.value(data, _Blank())


class _Blank(Fetch):
    """Images are all black; nothing stands for what only operators look into."""

    def image(self, data: Any) -> np.ndarray[Any, Any]:
        """See `Fetch`."""
        image = np.zeros(tuple(data), np.uint8 if len(data) == 3 else np.float32)
        image.setflags(write=False)
        return image

    def packed(self, kind: str, data: Any) -> bytes:
        """See `Fetch`."""
        raise NotRecorded(f"a value of {kind}")
