"""A plant in Python (`plant: {python: module:Class}`) as the devices of a host.

It runs in the Python of the agent, with the same modules. A plant is used by one thread at a time,
as it is without a host; only the last will does not wait for what hangs. `advance` is called with
the time that has passed, in whole base ticks, so that a simulation goes on with the clock.
"""

from __future__ import annotations

import pickle
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

from specc_runtime.faults import Fault
from specc_runtime.hosting.client import HostedPlant, Setup, reading_periods
from specc_runtime.hosting.devices import Array, DeviceError, Measured
from specc_runtime.loading import made
from specc_runtime.options import UsageError
from specc_runtime.plant import NO_SAMPLE, Deferred, Plant, Sample
from specc_runtime.plants.errors import PlantError
from specc_runtime.system import System

GRACE_S = 0.005
"""How long the last will waits for a call that is under way."""
_RAW = 1 << 12
"""Bytes of the smallest array that is not pickled."""


def hosted(system: System, seed: int) -> HostedPlant:
    """The plant in Python that a system names, in a device host; raises as `HostedPlant` does.

    Raises UsageError for a task that needs the plant in the process of the run.
    """
    assert system.plant is not None
    if system.task is not None and (system.task.scene or system.task.starts):
        raise UsageError(
            f"--real-time: the scene places things in a simulation, and {system.plant.python} runs "
            "in the device host; if it simulates, say so: `simulated = True` in its class"
        )
    config = {
        "python": system.plant.python,
        "path": list(sys.path),
        "seed": seed,
        "tick_s": system.tick_s,
        "periods": reading_periods(system),
    }
    names = [binding.name for binding in system.plant.sensors]
    return HostedPlant(
        system,
        Setup(f"{__name__}:PythonPlant", config),
        decode=dict.fromkeys(names, loaded),
        encode={output.actuator: pickle.dumps for output in system.plant.outputs}
        | {
            f"{s.name}.{element}": pickle.dumps for s in system.plant.safe for element in s.elements
        },
    )


class PythonPlant:
    """See `specc_runtime.hosting.devices.Devices`.

    `config` has `python`, the name of the plant, the `path` of its modules, the `seed`, `tick_s`,
    and the `periods` of the elements that are read, s. Values go as pickled bytes, since both ends
    are one program in one Python, and large arrays as they are.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._computed: SimpleQueue[Measured] = SimpleQueue()
        self._computing: set[str] = set()

    def open(self, config: dict[str, Any]) -> None:
        """Make the plant and reset it."""
        sys.path[:] = config["path"]
        self._tick_s = float(config["tick_s"])
        self._periods: dict[str, float] = config["periods"]
        with _told_plainly():
            self._plant: Plant = made("plant", config["python"], Plant)
            self._plant.reset(config["seed"])
        now_s = self._advanced_s = time.monotonic()
        self._due_s = dict.fromkeys(self._periods, now_s)

    def poll(self, timeout_s: float) -> list[Measured]:
        """The samples that are due, once it is time for one, and images that are there."""
        wake_s = min([self._advanced_s + self._tick_s, *self._due_s.values()])
        time.sleep(min(max(0.0, wake_s - time.monotonic()), timeout_s))
        with self._lock, _told_plainly():
            self._advance()
            samples = [(name, *self._sampled(name)) for name in self._due()]
        found = [made for sample in samples for made in self._measured(*sample)]
        try:
            while True:
                found.append(self._computed.get_nowait())
        except Empty:
            return found

    def _advance(self) -> None:
        """Let pass what has passed; time that was lost is not made up for tick by tick."""
        ticks = int((time.monotonic() - self._advanced_s) / self._tick_s)
        if ticks > 0:
            self._advanced_s += ticks * self._tick_s
            self._plant.advance(ticks * self._tick_s)

    def _due(self) -> list[str]:
        now_s = time.monotonic()
        due = [name for name, due_s in self._due_s.items() if due_s <= now_s]
        for name in due:
            period_s = self._periods[name]
            self._due_s[name] += period_s * (1 + int((now_s - self._due_s[name]) / period_s))
        return due

    def _sampled(self, name: str) -> tuple[Any, float]:
        """What the plant gives and when it was measured; an exception in the place of a value."""
        if name in self._computing:
            return NO_SAMPLE, 0.0
        begin_s = time.monotonic()
        try:
            value = self._plant.sample(name)
            if type(value) is Sample:
                return value.value, value.measured_s(time.monotonic())
        except BaseException as error:  # noqa: BLE001  # whatever the plant raises
            value = _plain(error)
        return value, begin_s

    def _measured(self, name: str, value: Any, at_s: float) -> list[Measured]:
        if value is NO_SAMPLE:
            return []
        if isinstance(value, BaseException):
            return [(name, value, at_s)]
        if type(value) is not Deferred:
            return [(name, _dumped(value), at_s)]
        self._computing.add(name)
        threading.Thread(target=self._compute, args=(name, value, at_s), daemon=True).start()
        return []

    def _compute(self, name: str, sample: Deferred, at_s: float) -> None:
        try:
            value = _dumped(sample.value())
        except BaseException as error:  # noqa: BLE001  # as above
            value = _plain(error)
        self._computed.put((name, value, at_s))
        self._computing.discard(name)

    def send(self, name: str, value: bytes) -> None:
        """Actuate, once no other call is under way."""
        with self._lock:
            self._actuate(name, value)

    def send_last(self, name: str, value: bytes) -> None:
        """Actuate, at the latest after `GRACE_S`, whatever call is under way."""
        is_alone = self._lock.acquire(timeout=GRACE_S)
        try:
            self._actuate(name, value)
        finally:
            if is_alone:
                self._lock.release()

    def _actuate(self, name: str, value: bytes) -> None:
        with _told_plainly():
            self._plant.actuate(name, pickle.loads(value))

    def close(self) -> None:
        """Close the plant, if there is one."""
        plant = getattr(self, "_plant", None)
        if plant is not None:
            with _told_plainly():
                plant.close()


def _dumped(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.nbytes >= _RAW and value.dtype.kind in "biufc":
        data = np.ascontiguousarray(value)
        return Array(data.dtype.str, data.shape, data.data)
    return pickle.dumps(value)


def loaded(value: Any) -> Any:
    """The value that was sent."""
    return pickle.loads(value) if type(value) is bytes else value


@contextmanager
def _told_plainly() -> Iterator[None]:
    """Errors that are meant to be told become errors of devices."""
    try:
        yield
    except (PlantError, UsageError, Fault) as error:
        raise _plain(error) from error


def _plain(error: BaseException) -> BaseException:
    return DeviceError(str(error)) if isinstance(error, PlantError | UsageError | Fault) else error
