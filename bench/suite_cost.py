"""What each folder of tests takes: CPU seconds, with those of child processes, and memory.

CPU seconds of imports, collection, pytest's own work and the end of the session are in the row
`rest`. Left out: time that tests wait, processes that a test does not wait for, and the memory of
child processes.

    python bench/suite_cost.py                       what `make test` runs
    python bench/suite_cost.py -m "" tests/explore   other arguments of pytest: the long ones too
    python bench/suite_cost.py --each tests/sweep    every test with its CPU seconds

`-p bench.suite_cost` prints the same at the end of any other run of pytest. Where SPECC_SEED gives
fresh seeds, it also prints what tests on them take; `.ci/run` is to stay below 120 CPU seconds.
"""

from __future__ import annotations

import os
import sys
from collections import defaultdict
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from bench.harness.session_time import SessionTime, cpu_s, of_session
from bench.harness.tables import table

ROOT = Path(__file__).parents[1]
BOUND_S = 3.0
"""CPU seconds that a test of `make test` may take."""
FRESH_S = 120.0
"""CPU seconds that tests on fresh seeds may take together in `.ci/run`."""
TITLE = (
    "CPU seconds of tests and of processes that they wait for; without waiting, and without the "
    "memory of those processes"
)
HEAD = ("folder", "tests", "CPU [s]", "slowest [s]", "worker [MB]")


class Cost(NamedTuple):
    """What one test took."""

    test: str
    cpu_s: float
    peak_mb: float
    """Of the process that runs it, with what earlier tests left there."""
    is_fresh: bool
    """Whether it draws other seeds or examples with another SPECC_SEED."""

    @property
    def folder(self) -> str:
        return self.test.partition("::")[0].rpartition("/")[0]


def peak_mb(*, anew: bool = False) -> float:
    """The most memory of this process, since it was last asked `anew`; 0 where none can tell."""
    try:
        if anew:
            Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0.0
    return next(int(x.split()[1]) / 1e3 for x in status.splitlines() if x.startswith("VmHWM"))


@dataclass(slots=True, eq=False)
class Meter:
    """A plugin: measures in the processes that run tests, prints in the one that reports."""

    session: SessionTime
    costs: list[Cost]

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(
        self, item: pytest.Item, nextitem: pytest.Item | None
    ) -> Generator[None, object, object]:
        peak_mb(anew=True)
        item.stash[BEGUN] = cpu_s()
        item.stash[IS_LAST] = nextitem is None
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        # What ends with the session, such as a server, is not for the last of those that used it.
        if call.when != "teardown" or not item.stash[IS_LAST]:
            item.stash[TAKEN] = cpu_s() - item.stash[BEGUN], peak_mb()
        if call.when == "teardown":
            report.user_properties.append(("cost", item.stash[TAKEN]))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "teardown":
            taken: Any = dict(report.user_properties)["cost"]
            cpu_s, mb = taken
            is_fresh = bool({"fresh", "hypothesis"} & set(report.keywords))
            self.costs.append(Cost(report.nodeid, cpu_s, mb, is_fresh))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        terminalreporter.section("what tests take")
        terminalreporter.write_line(told(self.costs, self.session.cpu_s))
        if os.environ.get("SPECC_SEED"):
            fresh_s = sum(cost.cpu_s for cost in self.costs if cost.is_fresh)
            terminalreporter.write_line(
                f"tests on fresh seeds took {fresh_s:.1f} CPU s; at most {FRESH_S:g} in .ci/run"
            )
        if os.environ.get(EACH):
            for cost in sorted(self.costs, key=lambda cost: -cost.cpu_s):
                terminalreporter.write_line(f"{cost.cpu_s:8.2f} {cost.peak_mb:6.0f} {cost.test}")


BEGUN = pytest.StashKey[float]()
IS_LAST = pytest.StashKey[bool]()
TAKEN = pytest.StashKey[tuple[float, float]]()
EACH = "SPECC_COST_OF_EACH_TEST"


def pytest_configure(config: pytest.Config) -> None:
    """Measure."""
    config.pluginmanager.register(Meter(of_session(config), []), "costs of tests")


def told(costs: Sequence[Cost], whole_s: float) -> str:
    """The table, and the tests beyond the bound."""
    folders = defaultdict[str, list[Cost]](list)
    for cost in costs:
        folders[cost.folder].append(cost)
    rows = [_row(folder, folders[folder]) for folder in sorted(folders)]
    rest = whole_s - sum(cost.cpu_s for cost in costs)
    peak = max((cost.peak_mb for cost in costs), default=0.0)
    rows += [
        ("rest", "", f"{rest:.1f}", "", ""),
        ("all", str(len(costs)), f"{whole_s:.1f}", "", f"{peak:.0f}"),
    ]
    beyond = sorted((c for c in costs if c.cpu_s > BOUND_S), key=lambda cost: -cost.cpu_s)
    lines = [f"  {cost.cpu_s:.1f} s  {cost.test}" for cost in beyond]
    return "\n".join(
        [table(TITLE, HEAD, rows), f"{len(beyond)} tests over {BOUND_S:g} CPU seconds", *lines]
    )


def _row(folder: str, costs: Sequence[Cost]) -> tuple[str, ...]:
    slowest, total = max(cost.cpu_s for cost in costs), sum(cost.cpu_s for cost in costs)
    peak = max(cost.peak_mb for cost in costs)
    return folder, str(len(costs)), f"{total:.1f}", f"{slowest:.1f}", f"{peak:.0f}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the tests and print the table; pytest's exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if "--each" in given:
        given.remove("--each")
        os.environ[EACH] = "1"
    os.chdir(ROOT)
    # As `make test` has it; else each process that a test starts compiles what it imports.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    return int(pytest.main(["-q", "-p", "bench.suite_cost", *(given or ["-m", "not long"])]))


if __name__ == "__main__":
    sys.exit(main())
