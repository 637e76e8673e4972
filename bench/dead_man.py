"""How soon a button that is held is released once nobody gives signs of life any more.

A run goes on in real time. Another process gives a sign of life every 50 ms, as a page does, until
it is killed or stopped (SIGKILL, SIGSTOP) at a random moment. The run has to release the button
more than 0.2 s after the last sign that it has got and, the signs being 50 ms apart, at most 0.2 s
and a base tick after the process was killed. One that goes on later presses nothing.

    python bench/dead_man.py --times 50 --busy 2
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from specc_runtime import Executor, RealTime, load_system
from specc_runtime.clock import WallClock
from specc_runtime.panel import DEAD_MAN_S, Operation

from bench.harness.tables import table
from specc import output, pipeline
from tests.runtime.desk import ENABLE, SPEC

RATES_HZ = (50, 500)
SIGN_S = 0.05
_CLIENT = f"""
import os, time
os.write(1, b"r")
while True:
    os.write(1, b"h")
    time.sleep({SIGN_S})
"""
_BUSY = "while True: pass"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table; 1 if anything of this does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--busy", type=int, default=0, help="processes that compute all the time")
    options = parser.parse_args(arguments)
    busy = [subprocess.Popen([sys.executable, "-c", _BUSY]) for _ in range(options.busy)]
    rows, wrong = [], 0
    try:
        for rate_hz in RATES_HZ:
            for number in (signal.SIGKILL, signal.SIGSTOP):
                after_s, late = _released(rate_hz, number, options.times)
                ordered = sorted(1e3 * each for each in after_s)
                shown = ordered[0], ordered[len(ordered) // 2], ordered[-1]
                rows.append(
                    [f"{rate_hz} Hz", number.name, *(f"{ms:.1f}" for ms in shown), str(late)]
                )
                wrong += late
    finally:
        for process in busy:
            process.kill()
            process.wait()
    head = ("base tick", "signal", "least ms", "median ms", "most ms", "wrong")
    print(table(f"Released after {options.times} signals, {options.busy} busy", head, rows))
    return int(wrong > 0)


class _Run:
    """A run in a thread; `releases` has when a button was released by the clock."""

    def __init__(self, package: Path) -> None:
        clock = WallClock()
        system = load_system(package, package.parent)
        self.releases: list[float] = []
        self.presses = 0
        self.executor = Executor(system, timing=RealTime(clock), clock=clock, changed=self._changed)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._go)
        self._thread.start()

    def _changed(self, operation: object) -> None:
        assert isinstance(operation, Operation)
        if operation.value:
            self.presses += 1
        else:
            self.releases.append(time.perf_counter())

    def _go(self) -> None:
        while not self._over.is_set():
            self.executor.advance()

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.executor.close()


def _released(rate_hz: int, number: signal.Signals, times: int) -> tuple[list[float], int]:
    """How long after the signal the button was released, s, and how often that is wrong."""
    random = Random(0)
    with TemporaryDirectory(prefix="specc-dead-man-") as scratch:
        spec = Path(scratch, "desk.yaml")
        spec.write_text(SPEC.replace("rate: 50 Hz", f"rate: {rate_hz} Hz"))
        built = pipeline.build(str(spec), tests_all_rows=True, is_read=False)
        package = Path(scratch, built.system)
        list(output.write(package, built.files))
        run, wrong = _Run(package), 0
        after_s: list[float] = []
        try:
            while len(after_s) < times:
                if (found := _once(run, number, random)) is not None:
                    after_s.append(found[0])
                    wrong += not found[1]
        finally:
            run.close()
    return after_s, wrong


def _once(run: _Run, number: signal.Signals, random: Random) -> tuple[float, bool] | None:
    """Seconds from the signal to the release, and whether all is as it has to be.

    None if the machine was so busy that the signs came too late before the signal.
    """
    panel, last_s = run.executor.panel, [0.0]
    with subprocess.Popen([sys.executable, "-c", _CLIENT], stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        signs = client.stdout.fileno()

        def obey() -> None:
            while data := os.read(signs, 1):
                if data == b"h":
                    panel.hold(ENABLE, time.perf_counter())
                else:
                    panel.release(ENABLE)
                last_s[0] = time.perf_counter()

        reader = threading.Thread(target=obey)
        reader.start()
        until_s = time.perf_counter() + 5
        while not panel.values[ENABLE] and time.perf_counter() < until_s:
            time.sleep(0.01)
        time.sleep(random.uniform(0.1, 0.4))
        begun, pressed = len(run.releases), run.presses
        if not panel.values[ENABLE]:
            client.kill()
            reader.join()
            return None
        signal_s = time.perf_counter()
        os.kill(client.pid, number)
        while len(run.releases) == begun:
            time.sleep(0.001)
        released_s, sign_s = run.releases[begun], last_s[0]
        os.kill(client.pid, signal.SIGCONT)
        time.sleep(3 * SIGN_S)
        client.kill()
        reader.join()
    is_right = released_s - sign_s > DEAD_MAN_S and run.presses == pressed and pressed > 0
    return released_s - signal_s, is_right and len(run.releases) == begun + 1


if __name__ == "__main__":
    sys.exit(main())
