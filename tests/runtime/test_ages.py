"""How old inputs are in runs: samples with their time, late senders, and what is too old."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from specc_runtime import NO_SAMPLE, Executor, Sample
from specc_runtime.faults import Fault
from specc_runtime.plant import Deferred
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.sampling import Sensor
from specc_runtime.system import System

from specc.pipeline import compile_spec
from tests.runtime.driven import Driven, DrivenClock
from tests.soundness.running import built

SPEC = """\
specc: 1.2
system: watched
agents:
  arm:
    real_receptors: {cam: {y: {d: "real[m]"}}}
    real_effectors: {drive: {x: {v: DRIVEN}}}
    virtual_receptors:
      cam:
        rate: 20 Hz
        x: {R: {d: "real[m]"}}
        y: {c: {d: "real[m]"}}
        functions: {look: {y.c.d: x.R.d}}
        behaviours: {look: {functions: [look], terminal: never}}
        states: {S0: look}
        initial_state: S0
    virtual_effectors:
      drive:
        rate: 100 Hz
        x: {c: {d: {type: "real[m]", init: 0}}}
        y: {E: {v: "real[m]"}}
        functions: {go: {y.E.v: x.c.d}}
        behaviours: {go: {functions: [go], terminal: never}}
        states: {S0: go}
        initial_state: S0
    control:
      rate: 100 Hz
      x: {cam: {d: {type: "real[m]", init: 0LIMIT}}}
      y: {drive: {d: "real[m]"}}
      memory: {age: {type: "real[s]", init: 0}, late: {type: int, init: 0}}
      conditions: {terminal: {is_old: "age(x.cam.d) >= 90[ms] and late(x.cam.d) == 0"}}
      functions: {ask: {age: age(x.cam.d), late: late(x.cam.d), y.drive.d: READ}}
      behaviours: {ask: {functions: [ask], terminal: is_old}}
      states: {S0: ask}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
plant:
  python: tests.runtime.test_ages:Cam
  bind: {arm.R.cam.d: {sporadic: true}, arm.E.drive.v: {}}
task:
  cycle: {of: arm.c, from: S0, to: S0}
"""


class Cam:
    """Measures what `take` gives for a number of samples taken before, and for the time in s."""

    def __init__(self, take: Callable[[int, float], Any] = lambda n, now_s: now_s) -> None:
        self.take, self.time_s, self.count = take, 0.0, 0
        self.commands: list[float] = []

    def sample(self, name: str) -> Any:
        self.count += 1
        return self.take(self.count - 1, self.time_s)

    def actuate(self, name: str, value: Any) -> None:
        self.commands.append(value)

    def advance(self, duration_s: float) -> None:
        self.time_s = round(self.time_s + duration_s, 9)

    def reset(self, seed: int) -> None: ...

    def close(self) -> None: ...


class Still(Cam):
    """Has one sample."""

    def __init__(self) -> None:
        super().__init__(lambda n, now_s: NO_SAMPLE if n else 1.0)


def text_of(limit: str = "", driven: str = '"real[m]"', read: str = "x.cam.d") -> str:
    """The specification, with what is allowed, and how the control subsystem reads the camera."""
    limited = SPEC.replace("LIMIT", limit and f", max_age: {limit}")
    return limited.replace("DRIVEN", driven).replace("READ", read)


@contextmanager
def system(folder: Path, **parts: str) -> Iterator[System]:
    path = folder / "watched.yaml"
    path.write_text(text_of(**parts))
    result = compile_spec(str(path))
    assert result.ok, result.diagnostics
    assert result.system is not None
    with built(result.system, None, result.proofs.ages) as made:
        yield made


def ages(made: System, plant: Cam, ticks: int = 16) -> tuple[list[float], list[Fault]]:
    """The ages that the control subsystem has asked for, by its periods, and the faults."""
    memory, found = made.scheduled("arm.c").subsystem.memory, []
    with Executor(made, plant, [], inline=True) as executor:
        while executor.tick < ticks and executor.advance():
            found.append(memory.age)
    return found, executor.faults


def test_what_was_sent_gets_older_until_the_next_value_comes(tmp_path: Path) -> None:
    with system(tmp_path) as made:
        found, faults = ages(made, Cam())
    before, sent = [0.0, 0.01, 0.02, 0.03, 0.04], [0.05, 0.06, 0.07, 0.08, 0.09]
    assert found == [*before, *sent, *sent, 0.05]
    assert not faults


def test_a_sample_says_when_it_was_measured(tmp_path: Path) -> None:
    with system(tmp_path) as made:
        found, _ = ages(made, Cam(lambda n, now_s: Sample(1.0, 0.03)))
    assert found[5] == found[10] == pytest.approx(0.08)  # the first one is from before the run
    with system(tmp_path) as made:
        found, _ = ages(made, Cam(lambda n, now_s: Sample(Deferred(lambda: 1.0), -9.0)))
    assert found[5:7] == [0.05, 0.06]  # nor later than it was sampled


@pytest.mark.parametrize(
    ("age_s", "measured_s"), [(0.25, 1.25), (0.75, 0.75), (0.0, 1.25), (9.0, -7.5)]
)
def test_an_age_counts_from_now_and_not_from_the_tick(age_s: float, measured_s: float) -> None:
    """In real time a sample is taken some time after its tick, here of 1.25 s."""
    sensor = Sensor(SensorBinding("d"), lambda name: Sample(1.0, age_s), lambda: 1.5)
    sensor.update(1.25)
    assert sensor.measured_s == measured_s


def test_what_was_measured_before_the_run_is_as_old_as_it_is(tmp_path: Path) -> None:
    with system(tmp_path, limit="120 ms") as made:
        _, (fault,) = ages(made, Cam(lambda n, now_s: Sample(1.0, 50.0)))
    assert "is 50.05 s old, measured by arm.R.cam.d; `max_age` is 0.12 s" in fault.message


@pytest.mark.parametrize("age", [float("nan"), float("inf"), 10**400, "soon", None])
def test_a_sample_of_no_age_is_the_devices_fault(age: Any, tmp_path: Path) -> None:
    with system(tmp_path) as made:
        _, (fault,) = ages(made, Cam(lambda n, now_s: Sample(1.0, age)))
    assert fault.as_data()["culprit"] == "device arm.R.cam.d"
    assert "which is no time in s" in fault.message


def test_what_is_held_for_too_long_is_a_fault(tmp_path: Path) -> None:
    """Nothing limits the age of what a device measures that may have nothing new (W0416)."""
    plant = Still()
    with system(tmp_path, limit="120 ms") as made:
        found, (fault,) = ages(made, plant, 40)
    assert found[-1] == 0.13
    told = fault.as_data()
    assert (told["fault"], told["subsystem"], told["culprit"]) == (
        "TooOld", "arm.c", "subsystem arm.cam",
    )  # fmt: skip
    assert told["message"] == (
        "input x.cam.d is 0.13 s old, measured by arm.R.cam.d; `max_age` is 0.12 s"
    )
    assert told["time_s"] == pytest.approx(0.13)


def test_what_is_read_on_arrival_alone_may_get_older_later(tmp_path: Path) -> None:
    with system(tmp_path, limit="60 ms", read="x.cam.d if fresh(x.cam.d) else 0") as made:
        found, faults = ages(made, Cam(), 40)
    assert max(found) == 0.09
    assert not faults


def test_a_command_that_is_too_old_is_not_given(tmp_path: Path) -> None:
    plant = Still()
    with system(tmp_path, driven='{type: "real[m]", max_age: 160 ms}') as made:
        _, (fault,) = ages(made, plant, 40)
    assert fault.message.startswith("command arm.E.drive.v is 0.17 s old, measured by arm.R.cam.d")
    assert fault.device == "arm.E.drive.v"
    assert len(plant.commands) == 16


CART = Path(__file__).parents[1] / "cases/structure/W0416-command-that-is-not-renewed.yaml"
BOUND = """\
plant:
  python: tests.runtime.test_ages:Cam
  bind: {cart.E.motor.v_d: {}, cart.E.motor.s: {}}
"""


def test_a_command_of_a_constant_is_as_old_as_its_computation(tmp_path: Path) -> None:
    """The effector sends it on in every period; its sender is silent from 3.1 s on."""
    path = tmp_path / "cart.yaml"
    path.write_text(f"{CART.read_text()}{BOUND}")
    result = compile_spec(str(path))
    assert result.ok
    assert result.system is not None
    plant = Cam(lambda n, now_s: 0.0)
    with (
        built(result.system, None, result.proofs.ages) as made,
        Executor(made, plant, [], inline=True) as executor,
    ):
        while executor.tick * made.tick_s < 5 and executor.advance():
            pass
    (fault,) = executor.faults
    assert fault.message == (
        "command cart.E.motor.v_d is 0.32 s old, counted from its computation; `max_age` is 0.3 s"
    )
    assert fault.as_data()["time_s"] == pytest.approx(3.3)
    assert {*plant.commands} == {0.0, 0.5}


def test_a_late_sender_is_told_and_its_value_gets_older(tmp_path: Path) -> None:
    clock, plant = DrivenClock(), Cam()
    stalls = iter([0.0, 0.0, 0.16, 0.0, 0.0, 0.0])
    told: list[tuple[float, int]] = []
    with system(tmp_path) as made:
        memory = made.scheduled("arm.c").subsystem.memory
        elsewhere = {"arm.cam": lambda: next(stalls)}
        driven = Driven(made, clock, elsewhere=elsewhere, plant=plant)
        driven.until(32, lambda: told.append((memory.age, memory.late)))
    assert [told[tick] for tick in (10, 14, 15, 20, 29)] == [
        (0.05, 0), (0.09, 0), (0.1, 1), (0.15, 2), (0.24, 3),
    ]  # fmt: skip
    assert told[30:] == [(0.2, 0), (0.21, 0)]  # its step of 0.1 s was done at 0.26 s


def test_who_was_told_of_as_late_begins_no_step_in_that_tick(tmp_path: Path) -> None:
    clock, told = DrivenClock(), []
    costs = {5: 0.026, 10: 0.002}  # so that the camera has its steps at 0.076 s and 0.102 s
    with system(tmp_path) as made:
        reader = made.scheduled("arm.c").subsystem
        step = reader.step

        def slow() -> int:
            outcome = step()
            clock.busy(costs.get(driven.executor.tick, 0.0))
            return outcome

        reader.step = slow
        driven = Driven(made, clock, plant=Cam())
        driven.until(17, lambda: told.append((driven.executor.tick - 1, reader.memory.late)))
    begun = [record.stamp for record in driven.of("arm.cam")]
    assert (10, 1) in told
    assert 2 not in begun
    assert 3 in begun or driven.executor._tracks["arm.cam"].stamp == 3


def test_a_late_value_is_too_old_where_its_age_is_limited(tmp_path: Path) -> None:
    read = "x.cam.d if fresh(x.cam.d) else 0"
    with system(tmp_path, limit="60 ms", read=read) as made:
        driven = Driven(made, DrivenClock(), elsewhere={"arm.cam": lambda: 0.07}, plant=Cam())
        driven.until(60)
    (fault,) = driven.executor.faults
    assert fault.message.startswith("input x.cam.d is 0.1 s old, measured by arm.R.cam.d")
