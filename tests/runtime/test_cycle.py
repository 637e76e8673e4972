"""Laws of the work cycle: logical execution time, freshness, rates, order, worker threads."""

from __future__ import annotations

import hashlib
import math
import random
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.contracts import as_int
from specc_runtime.plant import NO_SAMPLE, Deferred
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.records import StepRecord
from specc_runtime.sampling import compute_deferred
from specc_runtime.system import PlantInput, PlantOutput, PlantSpec, Task

from tests.runtime.tiny import TICK_S, Node, Run, buffer, system
from tests.seeds import how_many, short

RATES = st.integers(1, 12)


@given(writer=RATES, reader=RATES)
@settings(deadline=None, max_examples=how_many(60))
def test_value_of_stamp_i_is_visible_from_stamp_i_plus_1(writer: int, reader: int) -> None:
    """A reader at tick t sees the last write whose next stamp, (i + 1) periods, is not after t."""
    w, r = Node("w", writer), Node("r", reader, ("w",))
    Run(system(w, r), 100)
    for step, look in r.seen:
        newest = step * reader // writer - 1
        value, fresh = look["w"]
        assert value == (newest if newest >= 0 else None)
        previous = (step - 1) * reader // writer - 1 if step else -1
        assert fresh == (newest > previous)


@given(rates=st.lists(RATES, min_size=2, max_size=4))
@settings(deadline=None, max_examples=how_many(40))
def test_each_value_is_fresh_at_most_once_for_each_reader(rates: list[int]) -> None:
    names = [f"n{i}" for i in range(len(rates))]
    nodes = [Node(n, k, [m for m in names if m != n]) for n, k in zip(names, rates, strict=True)]
    Run(system(*nodes), 60)
    for node in nodes:
        for source in node.sources:
            fresh = [look[source][0] for _, look in node.seen if look[source][1]]
            assert len(fresh) == len(set(fresh))
            seen = [look[source][0] for _, look in node.seen if look[source][0] is not None]
            assert set(fresh) == set(seen)


@given(rates=st.lists(RATES, min_size=1, max_size=5), ticks=st.integers(0, 150))
@settings(deadline=None, max_examples=how_many(60))
def test_step_counts_follow_the_rates(rates: list[int], ticks: int) -> None:
    nodes = [Node(f"n{i}", k) for i, k in enumerate(rates)]
    run = Run(system(*nodes), ticks)
    for node in nodes:
        records = run.of(node.name)
        assert len(records) == math.ceil(ticks / node.ticks)
        assert [r.stamp for r in records] == list(range(len(records)))
        assert [r.time_s for r in records] == [i * node.ticks * TICK_S for i in range(len(records))]


def _mixing(rates: list[int], seed: int, *, sleepy: bool = False) -> list[Node]:
    """Nodes that all read each other and mix what they read with what they remember."""
    rng = random.Random(seed)
    names = [f"n{i}" for i in range(len(rates))]

    def compute(node: Node) -> np.ndarray:
        if sleepy and node.ticks > 20:
            time.sleep(rng.random() * 0.004)
        text = repr([(s, node.value(s)) for s in node.sources] + [node.steps, node.name])
        return np.frombuffer(hashlib.sha256(text.encode()).digest(), dtype=np.uint8)

    return [Node(n, k, names, compute) for n, k in zip(names, rates, strict=True)]


@given(rates=st.lists(RATES, min_size=2, max_size=5), data=st.data())
@settings(deadline=None, max_examples=how_many(15))
def test_order_of_subsystems_cannot_be_seen(rates: list[int], data: st.DataObject) -> None:
    nodes = data.draw(st.permutations(_mixing(rates, 0)))
    plain, permuted = Run(system(*_mixing(rates, 0)), 40), Run(system(*nodes), 40)
    assert plain.records
    assert plain.sha256 == permuted.sha256


@pytest.mark.parametrize("seed", short(range(4), 0))
def test_worker_threads_cannot_be_seen(seed: int) -> None:
    rates = [1, 3, 25, 40, 50]
    inline = Run(system(*_mixing(rates, seed)), 400, inline=True)
    worker = Run(system(*_mixing(rates, seed, sleepy=True)), 400, inline=False)
    assert len(inline.records) > 500
    assert inline.sha256 == worker.sha256


def test_slow_subsystem_really_leaves_the_thread() -> None:
    import threading

    threads: set[tuple[str, bool]] = set()

    def compute(node: Node) -> int:
        threads.add((node.name, threading.current_thread() is threading.main_thread()))
        return 0

    nodes = [Node("fast", 1, (), compute), Node("slow", 25, (), compute)]
    Run(system(*nodes), 30, inline=False)
    assert threads == {("fast", True), ("slow", False)}


def test_worker_sees_the_inputs_of_its_stamp() -> None:
    """Values that arrive while a slow step computes belong to its next stamp."""

    def late(node: Node) -> object:
        time.sleep(0.01)
        return node.value("fast")

    nodes = [Node("fast"), Node("slow", 25, ("fast",), late)]
    run = Run(system(*nodes), 101, inline=False)
    assert [dict(r.sent)["value"] for r in run.of("slow")] == [None, 24, 49, 74, 99]


def test_arrays_are_read_only_once_they_crossed_a_buffer() -> None:
    kept = np.zeros(3)

    def tamper(node: Node) -> int:
        value = node.value("w")
        if value is not None:
            value[0][0] = 1.0
        return 0

    run = Run(system(Node("w", 1, (), lambda _: (kept,)), Node("r", 1, ("w",), tamper)), 5)
    assert not kept.flags.writeable
    assert "read-only" in run.executor.faults[0].message


class OneSensorPlant:
    """Time, and what was asked of it."""

    def __init__(self) -> None:
        self.ticks = 0
        self.log: list[tuple[str, object]] = []

    def reset(self, seed: int) -> None:
        self.ticks = 0

    def sample(self, name: str) -> Any:
        self.log.append((name, self.ticks))
        return self.ticks

    def actuate(self, name: str, value: object) -> None:
        self.log.append((name, value))

    def advance(self, duration_s: float) -> None:
        assert duration_s == TICK_S
        self.ticks += 1

    def close(self) -> None:
        pass


def _with_plant(node: Node, rate_hz: float | None) -> OneSensorPlant:
    plant = OneSensorPlant()
    _run(node, plant, SensorBinding("a.E.m", rate_hz=rate_hz))
    return plant


def _run(
    node: Node,
    plant: OneSensorPlant,
    binding: SensorBinding,
    ticks: int = 24,
    *,
    inline: bool = True,
) -> Run:
    node.x = type("X", (), {"__slots__": ("E_m", "fresh_E_m", "present_E_m")})()
    spec = PlantSpec(
        "",
        (binding,),
        (ActuatorBinding("a.E.c"),),
        (PlantInput("a.E.m", node.name, "E_m"),),
        (PlantOutput(node.name, "value", "a.E.c"),),
    )
    return Run(system(node, plant=spec), ticks, inline=inline, plant=plant)


class QuietPlant(OneSensorPlant):
    """Has new samples at some ticks only."""

    def __init__(self, *ticks: int) -> None:
        super().__init__()
        self.when = ticks

    def sample(self, name: str) -> Any:
        return self.ticks if self.ticks in self.when else NO_SAMPLE


def test_sensor_without_rate_is_fresh_at_every_stamp_and_commands_come_one_period_later() -> None:
    seen: list[tuple[int, bool]] = []

    def look(node: Node) -> int:
        seen.append((node.x.E_m, node.x.fresh_E_m))
        return node.x.E_m

    plant = _with_plant(Node("n", 4, (), look), None)
    assert seen == [(4 * i, True) for i in range(6)]
    assert plant.log[:5] == [
        ("a.E.m", 0), ("a.E.c", 0), ("a.E.m", 4), ("a.E.c", 4), ("a.E.m", 8),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("ticks", "sensor_ticks", "expected"),
    [
        (2, 6, [(0, True), (0, False), (0, False), (6, True), (6, False), (6, False)]),
        (6, 2, [(0, True), (6, True), (12, True), (18, True)]),
        (4, 6, [(0, True), (0, False), (6, True), (12, True), (12, False), (18, True)]),
    ],
)
def test_sensor_with_a_rate_is_fresh_when_a_sample_arrived(
    ticks: int, sensor_ticks: int, expected: list[tuple[int, bool]]
) -> None:
    seen: list[tuple[int, bool]] = []

    def look(node: Node) -> int:
        seen.append((node.x.E_m, node.x.fresh_E_m))
        return 0

    plant = _with_plant(Node("n", ticks, (), look), 1.0 / (sensor_ticks * TICK_S))
    assert seen[: len(expected)] == expected
    samples = [value for name, value in plant.log if name == "a.E.m"]
    assert samples == sorted({value for value, _ in seen})


def test_without_a_new_sample_the_value_of_a_sporadic_device_stays_and_is_not_fresh() -> None:
    seen: list[tuple[int, bool]] = []

    def look(node: Node) -> int:
        seen.append((node.x.E_m, node.x.fresh_E_m))
        return 0

    binding = SensorBinding("a.E.m", sporadic=True)
    run = _run(Node("n", 4, (), look), QuietPlant(0, 8, 9, 20), binding)
    assert run.executor.faults == []
    assert seen == [(0, True), (0, False), (8, True), (8, False), (8, False), (20, True)]


def test_an_initial_value_is_the_first_sample_and_the_device_has_those_after_it() -> None:
    seen: list[tuple[int, bool]] = []

    def look(node: Node) -> int:
        seen.append((node.x.E_m, node.x.fresh_E_m))
        return 0

    binding = SensorBinding("a.E.m", sporadic=True, initial=(-1,))
    run = _run(Node("n", 4, (), look), QuietPlant(8, 9, 20), binding)
    assert run.executor.faults == []
    assert seen == [(-1, True), (-1, False), (8, True), (8, False), (8, False), (20, True)]


def test_a_loss_is_one_sample_and_silence_counts_anew_from_the_return() -> None:
    seen: list[tuple[int, bool]] = []

    def look(node: Node) -> int:
        seen.append((node.x.E_m, node.x.fresh_E_m))
        return 0

    binding = SensorBinding("a.E.m", sporadic=True, max_gap_s=8 * TICK_S, on_loss=(-1,))
    run = _run(Node("n", 4, (), look), QuietPlant(0, 24, 28), binding, ticks=48)
    assert run.executor.faults == []
    assert seen[2:8] == [(0, False), (-1, True), *[(-1, False)] * 2, (24, True), (28, True)]
    assert seen[8:] == [*[(28, False)] * 2, (-1, True), (-1, False)]


@pytest.mark.parametrize(
    ("ticks", "options", "time_ticks", "words"),
    [
        ((4, 8), {"sporadic": True}, 0, "no sample at the start"),
        ((0, 8), {}, 4, "no new sample, and it is not bound as `sporadic`"),
        ((0, 8), {"sporadic": True, "max_gap_s": 8 * TICK_S}, 20, "no sample for 0.024 s"),
        ((20,), {"sporadic": True, "max_gap_s": 8 * TICK_S, "initial": (0,)}, 12, "no sample for"),
    ],
)
def test_a_sample_that_has_to_be_there_is_a_fault_of_the_device(
    ticks: tuple[int, ...], options: dict[str, Any], time_ticks: int, words: str
) -> None:
    node = Node("n", 4, (), lambda node: 0)
    run = _run(node, QuietPlant(*ticks), SensorBinding("a.E.m", **options))
    (fault,) = run.executor.faults
    assert fault.device == "a.E.m" and fault.culprit == "device a.E.m"
    assert words in fault.message
    assert fault.time_s == pytest.approx(time_ticks * TICK_S)


class Filming(OneSensorPlant):
    """Defers every sample; `computed` has those that somebody asked for."""

    def __init__(self, value: Callable[[int], object] = lambda taken: taken) -> None:
        super().__init__()
        self.computed: list[int] = []
        self._value = value

    def sample(self, name: str) -> Any:
        taken = self.ticks

        def compute() -> object:
            time.sleep(0.002)
            self.computed.append(taken)
            return self._value(taken)

        return Deferred(compute)


FILMING = SensorBinding("a.E.m", rate_hz=1.0 / (5 * TICK_S), contract=as_int, declared="int")


@pytest.mark.parametrize("inline", [True, False])
def test_a_deferred_sample_is_that_of_its_instant_and_computed_once_if_it_is_read(
    inline: bool,
) -> None:
    plant = Filming()
    run = _run(Node("n", 25, (), lambda node: node.x.E_m), plant, FILMING, 101, inline=inline)
    assert run.executor.faults == []
    assert [dict(r.sent)["value"] for r in run.of("n")] == [0, 25, 50, 75, 100]
    assert plant.computed == [0, 25, 50, 75, 100]


def test_samples_are_begun_together_and_what_fails_then_is_told_by_the_value() -> None:
    log: list[str] = []
    x = buffer("a", "b", "c")
    x.a = Deferred(lambda: log.append("value a"), lambda: log.append("begin a"))
    x.b = Deferred(lambda: log.append("value b"), lambda: log.append("begin b"))
    compute_deferred(x, ("a", "b", "c"))
    assert log == ["begin a", "begin b", "value a", "value b"]
    lost = Deferred(lambda: log.append("never"), lambda: log.remove("lens"))
    for _ in range(2):
        with pytest.raises(ValueError):
            lost.value()
    assert "never" not in log


def _broken(taken: int) -> object:
    if taken == 50:
        raise OSError("the shutter is stuck")
    return taken


@pytest.mark.parametrize("inline", [True, False])
@pytest.mark.parametrize(
    ("value", "words"),
    [
        (_broken, "shutter"),
        (lambda taken: "late" if taken == 50 else taken, "gave the text 'late'"),
    ],
)
def test_a_deferred_sample_that_fails_is_a_fault_of_the_device(
    value: Callable[[int], object], words: str, inline: bool
) -> None:
    run = _run(Node("n", 25, (), lambda node: 0), Filming(value), FILMING, 101, inline=inline)
    (fault,) = run.executor.faults
    assert fault.device == "a.E.m" and fault.culprit == "device a.E.m"
    assert words in fault.message
    assert (fault.subsystem, fault.stamp, fault.time_s) == ("n", 2, pytest.approx(50 * TICK_S))
    assert len(run.of("n")) == 2


def test_watched_memory_is_recorded_for_the_task_only() -> None:
    nodes = [Node("a"), Node("b")]
    run = Run(system(*nodes, task=Task("a", "x", "y", watch=("count",))), 3)
    assert [r.watched for r in run.of("a")] == [(("count", i),) for i in (0, 1, 2)]
    assert all(r.watched == () for r in run.of("b"))


def test_records_are_values() -> None:
    run = Run(system(Node("a")), 2)
    assert run.records == [
        StepRecord("a", 0, 0.0, "run", -1, (("value", 0),), (), TICK_S),
        StepRecord("a", 1, TICK_S, "run", 0, (("value", 1),), (), 2 * TICK_S),
    ]
    with pytest.raises(AttributeError):
        run.records[0].stamp = 5
