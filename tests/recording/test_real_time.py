"""Recordings of runs in real time: replay finds no difference, and the report says what was late.

The clock is driven: it stalls where the test's random numbers say so.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from random import Random
from unittest import mock

import pytest
from specc_runtime import application
from specc_runtime.clock import WallClock
from specc_runtime.punctuality import Punctuality

from tests.recording.runs import CONVEYOR, ROOT, messages, report_of, specc
from tests.recording.test_snapshots import spec_in
from tests.runtime.driven import DrivenClock
from tests.seeds import Seeds, blocks


class Stalling(DrivenClock):
    """A machine on which now and then something else goes on, before a tick or within a step."""

    def __init__(self, random: Random, share: float, longest_s: float) -> None:
        super().__init__()
        self._random, self._share, self._longest_s = random, share, longest_s

    def now_s(self) -> float:
        if self._random.random() < self._share:
            self.busy(self._random.uniform(0, self._longest_s))
        return super().now_s()

    def date_ns(self) -> int:
        return round(1e9 * self.time_s)


@contextmanager
def on_the(clock: WallClock) -> Iterator[None]:
    """Runs made inside have this clock, and leave priority and memory of the process alone."""
    with (
        mock.patch.object(application, "WallClock", lambda: clock),
        mock.patch.object(Punctuality, "begin"),
    ):
        yield


SPECS = ("rovers", "conveyor_gate", "architectures/services", "architectures/sense_plan_act")


@pytest.mark.parametrize("seeds", blocks([1], long=3, each=1))
def test_a_run_with_stalls_is_replayed_without_a_difference(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        random, file = Random(seed), tmp_path / "run.mcap"
        disturbed = spec_in(tmp_path)
        spec = (
            disturbed if random.random() < 0.5 else ROOT / "specs" / f"{random.choice(SPECS)}.yaml"
        )
        with on_the(Stalling(random, 0.01, 0.2)):
            done = specc(
                *("run", spec, "--real-time", "--inline", "--duration", 4, "--seed", seed),
                *("--record", file, "--record-exact", "--report", tmp_path / "run.json"),
            )
        told = report_of(tmp_path / "run.json")
        skipped = told["real_time"]["skipped"]
        assert sum(skipped.values()), done.stderr
        assert "proofs hold until then" in done.stdout
        first = told["real_time"]["first_skipped"]
        assert skipped[first["subsystem"]] and first["time_s"] < 4
        replayed = specc("replay", file, "--spec", spec)
        assert "differs" not in replayed.stdout + replayed.stderr, replayed.stdout
        same = dict(re.findall(r"^(\S+): (\d+) steps are the same$", replayed.stdout, re.M))
        steps = {name: data["steps"] for name, data in told["subsystems"].items()}
        assert not told["faults"] and {n: int(count) for n, count in same.items()} == steps
        for each in told.get("requirements", ()):
            assert f"{each['verdict']} {each['that']}" in replayed.stdout
        for name, count in skipped.items():
            written = [data.get("skipped", 0) for _, data in messages(file)[f"/{name}"]]
            assert 0 <= count - sum(written) <= 1 + count // 2  # none is written after the last


def test_without_stalls_the_records_are_those_of_simulated_time(tmp_path: Path) -> None:
    options = ("--duration", 3, "--inline", "--report")
    with on_the(Stalling(Random(0), 0.0, 0.0)):
        specc("run", CONVEYOR, *options, tmp_path / "a.json", "--real-time")
        specc("run", CONVEYOR, *options, tmp_path / "b.json", "--speed", 0.5)
    specc("run", CONVEYOR, *options, tmp_path / "c.json")
    real, paced, simulated = (report_of(tmp_path / f"{name}.json") for name in "abc")
    assert real.pop("real_time")["first_skipped"] is None
    assert real == paced == simulated


def test_what_is_later_than_the_last_moment_cannot_go_on(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with on_the(Stalling(Random(0), 0.0, 0.0)):
        specc("run", CONVEYOR, "--real-time", "--duration", 2, "--record", file)
    done = specc("run", CONVEYOR, "--from", f"{file}@1")
    assert done.returncode == 2
    assert "run in real time" in done.stderr


def test_nothing_goes_on_in_real_time() -> None:
    """Least of all what has to be repeated up to there by another specification."""
    past = f"{ROOT / 'tests' / 'recording' / 'conveyor_gate.mcap'}@1"
    done = specc("run", CONVEYOR, "--real-time", "--from", past, "--duration", 2)
    assert done.returncode == 2
    assert done.stderr.startswith("error: --from: ")


@pytest.mark.parametrize("words", [("--real-time", "--speed", "2"), ("--speed", "0")])
def test_wrong_usage(words: Sequence[str]) -> None:
    assert specc("run", CONVEYOR, *words).returncode == 2


def test_code_that_relies_on_proofs_is_refused(tmp_path: Path) -> None:
    from specc_runtime.main import main

    specc("build", CONVEYOR, "--out", tmp_path)
    package = str(tmp_path / "conveyor_gate")
    base = str(CONVEYOR.parent)
    assert main([package, "--base", base, "--real-time", "--duration", "0.1"]) == 2
    specc("build", CONVEYOR, "--out", tmp_path, "--real-time")
    with on_the(Stalling(Random(0), 0.0, 0.0)):
        report = tmp_path / "report.json"
        words = [package, "--base", base, "--real-time", "--duration", "0.1"]
        assert main([*words, "--report", str(report), "--quiet"]) == 0
    assert json.loads(report.read_text())["real_time"]["ticks"]
