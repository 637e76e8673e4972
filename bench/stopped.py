"""A run in real time whose process is stopped for 300 ms, again and again (SIGSTOP, SIGCONT).

What must hold: by the clock no two steps of a subsystem begin closer than half its period;
`elapsed` is right to a period wherever a machine counts it; report and recording agree on what was
skipped, and replay finds no difference. A wrapper around each step notes its begin, for 1 us.

    python bench/stopped.py --stops 20
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

from bench.harness.tables import table
from specc.cli import main as specc

ROOT = Path(__file__).parents[1]
SPECS = ("specs/conveyor_gate.yaml", "specs/rovers.yaml", "specs/architectures/services.yaml")
STOPPED_S, APART_S = 0.3, 0.7


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table; 1 if anything of this does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stops", type=int, default=20)
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.child:
        return _child(*options.child)
    rows, wrong = [], 0
    for spec in SPECS:
        found = _stopped(ROOT / spec, options.stops)
        rows.append([Path(spec).stem, *map(str, found)])
        wrong += sum(found[3:])
    head = ("specification", "stops", "skipped", "elapsed", "elapsed wrong", "too close", "lost")
    print(table("Stopped for 300 ms in real time", head, rows))
    return int(wrong > 0)


def _stopped(spec: Path, stops: int) -> tuple[int, ...]:
    """Stops, skipped periods, steps with `elapsed` and those where it is wrong, steps too close,
    and disagreeing accounts.
    """
    random = Random(0)
    with TemporaryDirectory(prefix="specc-stopped-") as scratch:
        folder = Path(scratch)
        duration_s = 2 + stops * (STOPPED_S + APART_S)
        child = (__file__, "--child", str(spec), scratch, str(duration_s))
        with subprocess.Popen([sys.executable, *child], cwd=ROOT) as process:
            while not (folder / "begun").exists() and process.poll() is None:
                time.sleep(0.05)
            for _ in range(stops):
                time.sleep(random.uniform(0.5, 1.5) * APART_S)
                os.kill(process.pid, signal.SIGSTOP)
                time.sleep(STOPPED_S)
                os.kill(process.pid, signal.SIGCONT)
        steps = json.loads((folder / "steps.json").read_text())
        report = json.loads((folder / "run.json").read_text())
        skipped = report["real_time"]["skipped"]
        with redirect_stdout(StringIO()) as out:
            code = specc(["replay", str(folder / "run.mcap"), "--spec", str(spec)])
        lost = int(code != 0 or "differs" in out.getvalue())
        for name, count in skipped.items():
            stamps = [stamp for stamp, *_ in steps[name]["steps"]]
            lost += count < stamps[-1] + 1 - len(stamps)
        return stops, sum(skipped.values()), *_elapsed(steps), _close(steps), lost


def _close(steps: dict[str, Any]) -> int:
    """Pairs of steps that begin closer than half a period; the first step loads what it needs."""
    close = 0
    for told in steps.values():
        begun = [begun_s for _, begun_s, *_ in told["steps"][1:]]
        close += sum(b - a < 0.499 * told["period_s"] for a, b in pairwise(begun))
    return close


def _elapsed(steps: dict[str, Any]) -> tuple[int, int]:
    """Steps in which periods are counted, and those with another number than have passed."""
    counted = wrong = 0
    for told in steps.values():
        entered, counting = 0, _counting(told["steps"])
        for stamp, _, row, periods, state in told["steps"]:
            entered = stamp if row >= 0 else entered
            counted += state in counting
            wrong += state in counting and periods != stamp - entered
    return counted, wrong


def _counting(steps: Sequence[Any]) -> set[str]:
    """The states in which periods are counted, since something asks for the time in them."""
    return {
        state
        for (before, _, _, count, earlier), (stamp, _, row, periods, state) in pairwise(steps)
        if (stamp, earlier, row) == (before + 1, state, -1) and periods == (count or 0) + 1
    }


def _child(spec: str, scratch: str, duration_s: str) -> int:
    from specc_runtime import application
    from specc_runtime.loading import load_system

    noted: dict[str, Any] = defaultdict(lambda: {"steps": []})

    def load(*given: Any, **more: Any) -> Any:
        system = load_system(*given, **more)
        for scheduled in system.subsystems:
            _note(scheduled.subsystem, noted[scheduled.subsystem.name])
        return system

    folder = Path(scratch)
    words = ("--real-time", "--duration", duration_s, "--inline", "--record-exact")
    files = ("--report", str(folder / "run.json"), "--record", str(folder / "run.mcap"))
    (folder / "begun").touch()
    with patch.object(application, "load_system", load), redirect_stdout(StringIO()):
        code = specc(["run", spec, *words, *files])
    (folder / "steps.json").write_text(json.dumps(noted))
    return int(code)


def _note(subsystem: Any, told: dict[str, Any]) -> None:
    own_step, own_skip, stamp = subsystem.step, subsystem.skip, [-1]
    told["period_s"] = subsystem.period_s

    def step() -> int:
        begun_s = time.perf_counter()
        row = own_step()
        stamp[0] += 1
        periods = vars(subsystem).get("_periods")
        told["steps"].append((stamp[0], begun_s, row, periods, subsystem.state))
        return int(row)

    def skip(periods: int) -> None:
        stamp[0] += periods
        own_skip(periods)

    vars(subsystem).update(step=step, skip=skip)


if __name__ == "__main__":
    sys.exit(main())
