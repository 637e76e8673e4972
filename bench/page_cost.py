"""What the page costs a run at the speed of the clock: CPU of the run and of its server.

Runs without a page, with a page that nobody has open, and with one in a browser, by turns; the CPU
of the browser does not count. Each is measured between two lines of its progress, with all
processes that it has started. The page is shown once a state is lit. Medians of all rounds.

    python bench/page_cost.py --rounds 5 --seconds 15
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from bench.harness.building import FLAGSHIP
from bench.harness.tables import table
from tests.page.browser import Browser, program

SPECS = {
    "three_tier": FLAGSHIP.with_name("architectures") / "three_tier.yaml",
    "flagship": FLAGSHIP,
}
KINDS = ("no page", "page, nobody looks", "page in a browser")
START_S = 4.0
"""Simulated time after which a browser has loaded its page, and measuring begins."""
TIME = re.compile(r"^cycle \S+ +([\d.]+) s", re.MULTILINE)
TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--rounds", type=int, default=5, help="how often all runs are made")
    parser.add_argument("--seconds", type=float, default=15.0, help="what is measured of a run")
    options = parser.parse_args(arguments)
    if program() is None:
        print("no Chromium is installed, so nobody can look at the page")
        return
    rows, opened_s = [], []
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        for name, spec in SPECS.items():
            rounds = [
                [_shares(spec, kind, options.seconds, Path(scratch)) for kind in KINDS]
                for _ in range(options.rounds)
            ]
            opened_s += [each[2][2] for each in rounds]
            without = median(each[0][0] for each in rounds)
            for place, kind in enumerate(KINDS):
                runs, servers, _ = zip(*(each[place] for each in rounds), strict=True)
                total = median(map(sum, zip(runs, servers, strict=True)))
                shares = f"{median(runs):.1f}", f"{median(servers):.1f}", f"{total - without:+.1f}"
                rows.append((name, kind, *shares))
    title = f"CPU in % of a core at speed 1, medians of {options.rounds} runs"
    print(table(title, ("", "", "run", "server", "more in all"), rows))
    print(f"Shown {median(opened_s):.1f} s after its URL, at most {max(opened_s):.1f} s")


def _shares(spec: Path, kind: str, seconds: float, scratch: Path) -> tuple[float, float, float]:
    """The CPU times of a run and of its server in percent, and after how long a page is shown."""
    words = ["--speed", "1", "--cycles", "1000", "--duration", f"{START_S + seconds + 10.0:g}"]
    words += ["--ui"] if kind != KINDS[0] else []
    command = [sys.executable, "-m", "specc", "run", str(spec), *words]
    said, opened_s = scratch / "said.txt", 0.0
    with ExitStack() as opened:
        out = opened.enter_context(said.open("w"))
        run = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        opened.callback(run.wait)
        opened.callback(run.terminate)
        if kind == KINDS[2]:
            profile = Path(opened.enter_context(TemporaryDirectory(prefix="specc-profile-")))
            browser = Browser(profile)
            opened.callback(browser.close)
            page = opened.enter_context(browser.page())
            page.size(1600, 1000)
            _wait(run, lambda: "http://" in said.read_text())
            url = re.search(r"http://\S+", said.read_text())
            named_s = time.monotonic()
            page.open(url.group() if url else "")
            page.wait_for("document.querySelector('.lit')")
            opened_s = time.monotonic() - named_s
        _wait(run, lambda: _time_s(said) >= START_S)
        begin_s, before_s = time.monotonic(), _cpu_s(run.pid)
        _wait(run, lambda: _time_s(said) >= START_S + seconds)
        passed_s, after_s = time.monotonic() - begin_s, _cpu_s(run.pid)
    used = [100.0 * (a - b) / passed_s for a, b in zip(after_s, before_s, strict=True)]
    return used[0], used[1], opened_s


def _wait(run: subprocess.Popen[bytes], is_so: Callable[[], bool]) -> None:
    """Wait for what a run says."""
    while not is_so():
        assert run.poll() is None, "the run has ended too early"
        time.sleep(0.02)


def _time_s(said: Path) -> float:
    """The simulated time of the last line of progress."""
    return max(map(float, TIME.findall(said.read_text())), default=0.0)


def _cpu_s(process: int) -> tuple[float, float]:
    """The CPU time of a run with all that it started, and of its server."""
    parents, used_s = {}, {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        parents[int(file.parent.name)] = int(fields[1])
        used_s[int(file.parent.name)] = sum(map(int, fields[11:15])) * TICK_S
    own, total_s, server_s = [process], 0.0, 0.0
    for one in own:  # it grows
        if b"specc.tools.page" in Path(f"/proc/{one}/cmdline").read_bytes():
            server_s += used_s[one]
        else:
            total_s += used_s[one]
        own += [child for child, parent in parents.items() if parent == one]
    return total_s, server_s


if __name__ == "__main__":
    main()
