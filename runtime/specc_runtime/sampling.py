"""Sensors of the plant and what their readers see of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from specc_runtime.buffers import Put
from specc_runtime.distortion import Distortion
from specc_runtime.faults import DeviceFailed, Fault, device_at_fault
from specc_runtime.plant import LOST, NO_SAMPLE, Deferred, Sample
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.records import Observer, StepRecord
from specc_runtime.wrong import Unfit, WrongValue

PLANT = "plant"
"""Stands for the subsystem in records of what is really so."""
_ROUNDING = 1.0 + 1e-9  # times are multiples of a rounded tick


class Sensor:
    """The latest sample of a sensor, read-only, when it was measured, and how many there have been.

    A `Deferred` one stays so; it is checked when its value is computed. A sensor that is made
    `silent` has no samples, but for the one at the start. Samples have the `distortion` of now, if
    there is one.

    The value that its binding gives `on_loss` is a sample as well: one, until the device is back.
    That there is no other is seen at each time stamp: so it stays as new as that.
    """

    __slots__ = (
        *("_binding", "_now_s", "_sample", "_taken_s", "count", "distortion", "is_lost"),
        *("measured_s", "name", "silent", "value"),
    )

    def __init__(
        self,
        binding: SensorBinding,
        sample: Callable[[str], Any],
        now_s: Callable[[], float] | None = None,
    ) -> None:
        """`now_s` gives the time of the run, which in real time is that of the clock."""
        self.name = binding.name
        self.count = 0
        self.value: Any = NO_SAMPLE
        self.silent = False
        self.distortion: Distortion | None = None
        self._binding = binding
        self._sample = sample
        self._now_s = now_s
        self._taken_s = 0.0
        self.measured_s = 0.0
        self.is_lost = False
        """Whether the value is that of `on_loss`, since the device has none."""

    @property
    def is_renewed(self) -> bool:
        """Whether there is a new sample whenever one is due, as far as is known."""
        return not (self.silent or self._binding.sporadic)

    def saved(self, encode: Callable[[str, Any], Any], *, whole: bool) -> dict[str, Any]:
        """What it remembers; `encode` makes plain data of a value.

        A sample is left out that a new one follows, unless the `whole` is asked for.
        """
        own: dict[str, Any] = {"count": self.count, "taken_s": self._taken_s}
        if self.measured_s != self._taken_s:
            own["measured_s"] = self.measured_s
        if self.is_lost:
            own["is_lost"] = True
        if (self.is_renewed and not whole) or self.value is NO_SAMPLE:
            return own
        return own | {"value": encode(self.name, self.value)}

    def restore(self, saved: Any, sample: Any = NO_SAMPLE) -> None:
        """Remember that; raises KeyError, TypeError, ValueError for other data.

        Without a `sample` there has to be one as at the start, unless a new one follows anyway.
        """
        self.count, self._taken_s = int(saved["count"]), float(saved["taken_s"])
        self.measured_s = float(saved.get("measured_s", self._taken_s))
        self.is_lost = bool(saved.get("is_lost"))
        self.value = sample
        if sample is NO_SAMPLE and not self.is_renewed:
            self.count = 0

    def update(self, time_s: float) -> None:
        """Take a sample, if there is one; raises `DeviceFailed`.

        An initial value is the one at the start, whatever the device has by then: that is new
        afterwards.
        """
        initial = () if self.count else self._binding.initial
        value = initial[0] if initial else self._given(self._sample, self.name)
        measured_s = time_s
        if type(value) is Sample:
            measured_s = self._measured_s(value, time_s)
            value = value.value
        if value is NO_SAMPLE or value is LOST or (self.silent and self.count):
            self._go_without(time_s, is_told=value is LOST)
            return
        self.is_lost = False
        if type(value) is Deferred:
            reference = value.reference if self.distortion is None else None
            compute = partial(self.computed, value, self.distortion)
            self.value = Deferred(compute, value.begin, reference)
        else:
            self.value = self._accepted(value, self.distortion)
        self.count += 1
        self._taken_s = time_s
        self.measured_s = measured_s

    def _go_without(self, time_s: float, *, is_told: bool) -> None:
        """There is no sample: a loss, which the plant may have told of, or the last one will do.

        Raises `DeviceFailed` for a loss that the binding does not answer.
        """
        why = "" if self.is_lost else self._refusal(time_s, is_told=is_told)
        if why and not (self.count and self._binding.on_loss):
            raise DeviceFailed(self.name, PlantError(why))
        if why:
            self.is_lost = True
            self.value = self._accepted(self._binding.on_loss[0], None)
            self.count += 1
            self._taken_s = time_s
        if self.is_lost:
            self.measured_s = time_s

    def _measured_s(self, sample: Sample, time_s: float) -> float:
        """When a sample was measured: not after this tick; before the run, it is negative."""
        now_s = time_s if self._now_s is None else self._now_s()
        try:
            return min(sample.measured_s(now_s), time_s)
        except PlantError as error:
            raise DeviceFailed(self.name, error) from None

    def computed(self, sample: Deferred, distortion: Distortion | None = None) -> Any:
        """The value of a sample, accepted; raises `DeviceFailed`."""
        return self._accepted(self._given(sample.value), distortion)

    def _given(self, call: Callable[..., Any], *arguments: str) -> Any:
        try:
            return call(*arguments)
        except (Fault, KeyboardInterrupt):
            raise
        except BaseException as error:  # whatever the device raises
            raise DeviceFailed(self.name, error) from error

    def _accepted(self, value: Any, distortion: Distortion | None) -> Any:
        binding = self._binding
        measured = value if distortion is None else distortion.value(value)
        try:
            return binding.contract(measured)
        except Unfit as unfit:
            origin = device_at_fault(self.name, binding.through)
            wrong = WrongValue(origin, binding.declared, unfit)
            raise DeviceFailed(self.name, wrong, through=binding.through) from None

    def _refusal(self, time_s: float, *, is_told: bool) -> str:
        """Why there has to be a sample now; empty if the last one will do."""
        binding = self._binding
        if not binding.sporadic:
            return "there is no new sample, and it is not bound as `sporadic`"
        if not self.count:
            return "there is no sample at the start, where even a sporadic device must have one"
        if is_told:
            return "the device is lost"
        gap_s = time_s - self._taken_s
        if binding.max_gap_s is not None and gap_s > binding.max_gap_s * _ROUNDING:
            return f"there has been no sample for {gap_s:g} s, `max_gap` is {binding.max_gap_s:g} s"
        return ""


class Onlooker:
    """What is really so in the plant at every base tick, for all but agents."""

    def __init__(
        self,
        bindings: Iterable[SensorBinding],
        sample: Callable[[str], Any],
        observers: Iterable[Observer],
    ) -> None:
        """`observers` are called with a record of all values, as if the plant had sent them.

        `failed` has why something could not be observed, first.
        """
        self._sensors = tuple(Sensor(binding, sample) for binding in bindings)
        self._observers = tuple(observers)
        self.failed: dict[str, str] = {}

    def look(self, tick: int, time_s: float) -> None:
        """Sample. What fails is not known at this tick: looking must not change a run."""
        sent = []
        for sensor in self._sensors:
            try:
                sensor.update(time_s)
                sent.append((sensor.name, sensor.value))
            except DeviceFailed as fault:
                self.failed.setdefault(sensor.name, f"{fault.message}, at {time_s:g} s")
        record = StepRecord(PLANT, tick, time_s, "", -1, tuple(sent))
        for tell in self._observers:
            tell(record)


class Port:
    """A sensor as one of its readers sees it: a sample is fresh once."""

    __slots__ = ("_put", "_seen", "_sensor")

    def __init__(self, sensor: Sensor, put: Put) -> None:
        self._sensor = sensor
        self._put = put
        self._seen = 0

    def restore(self, had: bool) -> None:
        """The reader has `had` the latest sample, or is still to get it if it is there."""
        self._seen = self._sensor.count if had or self._sensor.value is NO_SAMPLE else -1

    def has_had(self, sensor: str) -> bool:
        """Whether it is a port of that sensor whose reader has had the latest sample."""
        return self._sensor.name == sensor and self._seen == self._sensor.count

    @property
    def sensor(self) -> str:
        """Its name."""
        return self._sensor.name

    def deliver(self) -> None:
        """Give the reader the latest sample, unless it has had it."""
        sensor = self._sensor
        if sensor.count != self._seen:
            self._seen = sensor.count
            self._put(sensor.value)


def compute_deferred(buffer: object, elements: tuple[str, ...]) -> None:
    """Put values in the place of deferred samples in a buffer; raises `DeviceFailed`."""
    deferred = [e for e in elements if type(getattr(buffer, e, None)) is Deferred]
    for element in deferred:
        getattr(buffer, element).begin()
    for element in deferred:
        setattr(buffer, element, getattr(buffer, element).value())
