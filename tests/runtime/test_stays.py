"""`stays(v, T)` against its definition: v is equal at this tick and at all ticks of T before it."""

from __future__ import annotations

import json
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from specc_runtime.temporal import FALSE, TRUE, UNKNOWN, Judgement, Stays, Watched

from specc.cli import main
from tests.runtime.test_requirements import SPEC
from tests.seeds import blocks, every

ABSENT = object()
VALUES: Sequence[tuple[object, ...]] = (
    (0, 1, 2),
    (0.0, -0.0, 0.5),
    ("a", "b"),
    (np.array([0.0, np.nan]), np.array([0.0, np.nan]), np.array([1.0, np.nan])),
    (None, (1.0, np.array([2.0])), (1.0, np.array([2.0])), (1.0, np.array([3.0]))),
    (1.5, ABSENT),
)
"""Values of one type each; some are equal and are not one object."""


def is_same(a: object, b: object) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return all(map(is_same, a, b))
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and np.array_equal(a, b, equal_nan=True)
    return a is b or (ABSENT not in (a, b) and a == b)


def at(values: Sequence[object], ticks: int, tick: int) -> Judgement:
    """The definition; a value that is absent all the time is unknown."""
    if tick < ticks or any(not is_same(values[tick], v) for v in values[tick - ticks : tick]):
        return FALSE
    return UNKNOWN if values[tick] is ABSENT and ticks else TRUE


def drawn(rng: random.Random) -> list[object]:
    among, values = rng.choice(VALUES), list[object]()
    while len(values) < 16:
        values += [rng.choice(among)] * rng.randint(1, 5)
    return values


class Follower:
    """A monitor that is told of a value only where it becomes another object, as in a run."""

    def __init__(self, ticks: int) -> None:
        self.now: object = ABSENT
        self.value = Watched(self.read, "now")
        self.formula = Stays(ticks, self.value)

    def read(self) -> object:
        if self.now is ABSENT:
            raise LookupError
        return self.now

    def show(self, now: object) -> None:
        self.now = now
        self.value.update()

    def step(self, now: object) -> Judgement | None:
        if now is not self.now:
            self.show(now)
        return self.formula.step()


@pytest.mark.parametrize("seeds", blocks(range(300), long=3000, each=1000))
def test_a_monitor_says_what_the_definition_says(seeds: Sequence[int]) -> None:
    for seed in seeds:
        rng = random.Random(seed)
        values, ticks = drawn(rng), rng.randrange(6)
        follower = Follower(ticks)
        follower.show(rng.choice(values))  # what is there before the first tick
        for tick, value in enumerate(values):
            assert follower.step(value) == at(values, ticks, tick), (seed, tick)


@pytest.mark.parametrize("seeds", blocks(range(100), long=1000, each=1000))
def test_a_restored_monitor_goes_on_as_the_first_would(seeds: Sequence[int]) -> None:
    for seed in seeds:
        rng = random.Random(seed)
        values, ticks = drawn(rng), rng.randrange(6)
        until = rng.randrange(1, len(values))
        first = Follower(ticks)
        first.show(values[0])
        for value in values[:until]:
            first.step(value)
        other = Follower(ticks)
        for value in drawn(rng):  # another run, in the same process
            other.step(value)
        other.formula.restore(json.loads(json.dumps(first.formula.saved())))
        other.show(values[until - 1])
        for tick, value in enumerate(values[until:], until):
            assert other.step(value) == at(values, ticks, tick), (seed, tick)


def test_what_was_before_unknown_ticks_is_unknown() -> None:
    follower = Follower(2)
    follower.show(1)
    follower.value.now = UNKNOWN
    for _ in range(3):
        follower.formula.step()
    follower.show(1)
    assert [follower.step(1) for _ in range(4)] == [UNKNOWN, UNKNOWN, TRUE, TRUE]


def judged(folder: Path, text: str, code: int) -> dict[str, Any]:
    spec, report = folder / "pair.yaml", folder / "report.json"
    spec.write_text(f'{SPEC}require:\n  - that: "{text}"\n    because: of the test\n')
    assert main(["run", str(spec), "--duration", "2", "--report", str(report)]) == code
    (found,) = json.loads(report.read_text())["requirements"]
    return dict(found)


# The counter counts until 0.7 s, at 10 Hz; what it sends is 1.75 m/s from 0.8 s on.
@pytest.mark.parametrize(
    ("text", "verdict", "time_s"),
    every(
        2,
        [
            ("always(stays(counter.c.n, 0.3[s]) implies state(counter.c) == resting)", "met", None),
            ("always(not stays(counter.c.n, 0.5[s]))", "violated", 1.2),
            ("always(not stays(listener.c.x.counter.v, 0.5[s]))", "violated", 1.3),
            ("always(stays(counter.c.w, patience) or counter.c.n <= 5)", "met", None),
            ("always(stays([counter.c.n, 1], 0.3[s]) implies counter.c.n == 8)", "met", None),
            ("always(stays(counter.c.n > 3, 0.5[s]) implies counter.c.n == 8)", "met", None),
            ("within(1[s], stays(state(counter.c), 0.8[s]))", "violated", 0),
            ("within(2[s], historically(0.2[s], stays(counter.c.n, 0.2[s])))", "met", None),
        ],
    ),
)
def test_runs_are_judged(tmp_path: Path, text: str, verdict: str, time_s: float | None) -> None:
    found = judged(tmp_path, text, int(verdict == "violated"))
    assert (found["verdict"], found["time_s"]) == (verdict, pytest.approx(time_s))
