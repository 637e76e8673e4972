"""Real time: late results, skipped periods, and what stays as in simulated time."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random
from threading import Thread, current_thread
from types import SimpleNamespace
from typing import Any

import pytest
from specc_runtime.cycle import Executor
from specc_runtime.options import Options
from specc_runtime.plant import Deferred
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.processes.runner import ProcessRunner
from specc_runtime.system import PlantInput, PlantSpec, Scheduled, System
from specc_runtime.timing import Paced, Quantiles, RealTime, SimulatedTime, timing
from specc_runtime.track import InlineRunner

from tests.runtime.driven import Driven, DrivenClock
from tests.runtime.tiny import Node, Run, system
from tests.seeds import Seeds, blocks

TICK_S = 0.01


def node(
    name: str,
    ticks: int = 1,
    sources: tuple[str, ...] = (),
    compute: Callable[[Node], Any] | None = None,
) -> Node:
    return Node(name, ticks, sources, compute, tick_s=TICK_S)


def busy(clock: DrivenClock, at: int, for_s: float) -> Callable[[Node], int]:
    """A step that keeps the main thread for a while at a step number."""

    def compute(one: Node) -> int:
        if one.steps == at:
            clock.busy(for_s)
        return one.steps

    return compute


def test_where_nothing_is_late_the_records_are_those_of_simulated_time() -> None:
    def built() -> System:
        return system(node("a"), node("b", 3, ("a",)), node("c", 5, ("b", "a")), tick_s=TICK_S)

    driven = Driven(built(), DrivenClock()).until(60).finish()
    assert driven.records == Run(built(), 60).records
    assert driven.executor.first_skipped is None
    assert not any(driven.executor.skipped.values())


@pytest.mark.parametrize("pace", [1.0, None])
def test_the_second_step_begins_a_period_after_the_first(pace: float | None) -> None:
    clock, began_s = DrivenClock(), []
    built = system(node("a", compute=lambda one: began_s.append(clock.now_s())), tick_s=TICK_S)
    Driven(built, clock, timing=Paced(clock, pace) if pace else None).until(3).finish()
    assert began_s == pytest.approx([100.0 + stamp * TICK_S for stamp in range(3)])


def test_periods_that_are_over_are_skipped_and_not_made_up_for() -> None:
    clock = DrivenClock()
    built = system(node("a", compute=busy(clock, 5, 0.034)), tick_s=TICK_S)
    driven = Driven(built, clock).until(20).finish()
    assert [r.stamp for r in driven.of("a")] == [*range(6), *range(8, 20)]
    assert [r.time_s for r in driven.of("a")][6] == pytest.approx(0.08)
    assert driven.executor.skipped == {"a": 2}
    assert driven.executor.first_skipped == ("a", 6, pytest.approx(0.06))


def test_a_step_that_is_not_done_goes_on_and_nobody_waits() -> None:
    clock = DrivenClock()
    slow, fast = node("slow", 10), node("fast", 1, ("slow",))
    built = system(slow, fast, tick_s=TICK_S)
    driven = Driven(built, clock, elsewhere={"slow": lambda: 0.15}).until(60).finish()
    assert [r.stamp for r in driven.of("fast")] == list(range(60))
    # Of 150 ms in periods of 100 ms: seen at the second stamp after their begin.
    assert [r.stamp for r in driven.of("slow")] == [0, 1, 3, 5]
    assert [r.visible_s for r in driven.of("slow")][1:3] == pytest.approx([0.3, 0.5])
    seen = [step for step, values in fast.seen if values["slow"][1]]
    assert seen[1:] == [30, 50]


def test_a_stamp_in_a_gap_steps_at_once_unless_the_next_one_is_near() -> None:
    for stalled_s, expected in ((0.034, [0.0, 0.12, 0.2]), (0.084, [0.0, 0.2])):
        clock = DrivenClock()
        # The stall begins at 0.09 s, just before the stamp at 0.1 s.
        built = system(node("a", compute=busy(clock, 9, stalled_s)), node("b", 10), tick_s=TICK_S)
        driven = Driven(built, clock).until(25).finish()
        assert [r.time_s for r in driven.of("b")] == pytest.approx(expected)
        assert [r.stamp for r in driven.of("b")] == [int(10 * t + 1e-6) for t in expected]


def test_what_steps_behind_a_long_step_of_others_keeps_its_periods() -> None:
    clock = DrivenClock()

    def long(one: Node) -> int:
        clock.busy(0.6 * TICK_S)
        return one.steps

    built = system(node("a", compute=long), node("b"), tick_s=TICK_S)
    driven = Driven(built, clock).until(20).finish()
    assert driven.executor.skipped == {"a": 0, "b": 0}


def test_a_step_too_close_to_the_last_one_is_skipped_and_what_it_sent_is_seen() -> None:
    clock = DrivenClock()
    a, b, c = node("a", compute=busy(clock, 5, 0.8 * TICK_S)), node("b"), node("c", 1, ("b",))
    driven = Driven(system(a, b, c, tick_s=TICK_S), clock).until(10).finish()
    # Behind the long step both begin 0.8 periods late; their next one would come 0.2 periods later.
    assert driven.executor.skipped == {"a": 0, "b": 1, "c": 1}
    assert [r.stamp for r in driven.of("b")] == [0, 1, 2, 3, 4, 5, 7, 8, 9]
    assert driven.of("b")[5].visible_s == pytest.approx(0.06)


def test_a_step_that_is_held_up_after_it_was_decided_counts_from_its_own_begin() -> None:
    clock, began_s = DrivenClock(), []
    late = node("late", compute=lambda one: began_s.append(clock.now_s()))

    def held_up(periods: int, skip: Callable[[int], None] = late.skip) -> None:
        skip(periods)
        clock.busy(0.9 * TICK_S)

    vars(late)["skip"] = held_up
    built = system(node("a", compute=busy(clock, 5, 2.5 * TICK_S)), late, tick_s=TICK_S)
    Driven(built, clock).until(12).finish()
    assert any(b - a > 1.8 * TICK_S for a, b in itertools.pairwise(began_s))
    assert all(b - a > 0.499 * TICK_S for a, b in itertools.pairwise(began_s))


@pytest.mark.parametrize("kind", [InlineRunner, ProcessRunner])
def test_a_step_begins_before_its_samples_are_computed(kind: type[Any]) -> None:
    log: list[str] = []
    runner = kind.__new__(kind)
    runner.subsystem = SimpleNamespace(
        x=SimpleNamespace(image=Deferred(lambda: log.append("sample"))),
        step=lambda: log.append("step") or 0,
        violations=(),
    )
    runner.busy_s = 0.0
    runner.begins, runner._sensed, runner._now_s = lambda: log.append("begin"), ("image",), float
    if kind is ProcessRunner:
        runner._order = lambda skipped, views: log.append("step") or 0
        runner._begin(0, {})
    else:
        runner._step()
    assert log == ["begin", "sample", "step"]


def test_what_is_sampled_in_a_gap_is_sampled_at_its_end() -> None:
    class Plant:
        time_s = 0.0

        def sample(self, name: str) -> float:
            return self.time_s

        def advance(self, duration_s: float) -> None:
            self.time_s += duration_s

        def actuate(self, name: str, value: object) -> None: ...

        def reset(self, seed: int) -> None: ...

        def close(self) -> None: ...

    clock = DrivenClock()
    reader = node("a", 1, ("s",), compute=lambda one: one.value("s"))
    built = System(
        "sampled",
        TICK_S,
        (Scheduled(reader, 1), Scheduled(node("b", compute=busy(clock, 7, 0.05)), 1)),
        plant=PlantSpec(
            sensors=(SensorBinding("s", rate_hz=1 / (4 * TICK_S)),),
            inputs=(PlantInput("s", "a", "s"),),
        ),
        tests_all_rows=True,
    )
    driven = Driven(built, clock, plant=Plant()).until(20).finish()
    values = {r.stamp: dict(r.sent)["value"] for r in driven.of("a")}
    # The sample of tick 8 is missed; it is taken at tick 12, where the plant is by then.
    assert values[7] == pytest.approx(0.04)
    assert values[12] == pytest.approx(0.12)


@pytest.mark.parametrize("tried", blocks(range(6), long=100, each=100))
def test_random_stalls(tried: Seeds) -> None:
    for seed in tried:
        _stalled(Random(seed))


def _stalled(random: Random) -> None:
    clock = DrivenClock()
    nodes, elsewhere = [], {}
    names = [f"n{i}" for i in range(random.randint(1, 5))]
    stall = random.choice((0.0, 0.02, 0.1))

    began: defaultdict[str, list[float]] = defaultdict(list)

    def compute(one: Node) -> int:
        began[one.name].append(clock.now_s())
        if random.random() < stall:
            clock.busy(random.choice((0.004, 0.02, 0.3)) * random.random())
        return one.steps

    for name in names:
        sources = tuple(random.sample(names, random.randint(0, len(names))))
        nodes.append(node(name, random.choice((1, 2, 3, 5, 10)), sources, compute=compute))
        if random.random() < 0.4:
            elsewhere[name] = lambda: random.choice((0.001, 0.03, 0.2)) * random.random()
    nodes.append(node("tick"))
    driven = Driven(system(*nodes, tick_s=TICK_S), clock, elsewhere=elsewhere)
    driven.until(400).finish()
    assert not driven.executor.faults
    skipped = driven.executor.skipped
    for one in nodes:
        records = driven.of(one.name)
        period_s = one.ticks * TICK_S
        stamps, begun = [r.stamp for r in records], [r.time_s for r in records]
        assert stamps == sorted(set(stamps))
        assert skipped[one.name] or stamps == list(range(len(stamps)))
        for times in (begun, began[one.name][1:]):  # time counts from after the first step
            for earlier, later in itertools.pairwise(times):
                assert later - earlier >= period_s / 2 - 1e-6
        for r in records:
            # A step is in its own period, and seen when a period of its own begins.
            assert r.stamp * period_s - 1e-9 <= r.time_s < (r.stamp + 1) * period_s - 1e-9
        for r, after in itertools.pairwise(records):
            assert (r.stamp + 1) * period_s - 1e-9 <= r.visible_s <= after.time_s + 1e-9
        periods = -(-driven.executor.tick // one.ticks)
        assert len(stamps) + skipped[one.name] == periods


def test_paced_time_never_skips() -> None:
    clock = DrivenClock()
    built = system(node("a", compute=busy(clock, 5, 0.5)), tick_s=TICK_S)
    driven = Driven(built, clock, timing=Paced(clock, 2.0)).until(100).finish()
    assert driven.records == Run(system(node("a"), tick_s=TICK_S), 100).records
    assert clock.now_s() == pytest.approx(100.0 + 99 * TICK_S / 2 + 0.5, abs=TICK_S)


@pytest.mark.parametrize("how", [{"real_time": True}, {"speed": 1.0}])
def test_the_end_is_not_kept_waiting_for_a_tick(how: dict[str, Any]) -> None:
    """However long it is: the run begins at 100 s, ends at 107 s, and makes no tick at 110 s."""
    clock = DrivenClock()
    options = Options(Path(), **how)
    follows = timing(options, None, clock, lambda: clock.now_s() >= 107.0, lambda: None)
    built = system(Node("a", tick_s=5.0), tick_s=5.0)
    driven = Driven(built, clock, timing=follows).until(100).finish()
    assert [record.time_s for record in driven.records] == [0.0, 5.0]
    assert not driven.executor.faults
    assert 107.0 <= clock.now_s() <= 107.1


def test_simulated_time_asks_no_clock() -> None:
    clock = DrivenClock()
    Driven(system(node("a"), tick_s=TICK_S), clock, timing=SimulatedTime()).until(100).finish()
    assert clock.now_s() == 100.0


def test_quantiles_are_those_of_the_durations() -> None:
    random, found = Random(3), Quantiles()
    durations = sorted(random.lognormvariate(-8, 2) for _ in range(3000))
    for duration_s in durations:
        found.add(duration_s)
    assert found.longest_s == durations[-1]
    for share in (0.5, 0.9, 0.99, 1.0):
        exact = durations[max(0, int(share * len(durations)) - 1)]
        assert exact * 0.999 <= max(found.at(share), 1e-6) <= max(exact, 1e-6) * 1.03


def test_skipped_ticks_and_periods_count_as_late() -> None:
    clock = DrivenClock()
    built = system(node("a", compute=busy(clock, 5, 0.034)), node("b", 2), tick_s=TICK_S)
    followed = RealTime(clock)
    driven = Driven(built, clock, timing=followed).until(20).finish()
    assert driven.executor.skipped == {"a": 2, "b": 1}
    late = driven.executor.lateness
    # The step of tick 5 ends at 0.084 s: those of 6 and 7 were 24 and 14 ms ago, that of 8 4 ms.
    assert late["a"].count == 19 and late["a"].longest_s == pytest.approx(0.024, abs=1e-4)
    assert late["a"].at(1 - 3.5 / 19) < 1e-4
    assert [late["a"].at(1 - n / 19) for n in (0, 1, 2)] == pytest.approx(
        [0.024, 0.014, 0.004], rel=0.03
    )
    assert followed.lateness.count == 19 and followed.ticks == 17
    assert late["b"].longest_s == pytest.approx(0.024, abs=1e-4)


def test_periods_that_are_skipped_to_the_end_count_as_late() -> None:
    clock = DrivenClock()
    slow, fast = node("slow", 10), node("fast")
    built = system(slow, fast, tick_s=TICK_S)
    driven = Driven(built, clock, elsewhere={"slow": lambda: 10.0 if slow.steps else 0.0})
    driven.until(60)
    assert driven.executor.skipped["slow"] == 4
    late = driven.executor.lateness["slow"]
    assert late.count == 5 and late.longest_s == pytest.approx(0.4, abs=0.02)
    driven.finish()


def test_many_periods_are_counted_at_once() -> None:
    late = Quantiles()
    late.add_overdue(2e6, 1.0, range(1, 2_000_001))
    assert late.count == 2_000_000 and late.longest_s == 2e6 - 1
    assert late.at(0.5) == pytest.approx(1e6, rel=0.03)


def test_no_step_is_made_in_a_thread() -> None:
    """A thread that is woken waits behind processes that have just begun."""
    clock, threads = DrivenClock(), set[Thread]()
    slow = node("slow", 100, compute=lambda one: threads.add(current_thread()))
    built = system(slow, tick_s=TICK_S)
    executor = Executor(built, clock=clock, timing=RealTime(clock))
    for _ in range(300):
        assert executor.advance()
    executor.finish()
    executor.close()
    assert slow.steps > 1 and threads == {current_thread()}


def test_code_that_relies_on_proofs_is_refused() -> None:
    built = replace(system(node("a"), tick_s=TICK_S), tests_all_rows=False)
    with pytest.raises(ValueError, match="--real-time"):
        Driven(built, DrivenClock())
