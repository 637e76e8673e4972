"""What images of a camera in the device host cost the main process of a run in real time.

A camera reports an image at 20 Hz. Its reader has a `budget` above the base tick of 5 ms, so that
it computes in a process of its own. Beside the image of 2.2 MB is one that is small, whose run
costs all but what bytes cost. CPU is that of the whole main process, the tick is the median of
those in which an image is taken and handed on, without the wait for the next one.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from specc_runtime.clock import WallClock
from specc_runtime.cycle import Executor
from specc_runtime.hosting.python_plant import hosted
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.placement import placed
from specc_runtime.processes.worker import Processes
from specc_runtime.timing import RealTime

from bench.harness.tables import table
from specc import output, pipeline

EVERY = 10
"""Base ticks of an image."""
SPEC = """\
specc: 1
system: camera_HEIGHT
types: {Image: "image[HEIGHT, WIDTH, 3]"}
operators: {LOOK: {signature: "(i: Image) -> int", python: "bench.camera_path:look"}}
agents:
  eye:
    real_receptors: {cam: {y: {I: Image}}}
    virtual_receptors:
      cam:
        rate: 20 Hz
        budget: 40 ms
        x: {R: {I: Image}}
        y: {c: {n: int}}
        functions: {look: {y.c.n: LOOK(x.R.I)}}
        behaviours: {look: {functions: [look], terminal: never}}
        states: {S0: look}
        initial_state: S0
    control:
      rate: 200 Hz
      x: {cam: {n: {type: int, init: 0}}}
      memory: {n: {type: int, init: 0}}
      functions: {note: {n: x.cam.n}}
      behaviours: {note: {functions: [note], terminal: never}}
      states: {S0: note}
      initial_state: S0
plant: {python: "bench.camera_path:Camera", bind: {eye.R.cam.I: {}}}
"""
SIZES = ((720, 1024), (8, 8))


def look(image: Any) -> int:
    """Something of the image."""
    return int(image[0, 0, 0])


class Camera:
    """A plant in Python that reports images of the size that `SIZE` in the environment names."""

    def __init__(self) -> None:
        height, width = map(int, os.environ["SIZE"].split())
        self.image = np.zeros((height, width, 3), np.uint8)

    def reset(self, seed: int) -> None:
        """See `Plant`."""

    def sample(self, name: str) -> Any:
        """See `Plant`."""
        return self.image

    def actuate(self, name: str, value: Any) -> None:
        """See `Plant`."""

    def advance(self, duration_s: float) -> None:
        """See `Plant`."""

    def close(self) -> None:
        """See `Plant`."""


class Timed(RealTime):
    """Notes how long ticks are in which an image is taken."""

    def __init__(self) -> None:
        super().__init__(WallClock())
        self.ticks_s: list[float] = []
        self._tick, self._since_s = 1, 0.0

    def next(self, tick: int) -> int:
        """See `Timing`."""
        if self._tick % EVERY == 0:
            self.ticks_s.append(time.perf_counter() - self._since_s)
        self._tick = super().next(tick)
        self._since_s = time.perf_counter()
        return self._tick


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each run")
    options = parser.parse_args(arguments)
    rows = []
    with TemporaryDirectory(prefix="specc-camera-") as scratch:
        for height, width in SIZES:
            cpu_s, tick_s = _measured(Path(scratch), height, width, options.seconds)
            rows.append((f"{height} x {width} x 3", f"{1e3 * cpu_s:.2f}", f"{1e3 * tick_s:.2f}"))
    head = ("image", "CPU, ms an image", "tick with an image, ms")
    print(
        table("Main process, by image of 20 Hz from host to worker, without recording", head, rows)
    )


def _measured(scratch: Path, height: int, width: int, duration_s: float) -> tuple[float, float]:
    os.environ["SIZE"] = f"{height} {width}"
    spec = scratch / f"camera_{height}.yaml"
    spec.write_text(SPEC.replace("HEIGHT", str(height)).replace("WIDTH", str(width)))
    built = pipeline.build(str(spec), tests_all_rows=True)
    assert built.result.ok, built.result.diagnostics
    package = scratch / "built" / built.system
    assert not [*output.write(package, built.files)]
    system = load_system(package, scratch)
    timing, processes = Timed(), Processes()
    try:
        processes.begin(system, placed(Options(package, scratch, real_time=True), system))
        plant = hosted(system, 0)
        processes.wait()
        with Executor(system, plant, timing=timing, processes=processes) as executor:
            executor.advance()
            begin_s = time.process_time()
            while executor.time_s < duration_s and executor.advance():
                pass
            cpu_s = time.process_time() - begin_s
    finally:
        processes.close()
    if executor.faults:
        raise executor.faults[0]
    return cpu_s / (duration_s / 0.05), median(timing.ticks_s)


if __name__ == "__main__":
    main()
