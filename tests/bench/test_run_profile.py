"""The benchmark of a run, and the stopwatch that it looks at."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from specc_runtime.records import RecordDigest

from bench import run_profile
from bench.harness import building
from bench.harness.stopwatch import Stopwatch


class Clock:
    """Time that passes only when somebody waits."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def wait(self, duration_s: float) -> None:
        self.time_s += duration_s


def test_time_belongs_to_the_innermost_section() -> None:
    clock = Clock()
    watch = Stopwatch(clock.now_s)
    inner = watch.timed("inner", lambda: clock.wait(3.0))

    def work() -> None:
        clock.wait(1.0)
        inner()
        inner()
        clock.wait(10.0)

    watch.timed("outer", work)()
    clock.wait(100.0)
    assert dict(watch.seconds) == {"outer": 11.0, "inner": 6.0}
    assert dict(watch.calls) == {"outer": 1, "inner": 2}


def test_a_section_that_fails_ends_and_gives_back_to_the_outer_one() -> None:
    clock = Clock()
    watch = Stopwatch(clock.now_s)

    def fail() -> None:
        clock.wait(2.0)
        raise ValueError

    def work() -> None:
        with pytest.raises(ValueError):
            watch.timed("inner", fail)()
        clock.wait(5.0)

    watch.timed("outer", work)()
    assert dict(watch.seconds) == {"outer": 5.0, "inner": 2.0}


def test_threads_do_not_interrupt_each_other() -> None:
    clock = Clock()
    watch = Stopwatch(clock.now_s)
    thread = threading.Thread(target=watch.timed("other", lambda: clock.wait(2.0)))

    def work() -> None:
        thread.start()
        thread.join()

    watch.timed("main", work)()
    assert dict(watch.seconds) == {"main": 2.0}
    assert dict(watch.beside) == {"other": 2.0}


def test_watched_methods_are_put_back() -> None:
    class Worker:
        def work(self, number: int) -> int:
            return number + 1

    real = Worker.work
    watch = Stopwatch(Clock().now_s)
    with watch.watching({"work": ((Worker, "work"),)}):
        assert Worker().work(1) == 2
    assert Worker.work is real
    assert watch.calls["work"] == 1


@pytest.mark.long
def test_profile_of_a_short_run(tmp_path: Path) -> None:
    package = building.generate(building.FLAGSHIP, tmp_path)
    digest = RecordDigest.__call__
    profiles = [
        run_profile.profile(package, "raycast", inline, duration_s=0.1) for inline in (False, True)
    ]
    assert RecordDigest.__call__ is digest
    worker, inline = profiles
    vision = {"irp.k", "rendering", "noise of depth"}
    assert set(worker.beside) == vision
    assert set(inline.beside) == {"rendering"}
    assert set(worker.sections).isdisjoint(vision)
    named = set(run_profile.PLACES) - {"rendering"} | {run_profile.REST}
    assert set(inline.sections) == named | {"irp.c", "irp.g", "irp.k", "irp.m"}
    text = run_profile.report(profiles)
    assert "raycast, worker" in text
    assert "(irp.k, beside)" in text
    assert "part of the bound, %" in text
