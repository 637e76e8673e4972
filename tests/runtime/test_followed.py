"""What the summary of a run in real time says: where steps were made, which were long or late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.options import Options
from specc_runtime.progress.summary import _followed_the_clock, show
from specc_runtime.report import stillborn

LATE = {"p50": 40.0, "p99": 90.0, "max": 300.0}


def step(p99_us: float, budget_us: float | None = None, *, apart: bool = False) -> dict[str, Any]:
    return {
        "budget_us": budget_us,
        "p99_us": p99_us,
        "max_us": p99_us,
        "process": apart,
        "scheduling": "SCHED_FIFO 1" if apart else "SCHED_FIFO 20",
        "late_us": {**LATE, "p99": 60_000.0},
    }


def test_where_steps_were_made_and_what_was_long_or_late_is_said() -> None:
    steps = {
        "a.c": step(20.0),
        "a.m": step(3_000.0),
        "a.k": step(190_000.0, 150_000.0, apart=True),
        "a.v": step(90_000.0, 150_000.0, apart=True),
    }
    told = {
        "tick_us": 2_000.0,
        "ticks": 500,
        "late_us": LATE,
        "skipped": {"a.c": 0, "a.m": 0, "a.k": 7, "a.v": 0},
        "first_skipped": {"subsystem": "a.k", "stamp": 3, "time_s": 0.6},
        "steps": steps,
        "punctual": {"SCHED_FIFO": "done"},
    }
    lines = [*_followed_the_clock(told)]
    places = (
        "on the main thread (SCHED_FIFO 20): a.c, a.m; "
        "in a process of its own (SCHED_FIFO 1): a.k, a.v"
    )
    assert places in lines
    assert (
        "[yellow]a.m took 3 ms[/] (99 of 100), longer than the base tick of 2 ms: with a `budget` "
        "it computes in a process of its own"
    ) in lines
    assert "[yellow]a.k took 190 ms[/] (99 of 100), its budget is 150 ms" in lines
    assert "periods skipped: 7 of a.k, which was late by 60 ms (99 of 100)" in lines[-1]
    assert not any("a.v took" in line or "a.c took" in line for line in lines)


def test_a_run_of_many_cycles_shows_the_last_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    cycle = {"simulated_s": 1.0, "ended": "completed"}
    report = replace(stillborn(Options(Path()), [], interrupted=True), cycles=[cycle] * 130)
    show(report)
    shown = capsys.readouterr().out
    assert "130 cycles, of which these are the last:" in shown
    assert " 31 " in shown and " 130 " in shown and " 30 " not in shown
