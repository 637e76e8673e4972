"""The devices of a host as the plant of a run in real time."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from specc_runtime.faults import DeviceFailed
from specc_runtime.hosting.courier import Outcome
from specc_runtime.hosting.devices import Array
from specc_runtime.hosting.keeper import CLOSE_S, WILL_S
from specc_runtime.hosting.memory import MOST_PINNED, Raw
from specc_runtime.hosting.starting import Host
from specc_runtime.hosting.views import Convert, value_of
from specc_runtime.hosting.wire import NotPlain, garbled
from specc_runtime.plant import NO_SAMPLE, Deferred, Sample
from specc_runtime.plants.errors import PlantError
from specc_runtime.system import System

SILENCE_S = 1.0
"""The silence after which a device gets its safe outputs that declares none, unless its subsystem
has a longer period: then it is `_PERIODS` of them."""
_PERIODS = 3
RENEWED_S = 0.5
"""How long the last sample counts of a device that is not sporadic, or `_PERIODS` of its reader."""
ASKED_S = 1.0
"""How long a run may go on that was not asked to end when its host was."""
_LARGE = 1 << 14
"""Bytes of values that stay in shared memory until they are read, and of arrays as bytes."""
WAIT_S = 10.0


@dataclass(frozen=True, slots=True)
class Setup:
    """How devices are opened in a host.

    Attributes:
        devices: `module:factory`, what makes them.
        config: plain data for their `open`.
        path: folders that are searched for modules first.
        python: the program that is the host, of Python 3.10 or later; empty for the agent's own.
        wait_s: how long it may take until all are open and have measured.
        besides: what the devices report that is no element of the system, as sporadic ones do.
    """

    devices: str
    config: Mapping[str, Any]
    path: tuple[str, ...] = ()
    python: str = ""
    wait_s: float = WAIT_S
    besides: tuple[str, ...] = ()


class _Reading:
    """What the agent knows of an element that it reads."""

    __slots__ = ("index", "is_sporadic", "kept_s", "measured_s", "number", "value")

    def __init__(self, index: int, *, is_sporadic: bool, kept_s: float) -> None:
        self.index = index
        self.is_sporadic = is_sporadic
        self.kept_s = kept_s
        self.number = 0
        self.measured_s = 0.0
        self.value: Any = NO_SAMPLE


class HostedPlant:
    """Implements `Plant` by a device host; nothing here waits for a device while the run goes on.

    `is_prompt` tells whether the host may run before ordinary processes (`SCHED_FIFO`).
    """

    def __init__(
        self,
        system: System,
        setup: Setup,
        *,
        decode: Mapping[str, Convert] | None = None,
        encode: Mapping[str, Convert] | None = None,
        optional: frozenset[str] = frozenset(),
    ) -> None:
        """Starts the host and waits for the first samples of all elements that are not `optional`.

        `decode` makes values of the declared types of the plain data that elements report, `encode`
        plain data of what they accept.

        Raises UsageError if the host cannot be started; PlantError, with the end of what the host
        said, if the devices are not open and have not measured in time.
        """
        self._decode, self._encode = dict(decode or {}), dict(encode or {})
        self._observed = {binding.name for binding in system.plant.observed} if system.plant else ()
        self._eager = {*self._observed}
        """Elements whose values are read at once, however large they are."""
        self._readings = _readings(system)
        for name in setup.besides:
            index = len(self._readings)
            self._readings[name] = _Reading(index, is_sporadic=True, kept_s=math.inf)
        self._silence_s = _silences(system)
        self._failures: dict[str, str] = {}
        self._named: set[str] = set()
        self._ended: PlantError | None = None
        self._end_request: tuple[str, float] | None = None
        self._is_leaving = self._is_told = False
        self._outputs = 0
        self._acknowledged: dict[int, str] = {}
        self._will: Callable[[], None] = lambda: None
        self._bequeathed: dict[str, dict[str, list[tuple[str, Any]]]] = {}
        until_s = time.monotonic() + setup.wait_s
        self._host = Host(setup.python, len(self._readings))
        try:
            wanted = {
                "devices": setup.devices,
                "path": list(setup.path),
                "config": dict(setup.config),
                "elements": list(self._readings),
                "silence": self._silence_s,
            }
            self.is_prompt = self._host.open(wanted, until_s)
            awaited = set(self._readings) - optional - set(self._observed)
            self._await_samples(awaited, until_s, setup.wait_s)
        except BaseException:
            self._host.close()
            raise

    def _await_samples(self, names: set[str], until_s: float, wait_s: float) -> None:
        memory = self._host.memory
        while missing := [n for n in names if not memory.number(self._readings[n].index)]:
            self._hear()
            self._refuse()
            for name in missing:
                if why := self._failure(name):
                    raise PlantError(f"{name}: {why}")
            if time.monotonic() > until_s:
                raise PlantError(f"no value within {wait_s:g} s: {', '.join(sorted(missing))}")
            self._host.wait(min(until_s, time.monotonic() + 0.002))

    def __getattr__(self, name: str) -> Any:
        """Says where the plant is, if somebody looks for what it has besides."""
        raise AttributeError(f"the plant, which has {name!r} or not, is in the device host")

    def reset(self, seed: int) -> None:
        """Nothing: the devices are as they are."""

    def sample(self, name: str) -> Any:
        """The newest `Sample` of an element; `NO_SAMPLE` if a sporadic one has no new one.

        A large value is `Deferred`: its bytes stay where the host has put them until it is asked.
        """
        reading = self._readings[name]
        if why := self._failure(name):
            raise PlantError(why)
        memory = self._host.memory
        if memory.number(reading.index) == reading.number or not self._read(name, reading):
            return self._again(reading)
        return Sample(reading.value, self._age_s(reading.measured_s))

    def _age_s(self, measured_s: float) -> float:
        """How long ago something was measured by the clock of the devices."""
        return time.monotonic() - measured_s

    def _read(self, name: str, reading: _Reading) -> bool:
        raw = self._host.memory.read(reading.index)
        if raw is None:
            return False
        self._heard(name, raw)
        decode = self._decode.get(name)

        def read() -> Any:
            return value_of(raw.extent.kind, bytes(raw.data), decode)

        is_left = (
            raw.extent.length > _LARGE
            and name not in self._eager
            and self._host.memory.pinned(reading.index) <= MOST_PINNED
        )
        reading.value = Deferred(read, reference=raw) if is_left else read()
        reading.number, reading.measured_s = raw.number, raw.measured_s
        return True

    def _heard(self, name: str, raw: Raw) -> None:
        """Take note of what an element has reported, before it is a value."""

    def _again(self, reading: _Reading) -> Any:
        """What an element has that has nothing new."""
        if reading.is_sporadic or reading.value is NO_SAMPLE:
            return NO_SAMPLE
        old_s = self._age_s(reading.measured_s)
        if old_s > reading.kept_s:
            raise PlantError(f"there has been no new value for {old_s:.3g} s")
        return Sample(reading.value, old_s)

    def actuate(self, name: str, value: Any) -> None:
        """Hand an output to the host; once the run ends, wait until the device has taken it.

        After it was told that the devices have got their safe outputs or that the host has ended,
        the run goes on to its end: what its last steps send is lost.
        """
        if self._is_told and not self._is_leaving:
            return
        self._refuse()
        self._host.memory.beat_s = time.monotonic()
        number = self._outputs = self._outputs + 1 if self._is_leaving else 0
        device, _, _ = name.rpartition(".")
        if not self._host.channel.send("send", device, name, self._ordered(name, value), number):
            raise PlantError("the device host does not take outputs any more")
        if number:
            self._await_taken(number)
        elif (why := self._failure(name)) and self._named.isdisjoint((name, "")):
            raise self._first_report(name, why)

    def _first_report(self, name: str, why: str) -> PlantError:
        """A failure, which the last steps of the run need not find again."""
        self._named.add(name)
        return PlantError(why)

    def _await_taken(self, number: int) -> None:
        until_s = time.monotonic() + WILL_S
        while number not in self._acknowledged:
            if not self._host.wait(until_s):
                raise PlantError(f"the device has not taken it within {WILL_S:g} s")
            self._hear()
            self._refuse()
        if why := self._acknowledged.pop(number):
            raise PlantError(why)

    def _ordered(self, name: str, value: Any) -> Any:
        """Plain data of an output of the run."""
        return self._encoded(name, value)

    def _encoded(self, name: str, value: Any) -> Any:
        """Plain data of a safe output, or of any other."""
        encode = self._encode.get(name)
        return plain_of(value) if encode is None else encode(value)

    def advance(self, duration_s: float) -> None:
        """Tell the host that the agent goes on. Raises what is wrong with it or with a device."""
        self._host.memory.beat_s = time.monotonic()
        self._hear()
        self._refuse()
        for name, why in self._failures.items():
            if name not in self._observed:
                error = self._first_report(name, why)
                raise DeviceFailed(name, error) if name else error
        if self._end_request and time.monotonic() > self._end_request[1]:
            raise PlantError(f"the device host was asked to end by {self._end_request[0]}")
        self._will()

    # The last will.

    def inherit(self, will: Callable[[], None]) -> None:
        """See `Guarded`."""
        self._will = will
        will()

    def bequeath(self, device: str, will: Mapping[str, Sequence[tuple[str, Any]]]) -> None:
        """What a device gets if the agent ends: of each element the first value that it takes."""
        encoded: dict[str, list[tuple[str, Any]]] = {name: [] for name in will}
        for name, choices in will.items():
            for by, value in choices:
                with suppress(Exception):  # the next one counts; the end of the run tells why
                    encoded[name].append((by, self._encoded(name, value)))
        if encoded != self._bequeathed.get(device):
            self._bequeathed[device] = encoded
            self._host.channel.send("will", device, encoded)

    def leave(self) -> None:
        """The run is over: safe outputs follow, each of which is waited for."""
        if not self._is_leaving:
            self._hear()
            self._is_leaving = True
            self._host.channel.send("leave")
            if self._ended is not None and not self._host.channel.is_over:
                self._ended = None

    def close(self) -> None:
        """Have the devices closed. Raises PlantError if one could not be."""
        channel = self._host.channel
        channel.send("end")
        until_s, closed = time.monotonic() + WILL_S + 2 * CLOSE_S, ""
        try:
            while not channel.is_over and self._host.wait(until_s):
                closed += "".join(data[0] for kind, *data in channel.received() if kind == "closed")
        except (NotPlain, TypeError, LookupError) as error:
            closed = garbled(error)
        finally:
            self._host.close()
        if closed:
            raise PlantError(closed)

    # What the host says.

    def _hear(self) -> None:
        channel = self._host.channel
        try:
            for kind, *data in channel.received():
                self._note(kind, data)
        except (NotPlain, TypeError, ValueError, LookupError, AttributeError) as error:
            self._ended = PlantError(garbled(error))
        channel.flush()
        if channel.is_over:
            self._ended = PlantError(f"the device host ended: {self._host.ending()}")

    def _note(self, kind: str, data: Sequence[Any]) -> None:
        if kind == "failed":
            self._failures.setdefault(data[0], data[1])
        elif kind == "taken":
            self._acknowledged[data[0]] = data[1]
        elif kind == "asked" and self._end_request is None:
            self._end_request = signal.Signals(data[0]).name, time.monotonic() + ASKED_S
        elif kind == "willed" and self._ended is None and not self._is_leaving:
            self._ended = PlantError(self._silent(*data))

    def _silent(self, device: str, silent_s: float, outcome: Outcome) -> str:
        missing = ", ".join(name for name, (by, _) in outcome.items() if not by)
        return (
            f"{device} got its safe outputs from the device host"
            + (f", but none for {missing}" if missing else "")
            + f": the run was silent for {silent_s:.3g} s, its `silence` is "
            f"{self._silence_s[device]:g} s"
        )

    def _failure(self, name: str) -> str:
        """Why an element has no value, or took none; empty if nothing is known."""
        return self._failures.get(name, "") or self._failures.get("", "")

    def _refuse(self) -> None:
        if self._ended is not None:
            self._is_told = True
            raise self._ended


def plain_of(value: Any) -> Any:
    """Plain data of a value: numbers of NumPy as those of Python, arrays as lists if not large."""
    if isinstance(value, np.ndarray):
        if value.nbytes <= _LARGE:
            return value.tolist()
        data = np.ascontiguousarray(value)
        return Array(data.dtype.str, data.shape, data.tobytes())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {key: plain_of(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain_of(item) for item in value]
    return value


def reading_periods(system: System) -> dict[str, float]:
    """How often, s, there should be a new sample of each element that somebody reads."""
    assert system.plant is not None
    periods: dict[str, float] = {}
    for item in system.plant.inputs:
        period_s = system.scheduled(item.subsystem).subsystem.period_s
        periods[item.sensor] = min(period_s, periods.get(item.sensor, period_s))
    if system.requirements or system.triggers:
        periods |= dict.fromkeys((b.name for b in system.plant.observed), system.tick_s)
    return {
        binding.name: 1.0 / binding.rate_hz if binding.rate_hz else periods[binding.name]
        for binding in (*system.plant.measured, *system.plant.observed)
        if binding.name in periods
    }


def _readings(system: System) -> dict[str, _Reading]:
    assert system.plant is not None
    sporadic = {binding.name for binding in system.plant.sensors if binding.sporadic}
    return {
        name: _Reading(
            index, is_sporadic=name in sporadic, kept_s=max(RENEWED_S, _PERIODS * every_s)
        )
        for index, (name, every_s) in enumerate(reading_periods(system).items())
    }


def _silences(system: System) -> dict[str, float]:
    """The longest silence that each device bears which is commanded, s."""
    assert system.plant is not None
    found: dict[str, float] = {}
    for output in system.plant.outputs:
        period_s = system.scheduled(output.subsystem).subsystem.period_s
        device = output.actuator.rpartition(".")[0]
        found[device] = max(found.get(device, SILENCE_S), _PERIODS * period_s)
    for safe in system.plant.safe:
        if safe.silence_s:
            found[safe.name] = safe.silence_s
        found.setdefault(safe.name, SILENCE_S)
    return found
