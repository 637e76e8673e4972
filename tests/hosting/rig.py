"""A system with one or two devices, and a plant behind which a real host with stubs is."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from specc_runtime.hosting.client import HostedPlant, Setup
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.safety import SafeOutputs
from specc_runtime.system import PlantInput, PlantOutput, PlantSpec, Scheduled, System

from tests.runtime.tiny import Node

HERE = Path(__file__).parent
DEVICES = "stub_devices:Devices"


class Safe(SafeOutputs):
    """Declares the silence of a device; its will is bequeathed by the test."""

    elements = ()
    reports: ClassVar[Mapping[str, str]] = {}

    def __init__(self, name: str, silence_s: float) -> None:
        self.name = name
        self.silence_s = silence_s


def system(*devices: str, sporadic: bool = False, silence_s: float = 0.0) -> System:
    """A subsystem for each device `a.E.d`, which reads its `q` and commands its `u`."""
    devices = devices or ("a.E.d",)
    nodes = [Node(device.replace("E", "e")) for device in devices]
    return System(
        "hosted",
        0.002,
        tuple(Scheduled(node, 1) for node in nodes),
        plant=PlantSpec(
            sensors=tuple(SensorBinding(f"{d}.q", sporadic=sporadic) for d in devices),
            safe=tuple(Safe(d, silence_s) for d in devices if silence_s),
            actuators=tuple(ActuatorBinding(f"{d}.u") for d in devices),
            inputs=tuple(
                PlantInput(f"{d}.q", n.name, "q") for d, n in zip(devices, nodes, strict=True)
            ),
            outputs=tuple(
                PlantOutput(n.name, "value", f"{d}.u") for d, n in zip(devices, nodes, strict=True)
            ),
        ),
    )


def plant(folder: Path, built: System | None = None, **config: Any) -> HostedPlant:
    """A plant in a host with the stubs."""
    setup = Setup(DEVICES, {"log": str(folder / "log"), **config}, (str(HERE),), wait_s=20.0)
    return HostedPlant(built or system(), setup)


def log(folder: Path) -> list[tuple[float, str, Any]]:
    """What the devices noted: when, the element or the call, and the value."""
    lines = (folder / "log").read_text().splitlines()
    return [(at, name, value) for at, name, value in map(json.loads, lines)]


def until(done: Any, limit_s: float = 20.0) -> bool:
    """Wait until something is so; whether it is."""
    until_s = time.monotonic() + limit_s
    while not (is_done := bool(done())) and time.monotonic() < until_s:
        time.sleep(0.002)
    return is_done
