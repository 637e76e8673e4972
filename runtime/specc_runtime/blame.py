"""Who used the device at fault: the subsystem that commanded it last, or the one that reads it."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping

from specc_runtime.faults import Fault, JudgeFailed, PlantFailed
from specc_runtime.origin import Origin, origin_of_output
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import PlantSpec, System
from specc_runtime.track import Track


class Blame:
    """Makes faults of what a plant raises, and completes those of devices."""

    def __init__(self, system: System, tracks: Mapping[str, Track]) -> None:
        self._plant = system.plant or PlantSpec("")
        self._tracks = tracks

    def of_plant(self, error: BaseException, time_s: float) -> Fault:
        """The fault of a plant that cannot go on at `time_s`; it names who commanded the plant."""
        fault = error if isinstance(error, Fault) else PlantFailed(error)
        fault.time_s = time_s
        self._by_writer(fault, fault.device)
        self._by_reader(fault, fault.device)
        if isinstance(fault, PlantFailed) and fault.subsystem and not fault.part:
            # The plant did nothing wrong: it was given what no actuator takes.
            fault.culprit = f"subsystem {fault.subsystem}"
        return fault

    def of_step(self, fault: Fault, track: Track, tick_s: float) -> Fault:
        """The fault of a step that was to become visible."""
        if isinstance(fault, JudgeFailed):
            fault.time_s = track.visible_tick * tick_s
            return fault
        subsystem = track.runner.subsystem
        fault.stamp, fault.time_s = track.stamp, track.started_tick * tick_s
        fault.subsystem, fault.state = track.name, subsystem.state
        fault.modes = subsystem.modes.get(fault.state, ())
        element = getattr(fault, "element", "")
        for output in self._plant.outputs:
            if (output.subsystem, output.actuator) == (track.name, fault.device):
                element = output.element
        if element and not fault.origin.line:
            fault.origin = self.origin(subsystem, subsystem.state, element)
        return fault

    def origin(self, subsystem: Subsystem, state: str, element: str) -> Origin:
        """Where an output element is assigned in a state."""
        module = sys.modules.get(type(subsystem).__module__)
        behaviour = subsystem.equations.behaviours.get(state, ())
        return origin_of_output(getattr(module, "__file__", None) or "", element, behaviour)

    def _by_writer(self, fault: Fault, device: str) -> None:
        for track, element in self._writers(device):
            last = track.last
            if last is None:
                continue
            fault.subsystem, fault.state = track.name, last.state
            fault.modes = track.runner.subsystem.modes.get(fault.state, ())
            fault.stamp, fault.time_s = last.stamp, last.time_s
            fault.origin = self.origin(track.runner.subsystem, last.state, element)
            fault.inputs = fault.inputs or {"command": dict(last.sent).get(element)}

    def _writers(self, device: str) -> Iterator[tuple[Track, str]]:
        outputs = self._plant.outputs
        return ((self._tracks[o.subsystem], o.element) for o in outputs if o.actuator == device)

    def _by_reader(self, fault: Fault, device: str) -> None:
        for item in self._plant.inputs:
            if item.sensor == device and not fault.subsystem:
                track = self._tracks[item.subsystem]
                fault.subsystem, fault.state = track.name, track.runner.subsystem.state
                fault.modes = track.runner.subsystem.modes.get(fault.state, ())
                fault.stamp = track.stamp + 1
