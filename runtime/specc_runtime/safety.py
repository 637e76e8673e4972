"""Safe outputs: what devices get when a run ends, however it ends, before they are closed."""

from __future__ import annotations

import math
from abc import ABC
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np

from specc_runtime.clock import WallClock
from specc_runtime.examination import shortcomings
from specc_runtime.faults import DeviceFailed, error_text, text_of
from specc_runtime.plant import NO_SAMPLE, Guarded, Plant
from specc_runtime.sampling import Sensor, compute_deferred

SHARE = 0.05
"""Of the time of a run, what the safe outputs of a device may take that are never sent."""


class SafeOutputs(ABC):
    """The base of generated classes: the device `name`, some of whose `elements` have safe values.

    For each of them there is a method `safe_<element>`, and where that may fail another one,
    `otherwise_<element>`. They read `memory`, which has what the device `reports`, by the names of
    its attributes.
    """

    name: str
    elements: ClassVar[tuple[str, ...]]
    reports: ClassVar[Mapping[str, str]]
    silence_s: float = 0.0
    """How long the agent may be silent in real time until the device gets them; 0 if not said."""
    memory: Any


Commands = dict[str, tuple[str, object]]
"""By the name of an element of a device: who commanded it last, and what."""


@dataclass(frozen=True, slots=True)
class LastOutput:
    """What an element of a device was sent last: by `safe`, `otherwise` or a subsystem.

    `problem` says why that is not what it should have been.
    """

    value: object
    by: str
    problem: str = ""

    def as_data(self) -> dict[str, str]:
        """Plain values for a report."""
        value = text_of(self.value) if self.by else ""
        return {"value": value, "by": self.by, "problem": self.problem}


class LastWill:
    """Hands the safe outputs of devices to a plant, which gives them if the agent cannot.

    They are computed when the device has reported something, in at most `SHARE` of the time.
    """

    def __init__(
        self,
        devices: tuple[SafeOutputs, ...],
        plant: Guarded,
        sensors: Mapping[str, Sensor],
        clock: WallClock,
    ) -> None:
        self._plant = plant
        self._sensors = sensors
        self._devices = devices
        self._clock = clock
        self._seen: dict[str, tuple[int, ...]] = {}
        self._shortest_s: dict[str, float] = {}
        self._again_s: dict[str, float] = {}

    def update(self) -> None:
        """Compute the outputs of the devices that have reported since the last call."""
        now_s = self._clock.now_s()
        for device in self._devices:
            reports = (self._sensors.get(f"{device.name}.{e}") for e in device.reports)
            seen = tuple([sensor.count for sensor in reports if sensor is not None])
            if seen != self._seen.get(device.name) and now_s >= self._again_s.get(device.name, 0.0):
                self._compute(device)
                self._seen[device.name] = seen

    def _compute(self, device: SafeOutputs) -> None:
        begin_s = self._clock.now_s()
        self._plant.bequeath(device.name, self._of(device))
        end_s = self._clock.now_s()
        if device.name in self._seen:  # the first time, what it needs may be loaded
            least_s = min(end_s - begin_s, self._shortest_s.get(device.name, math.inf))
            self._shortest_s[device.name] = least_s
            self._again_s[device.name] = end_s + least_s / SHARE

    def _of(self, device: SafeOutputs) -> dict[str, list[tuple[str, Any]]]:
        _remember(device, self._sensors)
        will = {}
        for element in device.elements:
            outputs = [(by, _computed(compute)) for by, compute in _choices(device, element)]
            values = [(by, value) for by, (value, problem) in outputs if not problem]
            will[f"{device.name}.{element}"] = values
        return will


def hand_over(
    devices: tuple[SafeOutputs, ...],
    plant: Plant | None,
    sensors: Mapping[str, Sensor],
    clock: WallClock,
) -> None:
    """Let the plant know the safe outputs from now on, if it can give them itself."""
    if not shortcomings(plant, Guarded):
        guarded = cast(Guarded, plant)
        guarded.inherit(LastWill(devices, guarded, sensors, clock).update)


def leave_safe(
    devices: tuple[SafeOutputs, ...],
    plant: Plant,
    sensors: Mapping[str, Sensor],
    commands: Commands,
) -> dict[str, LastOutput]:
    """Send every safe output; never raises. Returns what every element was sent last, by name."""
    last = {name: LastOutput(value, by) for name, (by, value) in commands.items()}
    if not shortcomings(plant, Guarded):
        cast(Guarded, plant).leave()
    for device in devices:
        _remember(device, sensors)
        for element in device.elements:
            name = f"{device.name}.{element}"
            last[name] = _sent(device, element, plant, last.get(name, LastOutput(None, "")))
    return last


def _remember(device: SafeOutputs, sensors: Mapping[str, Sensor]) -> None:
    """Let safe outputs see what their device reported last."""
    for element, attribute in device.reports.items():
        sensor = sensors.get(f"{device.name}.{element}")
        if sensor is not None and sensor.value is not NO_SAMPLE:
            setattr(device.memory, attribute, sensor.value)
            with suppress(DeviceFailed):  # what reads it fails then, and `otherwise` is sent
                compute_deferred(device.memory, (attribute,))


def _choices(device: SafeOutputs, element: str) -> Iterator[tuple[str, Callable[[], Any]]]:
    """The values of a safe output, of which the first that works is sent."""
    for by in ("safe", "otherwise"):
        compute = getattr(device, f"{by}_{element}", None)
        if compute is not None:
            yield by, compute


def _computed(compute: Callable[[], Any]) -> tuple[Any, str]:
    """A value that can be sent, and why there is none; never raises."""
    try:
        value = compute()
        _refuse_not_finite(value)
    except BaseException as error:  # noqa: BLE001  # other devices get theirs all the same
        return None, error_text(error)
    return value, ""


def _sent(device: SafeOutputs, element: str, plant: Plant, before: LastOutput) -> LastOutput:
    """The outcome of sending one safe output: the first of its two values that works."""
    problems: list[str] = []
    for by, compute in _choices(device, element):
        value, problem = _computed(compute)
        if not problem:
            try:
                plant.actuate(f"{device.name}.{element}", value)
            except BaseException as error:  # noqa: BLE001  # as above
                problem = error_text(error)
            else:
                return LastOutput(value, by, "; ".join(problems))
        problems.append(f"{by}: {problem}")
    return LastOutput(before.value, before.by, "; ".join(problems))


def _refuse_not_finite(value: object) -> None:
    if isinstance(value, float | np.ndarray) and not np.isfinite(value).all():
        raise ValueError(f"{text_of(value)} is not finite")
