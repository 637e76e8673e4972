"""How soon devices get their safe outputs when the agent is killed, or stopped.

An agent commands a device every 2 ms through a device host and is killed or stopped at a random
moment. Times count from the signal until the device has its safe output, in ms; those of SIGSTOP
are beyond the `silence` of the device.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import Any, ClassVar

from specc_runtime.hosting.client import HostedPlant, Setup
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.safety import SafeOutputs
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import PlantInput, PlantOutput, PlantSpec, Scheduled, System

from bench.harness.tables import table

SILENCE_S = 0.03
TICK_S = 0.002
LIMITS_MS = {"SIGKILL": 20.0, "SIGSTOP": 10.0}


class Device:
    """The devices object of the host: it notes when it was sent a safe output."""

    def open(self, config: dict[str, Any]) -> None:
        self.log = Path(config["log"])

    def poll(self, timeout_s: float) -> list[tuple[str, float, float]]:
        time.sleep(TICK_S)
        now_s = time.monotonic()
        return [("a.E.d.q", now_s, now_s)]

    def send(self, name: str, value: float) -> None:
        if value < 0.0:
            at_s = time.monotonic()
            self.log.write_text(f"{at_s}\n")

    def close(self) -> None:
        """Nothing is open."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--megabytes", type=int, default=200, help="memory of the agent")
    parser.add_argument("--agent", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.agent:
        agent(options.agent, options.megabytes)
        return
    rows = []
    for name, beyond_s in (("SIGKILL", 0.0), ("SIGSTOP", SILENCE_S)):
        number = signal.Signals[name]
        late = [
            1000.0 * (_until_safe_s(number, options.megabytes) - beyond_s)
            for _ in range(options.repeats)
        ]
        good = sum(ms <= LIMITS_MS[name] for ms in late)
        rows.append(
            (
                name if not beyond_s else f"{name}, beyond silence of {1000 * SILENCE_S:g} ms",
                f"{good} of {len(late)}",
                f"{LIMITS_MS[name]:g}",
                f"{median(late):.1f}",
                f"{max(late):.1f}",
            )
        )
    head = ("signal", "in time", "limit ms", "median ms", "longest ms")
    print(table("Safe outputs by the device host", head, rows))


def _until_safe_s(number: signal.Signals, megabytes: int) -> float:
    """From a signal to an agent until its device has the safe output."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        command = [sys.executable, "-m", "bench.device_host", "--agent", str(log)]
        process = subprocess.Popen(
            [*command, "--megabytes", str(megabytes)], stdout=subprocess.PIPE
        )
        assert process.stdout is not None
        if not process.stdout.readline():
            raise RuntimeError("the agent did not begin")
        time.sleep(0.1 + random.random() * 0.01)
        if log.exists():  # the machine was so busy that the agent itself was silent
            process.kill()
            process.communicate()
            return _until_safe_s(number, megabytes)
        begin_s = time.monotonic()
        process.send_signal(number)
        until_s = begin_s + 5.0
        while not (log.exists() and log.read_text().endswith("\n")) and time.monotonic() < until_s:
            time.sleep(0.005)
        process.kill()
        process.communicate()
        return float(log.read_text()) - begin_s if log.exists() else float("inf")


def agent(log: str, megabytes: int) -> None:
    """Command the device until the end."""
    kept = os.urandom(1 << 20) * megabytes
    plant = HostedPlant(_system(), Setup("bench.device_host:Device", {"log": log}, (os.getcwd(),)))
    plant.bequeath("a.E.d", {"a.E.d.u": [("safe", -1.0)]})
    print("begun", len(kept), flush=True)
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(2))
    due_s = time.monotonic()
    while True:
        plant.sample("a.E.d.q")
        plant.actuate("a.E.d.u", 1.0)
        plant.advance(TICK_S)
        due_s = max(due_s + TICK_S, time.monotonic())
        time.sleep(max(0.0, due_s - time.monotonic()))


class Node(Subsystem):
    """The one that commands the device; it is never stepped."""

    name = "a.e.d"
    period_s = TICK_S

    def step(self) -> int:
        raise NotImplementedError


class Safe(SafeOutputs):
    name = "a.E.d"
    elements = ()
    reports: ClassVar[Mapping[str, str]] = {}
    silence_s = SILENCE_S


def _system() -> System:
    plant = PlantSpec(
        sensors=(SensorBinding("a.E.d.q"),),
        actuators=(ActuatorBinding("a.E.d.u"),),
        inputs=(PlantInput("a.E.d.q", "a.e.d", "q"),),
        outputs=(PlantOutput("a.e.d", "u", "a.E.d.u"),),
        safe=(Safe(),),
    )
    return System("bench", TICK_S, (Scheduled(Node(), 1),), plant=plant)


if __name__ == "__main__":
    main()
