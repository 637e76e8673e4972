"""`specc why` says of a moment what was so: against live values and the tests' own evaluator."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.recording.index import Index
from specc_runtime.recording.messages import recorded
from specc_runtime.recording.moment import Seen, seen_at
from specc_runtime.stepping import array

from specc.model.system import Subsystem, System
from specc.pipeline import compile_spec
from specc.tools.why import Moment, NotKnown, NotRecorded
from tests.commands import modules_of
from tests.recording.runs import CONVEYOR, ROOT, specc
from tests.recording.why import NO_VALUE, Lives, Reference, parts, watched
from tests.scenarios.architectures import ARCHITECTURES
from tests.seeds import Seeds, blocks
from tests.soundness.values import same

KEPT = Path(__file__).with_name("conveyor_gate.mcap")
"""`specc run specs/conveyor_gate.yaml --duration 6 --record-exact --record …`"""
SPECS = {
    "conveyor_gate": CONVEYOR,
    "irp_picking": ROOT / "specs" / "irp_picking.yaml",
    "rovers": ROOT / "specs" / "rovers.yaml",
    **{a.name: a.path for a in ARCHITECTURES},
}
MOMENTS = 15
"""Of each specification: more than 200 in all."""
ROUNDED = 3e-6
"""Relative error of what is computed of arrays in single precision."""
_TRUTH = re.compile(r"    ((?:error|terminal|row) .*?): (True|False)(?:, for [a-z ]*|  \(.*\))?$")


def _recorded(spec: Path, file: Path, seed: int, duration_s: float, *more: str) -> Lives:
    with watched() as lives:
        options = ("--duration", duration_s, "--seed", seed, "--record", file, *more)
        done = specc("run", spec, *options, "--inline")
        assert file.exists(), done.stderr
    return lives


class Agreement:
    """Compares moments of a recording with what the run itself had."""

    def __init__(self, spec: Path, file: Path, lives: Lives) -> None:
        result = compile_spec(str(spec))
        assert result.system is not None
        self.system: System = result.system
        self.spec, self.file, self.lives = spec, file, lives
        self.is_exact = recorded(file)[0]["exact"] == "true"
        self.truths = self.values = self.unknown = 0

    def check(self, rng: Random, end_s: float) -> None:
        """One random moment of one random subsystem."""
        subsystem = rng.choice([s for s in self.system.subsystems if s.rate_hz > 0])
        lives, rate_hz = self.lives[subsystem.qualified_name], subsystem.rate_hz
        stamp = rng.randrange(min(math.floor(end_s * rate_hz) + 1, len(lives)))
        rows = [i for i, live in enumerate(lives) if (live.row or 0) >= 0 and live.before]
        if rows and rng.random() < 0.5:  # most of what changes does so with a row
            stamp = rng.choice(rows)
        time_s = float((stamp + Fraction(rng.randrange(1000), 1001)) / rate_hz)
        time_s = min(time_s, end_s) if stamp / rate_hz <= end_s else time_s
        live = lives[stamp]
        name = subsystem.qualified_name
        (seen,) = seen_at(Index(self.file), time_s, name)
        assert (seen.step["stamp"], seen.step["state"]) == (stamp, live.state), (name, time_s)
        done = specc("why", f"{self.file}@{time_s}", name, "--spec", self.spec)
        assert done.returncode == 0, done.stderr
        self._check_head(done.stdout, subsystem, stamp)
        found = {m[1]: m[2] == "True" for m in map(_TRUTH.match, done.stdout.splitlines()) if m}
        if stamp == 0:
            assert not found
            return
        reference = Reference(self.system, subsystem, lives, stamp)
        expected = reference.truths()
        assert found == expected, done.stdout
        self.truths += len(found)
        self._check_values(seen, subsystem, reference, stamp)

    def _check_head(self, text: str, subsystem: Subsystem, stamp: int) -> None:
        """State, since when, and by which row."""
        lives, period_s = self.lives[subsystem.qualified_name], 1 / subsystem.rate_hz
        entered = next((i for i in range(stamp, 0, -1) if (lives[i].row or 0) >= 0 and i), 0)
        entered = entered if (lives[entered].row or 0) >= 0 else 0
        since_s = float(entered * period_s)
        said = re.match(r".* \(stamp (\d+)\): in (\S+)((?: in \S+)*) since (\S+) s", text)
        assert said is not None, text
        assert (int(said[1]), said[2]) == (stamp, lives[stamp].state)
        around = said[3].split(" in ")[:0:-1]
        assert tuple(around) == subsystem.state(lives[stamp].state).modes
        assert float(said[4].rstrip(",")) == pytest.approx(since_s, rel=1e-5, abs=1e-9), text
        row = lives[entered].row
        if entered and row is not None:
            taken = subsystem.transitions[row]
            assert f"  by {taken.label}" in text.splitlines()[1]

    def _check_values(
        self, seen: Seen, subsystem: Subsystem, reference: Reference, stamp: int
    ) -> None:
        """Of conditions and all that they are made of."""
        assert seen.entered_s is not None
        moment = Moment(
            self.system, subsystem, seen.step, seen.memory, seen.step["time"] - seen.entered_s,
            is_exact=self.is_exact, array=array,
        )  # fmt: skip
        behaviour = subsystem.state(self.lives[subsystem.qualified_name][stamp].before).behaviour
        asked = [c.when for _, c in behaviour.endings]
        asked += [row.condition.when for row in subsystem.transitions if not row.is_otherwise]
        for text, expr in parts(subsystem, asked).items():
            try:
                expected: Any = reference.value(expr)
            except NO_VALUE:
                expected = NotKnown
            try:
                found: Any = moment.value(expr)
            except NotKnown as why:
                assert expected is NotKnown or self._may_lack(why), (text, str(why))
                self.unknown += expected is not NotKnown
                continue
            if expected is NotKnown:
                continue  # other parts of it are not there: the run would not have asked
            tolerance = 1e-12 if self.is_exact else ROUNDED
            assert _same(found, expected, tolerance), (text, found, expected)
            self.values += 1

    @staticmethod
    def _may_lack(why: NotKnown) -> bool:
        return any(
            words in str(why) for words in ("not recorded", "single precision", "nothing asked")
        )


def _same(found: Any, expected: Any, tolerance: float) -> bool:
    """Whether two values are the same, as far as the first one is there."""
    if isinstance(found, NotRecorded):
        return True
    if isinstance(found, tuple) and isinstance(expected, tuple):
        pairs = zip(found, expected, strict=False)
        return len(found) == len(expected) and all(_same(a, b, tolerance) for a, b in pairs)
    if hasattr(found, "__dict__"):
        return all(_same(v, getattr(expected, n), tolerance) for n, v in vars(found).items())
    return same(found, expected, tolerance)


@pytest.mark.parametrize("seeds", blocks([3], long=0, each=1))
def test_moments_of_the_conveyor(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        _agree(CONVEYOR, tmp_path, seed, moments=8, duration_s=2.6)


@pytest.mark.long
@pytest.mark.parametrize("name", SPECS)
def test_moments_of_every_architecture(name: str, tmp_path: Path) -> None:
    _agree(SPECS[name], tmp_path, 1, moments=MOMENTS, duration_s=2)


@pytest.mark.parametrize("seeds", blocks([], long=1, each=1)[1:])
def test_moments_of_any_architecture(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        spec = Random(seed).choice([*SPECS.values()])
        _agree(spec, tmp_path, seed, moments=MOMENTS, duration_s=4)


def _agree(spec: Path, folder: Path, seed: int, *, moments: int, duration_s: float) -> None:
    rng, file = Random(seed), folder / "run.mcap"
    more = ["--record-exact"] if rng.random() < 0.3 else []
    with modules_of():
        lives = _recorded(spec, file, seed % 1000, duration_s, *more)
        compared = Agreement(spec, file, lives)
        for _ in range(moments):
            compared.check(rng, duration_s - 1e-3)
    assert compared.truths
    print(f"{moments} moments: {compared.truths} truths, {compared.values} values compared,"
          f" {compared.unknown} not recorded")  # fmt: skip
