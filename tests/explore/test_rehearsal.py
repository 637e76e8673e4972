"""Runs that go back to a moment of another run are those that begin anew."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.rehearsal import Rehearsal

from specc import output, pipeline
from tests.explore.societies import society
from tests.seeds import short

CASES = Path(__file__).parent / "cases"
TICKS = 60
Told = list[tuple[Any, ...]]


def rehearsal(spec: Path, folder: Path) -> Rehearsal:
    """The generated code, ready to run."""
    made = pipeline.build(str(spec))
    package = folder / made.system
    assert made.system
    assert not list(output.write(package, made.files))
    return Rehearsal(package, spec.parent)


def listens(told: Told) -> Callable[..., bool]:
    def goes_on(*step: Any) -> bool:
        told.append(step)
        return True

    return goes_on


def random_reports(rng: Random, sensors: tuple[str, ...]) -> dict[str, list[tuple[int, Any]]]:
    """Of sporadic sensors, too; another one that reports nothing new ends the run."""
    values = (0.0, 0.5, 1.0, 2.0)
    return {
        name: [(0, 1.0), *((tick, rng.choice((*values * 4, ...))) for tick in range(1, TICKS, 3))]
        for name in sensors
    }


@pytest.mark.long
@pytest.mark.parametrize("systems", short([3, 5, 12], 0))
def test_runs_that_go_back_are_those_that_begin_anew(systems: int, tmp_path: Path) -> None:
    compared = sensed = shorter = 0
    for seed in range(systems):
        rng = Random(seed)
        if not society(rng, tmp_path).ok:
            continue
        runs = rehearsal(tmp_path / "spec.yaml", tmp_path / str(seed))
        first = random_reports(rng, runs.sensors)
        keep = rng.sample(range(TICKS), 4)
        _, kept = runs.run(first, TICKS, listens([]), keep=keep)
        for tick, moment in kept.items():
            second = random_reports(rng, runs.sensors)
            other = {
                name: [r for r in said if r[0] < tick] + [r for r in second[name] if r[0] >= tick]
                for name, said in first.items()
            }
            anew, since = Told(), Told()
            assert (
                runs.run(other, TICKS, listens(since), moment)[0]
                == (runs.run(other, TICKS, listens(anew))[0])
            )
            assert since == anew[len(anew) - len(since) :]
            shorter += len(since) < len(anew)  # before the first steps are seen nothing is told
            compared += bool(since)
            sensed += len(runs.sensors)
    assert compared >= systems
    assert sensed and shorter


def test_a_moment_is_gone_back_to_after_a_fault(tmp_path: Path) -> None:
    """What ended one run is no matter to the next one."""
    runs = rehearsal(CASES / "broken-both.yaml", tmp_path)
    told, again = Told(), Told()
    failures, kept = runs.run({}, 400, listens(told), keep=(0,))
    assert [failure.is_assumption for failure in failures] == [True]
    assert runs.run({}, 400, listens(again), kept[0])[0] == failures
    assert again == told
