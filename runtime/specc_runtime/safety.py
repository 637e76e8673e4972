"""Safe outputs: what devices get when a run ends, however it ends, before they are closed."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from specc_runtime.faults import DeviceFailed, said, text_of
from specc_runtime.plant import NO_SAMPLE, Plant
from specc_runtime.sampling import Sensor, compute_deferred


class SafeOutputs(ABC):
    """The base of generated classes: the device `name`, some of whose `elements` have safe values.

    For each of them there is a method `safe_<element>`, and where that may fail another one,
    `otherwise_<element>`. They read `memory`, which has what the device `reports`, by the names of
    its attributes.
    """

    name: str
    elements: ClassVar[tuple[str, ...]]
    reports: ClassVar[Mapping[str, str]]
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


def leave_safe(
    devices: tuple[SafeOutputs, ...],
    plant: Plant,
    sensors: Mapping[str, Sensor],
    commands: Commands,
) -> dict[str, LastOutput]:
    """Send every safe output; never raises. Returns what every element was sent last, by name."""
    last = {name: LastOutput(value, by) for name, (by, value) in commands.items()}
    for device in devices:
        for element, attribute in device.reports.items():
            sensor = sensors.get(f"{device.name}.{element}")
            if sensor is not None and sensor.value is not NO_SAMPLE:
                setattr(device.memory, attribute, sensor.value)
                with suppress(DeviceFailed):  # what reads it fails then, and `otherwise` is sent
                    compute_deferred(device.memory, (attribute,))
        for element in device.elements:
            name = f"{device.name}.{element}"
            last[name] = _sent(device, element, plant, last.get(name, LastOutput(None, "")))
    return last


def _sent(device: SafeOutputs, element: str, plant: Plant, before: LastOutput) -> LastOutput:
    """The outcome of sending one safe output: the first of its two values that works."""
    problems = []
    for by in ("safe", "otherwise"):
        compute = getattr(device, f"{by}_{element}", None)
        if compute is None:
            continue
        try:
            value = compute()
            _refuse_not_finite(value)
            plant.actuate(f"{device.name}.{element}", value)
        except BaseException as error:  # noqa: BLE001  # other devices get theirs all the same
            problems.append(f"{by}: {said(error)}")
        else:
            return LastOutput(value, by, "; ".join(problems))
    return LastOutput(before.value, before.by, "; ".join(problems))


def _refuse_not_finite(value: object) -> None:
    if isinstance(value, float | np.ndarray) and not np.isfinite(value).all():
        raise ValueError(f"{text_of(value)} is not finite")
