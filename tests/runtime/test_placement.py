"""Budgets decide where subsystems compute in real time, and whether a run can begin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from specc_runtime.options import Options, UsageError
from specc_runtime.placement import placed, remarks, steps_data
from specc_runtime.system import Scheduled, System
from specc_runtime.timing import Quantiles

from tests.runtime.tiny import TICK_S, Node

REAL_TIME = Options(Path(), real_time=True)


def system(*budgets_ms: float | None, ticks: tuple[int, ...] = (1, 1, 5, 100)) -> System:
    """Subsystems `s0`, `s1`, … of 500, 500, 100 and 5 Hz with these budgets."""
    subsystems = tuple(
        Scheduled(Node(f"s{n}", ticks[n]), ticks[n], None if ms is None else ms / 1000)
        for n, ms in enumerate(budgets_ms)
    )
    return System("placed", TICK_S, subsystems)


def test_what_is_longer_than_a_tick_computes_apart() -> None:
    some = system(0.2, None, 2.0, 150.0)
    assert placed(REAL_TIME, some).apart == ("s3",)
    assert placed(replace(REAL_TIME, apart=("s1",)), some).apart == ("s1", "s3")


@pytest.mark.parametrize("other", [{"real_time": False}, {"inline": True}])
def test_elsewhere_budgets_decide_nothing(other: dict[str, bool]) -> None:
    options = replace(REAL_TIME, **other)  # type: ignore[arg-type]  # both are flags
    assert placed(options, system(1.5, 1.5)) is options


def test_budgets_that_need_all_time_are_refused() -> None:
    with pytest.raises(UsageError) as refused:
        placed(REAL_TIME, system(1.5, 0.5, 0.1, 190.0))
    assert "s0 75%, s1 25%, s2 1%" in str(refused.value)
    assert placed(REAL_TIME, system(1.5, 0.4, None, 190.0)).apart == ("s3",)


def test_what_may_be_late_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    placed(REAL_TIME, system(0.5, 0.5, 1.5))
    said = capsys.readouterr().err
    assert "s0, s1, s2 take 2.5 ms when all are due, longer than the base tick of 2 ms" in said
    assert [*remarks(system(0.5, 0.5, 1.0), ())] == []
    many = [*remarks(system(0.5, None, None, 150.0), ("s2", "s3"), cores=2)]
    assert many == ["2 subsystems compute in processes of their own, on 2 cores in all"]


def test_measured_steps_stand_beside_budgets() -> None:
    took = Quantiles()
    for number in range(1, 1001):
        took.add(1e-6 * number)
    scheduling = {"": "SCHED_FIFO 20", "s1": "SCHED_FIFO 1"}
    told = steps_data(system(0.5, None), ("s1",), {"s0": took}, {"s0": took}, scheduling)
    assert told["s0"]["budget_us"] == 500.0
    assert told["s0"]["p99_us"] == pytest.approx(990.0, rel=0.03)
    assert told["s0"]["max_us"] == pytest.approx(1000.0)
    assert told["s0"]["late_us"]["max"] == pytest.approx(1000.0)
    assert (told["s0"]["process"], told["s0"]["scheduling"]) == (False, "SCHED_FIFO 20")
    late = {"p50": 0.0, "p99": 0.0, "max": 0.0}
    assert told["s1"] == {
        "budget_us": None,
        "p99_us": 0.0,
        "max_us": 0.0,
        "process": True,
        "scheduling": "SCHED_FIFO 1",
        "late_us": late,
    }
