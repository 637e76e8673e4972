"""How late ticks are in real time, beside a loop that only sleeps, in turns in one process.

The flagship's subsystems have devices that answer at once with what the simulator measured first;
recognition computes in a process of its own. The small system has a subsystem of 50 Hz beside one
whose step takes 150 ms of Python at 10 Hz: in a process, on the main thread as without a budget, or
with no step at all. All loops have the same priority where that is permitted. A tick that is
skipped counts as late.

    python bench/punctuality.py --seconds 60
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from specc_runtime.clock import WallClock
from specc_runtime.cycle import Executor
from specc_runtime.environment import open_plant
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.placement import placed
from specc_runtime.plant import Deferred
from specc_runtime.processes.worker import Processes
from specc_runtime.punctuality import Punctuality, in_words
from specc_runtime.system import System
from specc_runtime.timing import RealTime

from bench.harness.building import FLAGSHIP
from bench.harness.tables import table
from specc import output, pipeline

BUSY_S = 0.15
SMALL = """\
specc: 1
system: SYSTEM
operators: {WORK: {signature: "(n: int) -> int", python: "bench.punctuality:OPERATOR"}}
agents:
  slow:
    control:
      rate: 10 Hz
      BUDGET
      x: {fast: {n: {type: int, init: 0}}}
      y: {fast: {n: int}}
      functions: {work: {y.fast.n: WORK(x.fast.n)}}
      behaviours: {go: {functions: [work], terminal: never}}
      states: {S0: go}
      initial_state: S0
  fast:
    control:
      rate: 50 Hz
      x: {slow: {n: {type: int, init: 0}}}
      y: {slow: {n: int}}
      memory: {n: {type: int, init: 0}}
      functions: {count: {n: n + 1, y.slow.n: "n + x.slow.n - x.slow.n"}}
      behaviours: {go: {functions: [count], terminal: never}}
      states: {S0: go}
      initial_state: S0
"""


def busy(n: int) -> int:
    """What keeps the interpreter of its process for `BUSY_S`."""
    until_s = time.perf_counter() + BUSY_S
    while time.perf_counter() < until_s:
        pass
    return n


def idle(n: int) -> int:
    """The same without the work."""
    return n


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="of each loop, in all")
    parser.add_argument("--turns", type=int, default=6)
    options = parser.parse_args(arguments)
    with TemporaryDirectory(prefix="specc-punctual-") as scratch:
        print(_table("Flagship, base tick 2 ms", 0.002, flagship(Path(scratch)), options))
        print(_table("A step of 150 ms beside 50 Hz", 0.005, small(Path(scratch)), options))


Loop = Callable[[float, float], "Counted"]
"""Runs for so many seconds; ticks that begin later than a limit are late."""


class Counted(RealTime):
    """Counts the ticks that were late or skipped, and has the longest delays."""

    def __init__(self, limit_s: float, ready: Callable[[], None]) -> None:
        super().__init__(WallClock(), ready)
        self.limit_s = limit_s
        self.ticks = self.late = 0

    def next(self, tick: int) -> int:
        """See `Timing`."""
        newest = super().next(tick)
        if self._origin_s is not None:
            is_late = self.now_s - newest * self._tick_s > self.limit_s
            self.ticks += newest - tick + 1
            self.late += newest - tick + is_late
        return newest


def _table(title: str, limit_s: float, loops: dict[str, Loop], options: Any) -> str:
    turn_s = options.seconds / options.turns
    found: dict[str, list[Counted]] = {name: [] for name in loops}
    for turn in range(options.turns):
        order = list(loops) if turn % 2 else list(loops)[::-1]
        for name in order:
            found[name].append(loops[name](turn_s, limit_s))
    rows = []
    for name, counted in found.items():
        ticks, late = sum(c.ticks for c in counted), sum(c.late for c in counted)
        worst = [c.lateness for c in counted]
        p50, p99 = (sorted(q.at(share) for q in worst)[len(worst) // 2] for share in (0.5, 0.99))
        most_s = max(q.longest_s for q in worst)
        share = f"{late / ticks:.3%}"
        rows.append([name, str(ticks), f"{1e6 * p50:.0f}", f"{1e6 * p99:.0f}",
                     f"{1e6 * most_s:.0f}", share])  # fmt: skip
    head = ("loop", "ticks", "p50, us", "p99, us", "max, us", f"> {1e3 * limit_s:g} ms late")
    return table(title, head, rows)


def bare(tick_s: float) -> Loop:
    """A loop that sleeps from tick to tick."""

    def loop(duration_s: float, limit_s: float) -> Counted:
        with _punctual() as begin:
            timing = Counted(limit_s, begin)
            timing.begin(0, tick_s)
            tick = 1
            while tick * tick_s < duration_s:
                tick = timing.next(tick) + 1
        return timing

    return loop


@contextmanager
def _punctual() -> Iterator[Callable[[], None]]:
    punctuality = Punctuality()

    def begin() -> None:
        punctuality.begin()
        if any(told != "done" for told in punctuality.classes.values()):
            print(in_words(punctuality.classes), file=sys.stderr)

    try:
        yield begin
    finally:
        punctuality.end()


def running(package: Path, base: Path, plant: Callable[[System], Any]) -> Loop:
    """The executor in real time, placed by the budgets."""

    def loop(duration_s: float, limit_s: float) -> Counted:
        system = load_system(package, base)
        processes = Processes()
        try:
            processes.begin(system, placed(Options(package, base, real_time=True), system))
            processes.wait()
            with _punctual() as begin:
                timing = Counted(limit_s, begin)
                stub = plant(system)
                executor = Executor(system, stub, timing=timing, processes=processes)
                while executor.time_s < duration_s and executor.advance():
                    pass
        finally:
            processes.close()
        if executor.faults:
            raise executor.faults[0]
        executor.close()
        return timing

    return loop


class Stub:
    """A plant whose devices always report the same, at once."""

    def __init__(self, values: dict[str, Any]) -> None:
        self._values = values

    def reset(self, seed: int) -> None:
        """See `Plant`."""

    def sample(self, name: str) -> Any:
        """See `Plant`."""
        return self._values[name]

    def actuate(self, name: str, value: Any) -> None:
        """See `Plant`."""

    def advance(self, duration_s: float) -> None:
        """See `Plant`."""

    def close(self) -> None:
        """See `Plant`."""


def flagship(scratch: Path) -> dict[str, Loop]:
    """Its subsystems, of which recognition has a budget, and the loop that sleeps."""
    text = FLAGSHIP.read_text(encoding="utf-8")
    text = re.sub(r"max_age: \d+ ms", "max_age: 1 s", text)  # a skipped period is not the end
    package = _built(str(FLAGSHIP), scratch, text)
    base = FLAGSHIP.parent
    values = _measured(load_system(package, base), base)
    return {"bare": bare(0.002), "executor": running(package, base, lambda _: Stub(values))}


def _measured(system: System, base: Path) -> dict[str, Any]:
    """What all devices report first, in simulation."""
    plant = open_plant(system, base)
    assert system.plant is not None
    try:
        taken = {each.name: plant.sample(each.name) for each in system.plant.sensors}
        return {n: v.value() if isinstance(v, Deferred) else v for n, v in taken.items()}
    finally:
        plant.close()


def small(scratch: Path) -> dict[str, Loop]:
    """The fast subsystem beside the slow one, in a process, on the main thread, or alone."""
    loops = {"bare": bare(0.02)}
    for name, operator, budget in (
        ("no slow step", "idle", ""),
        ("in a process", "busy", "budget: 100 ms"),
        ("on the main thread", "busy", ""),
    ):
        called = name.replace(" ", "_")
        text = SMALL.replace("SYSTEM", called).replace("OPERATOR", operator)
        spec = scratch / f"{called}.yaml"
        spec.write_text(text.replace("BUDGET", budget), encoding="utf-8")
        package = _built(str(spec), scratch, None)
        loops[name] = running(package, scratch, lambda _: None)
    return loops


def _built(spec: str, scratch: Path, text: str | None) -> Path:
    texts = {} if text is None else {spec: text}
    built = pipeline.build(spec, texts=texts, tests_all_rows=True)
    assert built.result.ok, built.result.diagnostics
    package = scratch / "built" / built.system
    assert not [*output.write(package, built.files)]
    return package


if __name__ == "__main__":
    main()
