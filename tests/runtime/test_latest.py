"""The newest value of a device that blocks."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from typing import Any

import pytest
from specc_runtime.plant import NO_SAMPLE, Latest
from specc_runtime.plants.errors import PlantError

LONG_S = 30.0


class Device:
    """Gives what is put into it; raises an exception that is put into it."""

    def __init__(self) -> None:
        self.values: queue.Queue[Any] = queue.Queue()

    def read(self) -> Any:
        value = self.values.get()
        if isinstance(value, BaseException):
            raise value
        return value


@pytest.fixture
def device() -> Device:
    return Device()


@pytest.fixture
def latest(device: Device) -> Iterator[Latest]:
    latest = Latest(device.read)
    yield latest
    device.values.put(None)
    latest.close()


def test_a_value_is_taken_once(device: Device, latest: Latest) -> None:
    assert latest.take() is NO_SAMPLE
    device.values.put(None)  # a value like any other
    latest.wait(LONG_S)
    assert latest.take() is None
    assert latest.take() is NO_SAMPLE


def test_of_several_values_the_newest_is_taken(device: Device, latest: Latest) -> None:
    for value in range(5):
        device.values.put(value)
    seen: list[int] = []
    while not seen or seen[-1] != 4:
        latest.wait(LONG_S)
        seen.append(latest.take())
    assert seen == sorted(set(seen))


def test_what_the_device_raises_is_raised_whenever_it_is_asked(
    device: Device, latest: Latest
) -> None:
    device.values.put(OSError("unplugged"))
    latest.wait(LONG_S)
    for _ in range(2):
        with pytest.raises(OSError, match="unplugged"):
            latest.take()


def test_a_device_that_is_silent_is_not_waited_for_without_end(latest: Latest) -> None:
    with pytest.raises(PlantError, match=r"no value came within 0.01 s"):
        latest.wait(0.01)
