"""What others in ROS learn of how a run goes on: `/diagnostics`, once a second."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from specc_runtime.faults import Fault
from specc_runtime.records import StepRecord
from specc_runtime.ros2.run import Ros2Run
from specc_runtime.subsystem import input_name
from specc_runtime.system import System

OK, WARN, ERROR = b"\0", b"\1", b"\2"
"""Levels, as `diagnostic_msgs/DiagnosticStatus` has them."""
PERIOD_S = 1.0
_LONGEST = 400
"""Characters of what is said about a fault."""


class Diagnosing:
    """Tells a message with a status of each subsystem, once a second and after a fault.

    A subsystem is late if a step began in a later base tick than its own, and it may have skipped
    periods: then its status is a warning.
    """

    def __init__(self, system: System, tell: Callable[[dict[str, Any]], None]) -> None:
        self._name, self._tick_s, self._tell = system.name, system.tick_s, tell
        self._inputs: dict[str, list[tuple[str, str | tuple[str, str]]]] = {}
        """By subsystems: inputs, and the sensor or the output behind each."""
        subsystems = {each.subsystem.name: each.subsystem for each in system.subsystems}
        for name, element, source in _sources(system):
            inputs = self._inputs.setdefault(name, [])
            inputs.append((input_name(subsystems[name], element), source))
        self._states: dict[str, str] = {}
        self._computed_s: dict[tuple[str, str], float] = {}
        self._late_s: dict[str, float] = {}
        self._skipped: dict[str, int] = {}
        self._due_s: float | None = None

    def observe(self, record: StepRecord) -> None:
        """See `specc_runtime.records.Observer`."""
        self._states[record.subsystem] = record.state
        for output, _ in record.sent:
            self._computed_s[record.subsystem, output] = record.time_s

    def look(self, run: Ros2Run) -> None:
        """Note how late steps are; called once a base tick."""
        for name, (late_s, _) in run.late().items():
            if late_s > self._late_s.get(name, 0.0):
                self._late_s[name] = late_s
        now_s = time.monotonic()
        if self._due_s is None or now_s >= self._due_s:
            if self._due_s is not None:
                self._tell_all(run)
            self._due_s = now_s + PERIOD_S

    def end(self, run: Ros2Run) -> None:
        """The run is over: tell it if a fault ended it."""
        if run.faults:
            self._tell_all(run, run.faults[0])

    def _tell_all(self, run: Ros2Run, fault: Fault | None = None) -> None:
        entered, measured = run.entered(), run.ages()
        status = []
        for name, skipped in run.skipped().items():
            state, late_s = self._states.get(name, ""), self._late_s.pop(name, 0.0)
            new, self._skipped[name] = skipped - self._skipped.get(name, 0), skipped
            ages = self._ages(name, run.time_s, measured)
            lost = [element for element, age_s in ages.items() if age_s == math.inf]
            level, message = _judged(state, lost, new, late_s if late_s >= self._tick_s else 0.0)
            if fault is not None:
                level, message = ERROR, f"a fault ended the run: {fault}"[:_LONGEST]
            values = {
                "state": state,
                "time in state (s)": f"{run.time_s - entered[name]:.3f}",
                "lateness (ms)": f"{1e3 * late_s:.3f}",
                "skipped periods": str(skipped),
                **{f"age of {element} (ms)": _age_text(age_s) for element, age_s in ages.items()},
            }
            status.append(
                {
                    "level": level,
                    "name": name,
                    "message": message,
                    "hardware_id": self._name,
                    "values": [{"key": key, "value": value} for key, value in values.items()],
                }
            )
        self._tell({"header": {}, "status": status})

    def _ages(
        self, name: str, time_s: float, measured: Mapping[str, float]
    ) -> dict[str, float | None]:
        """How old the inputs of a subsystem are, since they were measured or else computed."""
        found: dict[str, float | None] = {}
        for element, source in self._inputs.get(name, ()):
            if isinstance(source, str):
                found[element] = measured.get(source)
            else:
                sent_s = self._computed_s.get(source)
                found[element] = None if sent_s is None else time_s - sent_s
        return found


def _age_text(age_s: float | None) -> str:
    if age_s is None:
        return "no value yet"
    return "lost" if age_s == math.inf else f"{1e3 * age_s:.1f}"


def _judged(state: str, lost: Sequence[str], skipped: int, late_s: float) -> tuple[bytes, str]:
    """Level and message, of what is lost and of what was so in the last second."""
    if lost:
        return WARN, f"{state}: {', '.join(lost)} lost"
    found = [f"{skipped} periods skipped"] if skipped else []
    found += [f"{1e3 * late_s:.1f} ms late"] if late_s else []
    return (WARN, f"{state}: {', '.join(found)} in the last second") if found else (OK, state)


def _sources(system: System) -> Iterator[tuple[str, str, str | tuple[str, str]]]:
    """Subsystems, an element of the input of each, and the sensor or the output behind it."""
    for item in system.plant.inputs if system.plant is not None else ():
        yield item.subsystem, item.element, item.sensor
    for each in system.connections:
        yield each.target, each.input, (each.source, each.output)
