"""A plant in Python as the devices of a host, in this process."""

from __future__ import annotations

import pickle
import sys
import threading
import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from specc_runtime.hosting.devices import Array, DeviceError, Measured, words
from specc_runtime.hosting.python_plant import PythonPlant
from specc_runtime.plant import NO_SAMPLE, Deferred, Sample
from specc_runtime.plants.errors import PlantError

from tests.hosting.rig import until


class Own:
    """A plant whose methods do what a test says."""

    calls: dict[str, Callable[..., Any]]

    def __init__(self) -> None:
        self.seen: list[tuple[Any, ...]] = []

    def reset(self, seed: int) -> None:
        self.note("reset", seed)

    def sample(self, name: str) -> Any:
        return self.calls.get("sample", lambda name: 1.0)(name)

    def actuate(self, name: str, value: Any) -> None:
        self.note("actuate", name, value)

    def advance(self, duration_s: float) -> None:
        self.calls.get("advance", lambda duration_s: None)(duration_s)

    def close(self) -> None:
        self.note("close")

    def note(self, name: str, *arguments: Any) -> None:
        self.seen.append((name, *arguments))
        self.calls.get(name, lambda *_: None)(*arguments)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[PythonPlant, Own]]:
    module = ModuleType("robot_of_its_own")
    monkeypatch.setitem(sys.modules, module.__name__, module)

    def make(periods: dict[str, float] | None = None, **calls: Any) -> tuple[PythonPlant, Own]:
        own = type("Robot", (Own,), {"calls": calls})()
        monkeypatch.setattr(module, "made", lambda: own, raising=False)
        devices = PythonPlant()
        devices.open(
            {
                "python": f"{module.__name__}:made",
                "path": list(sys.path),
                "seed": 5,
                "tick_s": 0.001,
                "periods": {"a.E.d.q": 0.001} if periods is None else periods,
            }
        )
        return devices, own

    return make


def first(devices: PythonPlant) -> Measured:
    found: list[Measured] = []
    assert until(lambda: found.extend(devices.poll(0.01)) or found)
    return found[0]


def test_elements_are_sampled_at_their_periods(opened: Any) -> None:
    devices, own = opened({"fast": 0.001, "slow": 1000.0}, sample=lambda name: name * 2)
    found: list[Measured] = []
    assert until(lambda: found.extend(devices.poll(0.01)) or len(found) > 5)
    names = [name for name, _, _ in found]
    assert names.count("slow") == 1 and set(names) == {"fast", "slow"}
    assert {pickle.loads(value) for _, value, _ in found} == {"fastfast", "slowslow"}
    times = [at_s for name, _, at_s in found if name == "fast"]
    assert times == sorted(times) and own.seen == [("reset", 5)]


def test_time_passes_in_whole_ticks(opened: Any) -> None:
    passed: list[float] = []
    devices, _ = opened(advance=passed.append)
    assert until(lambda: devices.poll(0.01) is None or len(passed) > 3)
    assert all(round(s / 0.001) >= 1 and abs(s - 0.001 * round(s / 0.001)) < 1e-9 for s in passed)


@pytest.mark.parametrize(
    ("given", "value", "age_s"),
    [
        (Sample(2.5, 12.0), 2.5, 12.0),
        (Sample(2.5, -3.0), 2.5, 0.0),
        (np.float64(3.0), 3.0, 0.0),
        ({"a": [1]}, {"a": [1]}, 0.0),
    ],
)
def test_values_arrive_with_their_time(opened: Any, given: Any, value: Any, age_s: float) -> None:
    devices, _ = opened(sample=lambda name: given)
    begin_s = time.monotonic()
    name, data, measured_s = first(devices)
    assert (name, pickle.loads(data)) == ("a.E.d.q", value)
    assert begin_s <= measured_s + age_s <= time.monotonic()


def test_an_age_that_is_none_is_the_fault_of_its_element(opened: Any) -> None:
    devices, _ = opened(sample=lambda name: Sample(2.5, float("nan")))
    name, error, _ = first(devices)
    assert name == "a.E.d.q" and "which is no time in s" in words(error)


def test_images_stay_as_they_are(opened: Any) -> None:
    image = np.arange(120 * 160 * 3, dtype=np.uint8).reshape(120, 160, 3)[:, ::-1]
    devices, _ = opened(sample=lambda name: Deferred(lambda: image))
    _, array, _ = first(devices)
    assert type(array) is Array
    assert (np.frombuffer(array.data, array.dtype).reshape(array.shape) == image).all()


def test_nothing_new_is_no_sample(opened: Any) -> None:
    devices, _ = opened(sample=lambda name: NO_SAMPLE)
    assert devices.poll(0.01) == []


def failing(error: BaseException) -> Callable[..., Any]:
    def fail(*_: Any) -> Any:
        raise error

    return fail


@pytest.mark.parametrize("where", ["sample", "deferred"])
def test_what_a_sample_raises_is_of_its_element(opened: Any, where: str) -> None:
    fail = failing(PlantError("the cable is loose"))
    devices, _ = opened(sample=fail if where == "sample" else lambda name: Deferred(fail))
    name, error, _ = first(devices)
    assert name == "a.E.d.q" and isinstance(error, DeviceError)
    assert words(error) == "the cable is loose"


@pytest.mark.parametrize("where", ["advance", "actuate", "close", "reset"])
def test_what_others_raise_is_told_by_its_words(opened: Any, where: str) -> None:
    def use() -> None:
        devices, _ = opened(**{where: failing(PlantError("no power"))})
        devices.send("a.E.d.u", pickle.dumps(1.0))
        until(lambda: devices.poll(0.01) is None, 0.05)
        devices.close()

    with pytest.raises(DeviceError, match="no power"):
        use()


def test_a_plant_that_does_not_exist_is_told() -> None:
    config = {"python": "no.such:Plant", "path": list(sys.path), "tick_s": 1.0, "periods": {}}
    devices = PythonPlant()
    with pytest.raises(DeviceError, match=r"cannot load the plant 'no\.such:Plant'"):
        devices.open(config)
    devices.close()


def test_the_last_will_does_not_wait_for_what_hangs(opened: Any) -> None:
    hangs, goes_on = threading.Event(), threading.Event()

    def hang(name: str) -> float:
        hangs.set()
        goes_on.wait()
        return 1.0

    devices, own = opened(sample=hang)
    polling = threading.Thread(target=devices.poll, args=(0.01,), daemon=True)
    polling.start()
    assert hangs.wait(20.0)
    devices.send_last("a.E.d.u", pickle.dumps(0.0))
    assert own.seen[-1] == ("actuate", "a.E.d.u", 0.0)
    goes_on.set()
    polling.join()
    devices.send("a.E.d.u", pickle.dumps(1.0))
    assert own.seen[-1] == ("actuate", "a.E.d.u", 1.0)
