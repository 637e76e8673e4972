"""What a run of pytest took, beside a fixed loop: machines differ by a factor of two.

`-p bench.harness.session_time` adds a line to the end of any run of pytest:

    tests took 118 s (wall), 231 CPU s; reference loop 1.02 CPU s

CPU seconds are those of all processes that are waited for, imports and collection too. The loop
runs after the tests, in the process that reports: times of two machines are divided by its times.
"""

from __future__ import annotations

import os
import time
from typing import Any

import pytest

ROUNDS = 6_500_000
"""They take about a second."""


def cpu_s() -> float:
    """CPU seconds of this process and of the children that it has waited for."""
    return sum(os.times()[:4])


def reference_loop() -> int:
    """Arithmetic and look-ups in pure Python, the same ones wherever it runs."""
    values: dict[int, int] = {}
    total = 0
    for number in range(ROUNDS):
        key = number & 1023
        total = (total * 31 + values.get(key, number)) % 1_000_003
        values[key] = total
    return total


def reference_s() -> float:
    """CPU seconds of the loop."""
    begin_s = time.process_time()
    reference_loop()
    return time.process_time() - begin_s


class SessionTime:
    """A plugin: workers send their CPU seconds to the process that reports."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._begin_s = time.monotonic()
        self._workers_s = 0.0

    @property
    def cpu_s(self) -> float:
        """Of all processes: the children of one that has workers are the workers."""
        return self._workers_s + sum(os.times()[:2]) if self._workers_s else cpu_s()

    def pytest_sessionfinish(self) -> None:
        if hasattr(self._config, "workeroutput"):
            self._config.workeroutput["cpu_s"] = cpu_s()

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object | None) -> None:
        self._workers_s += getattr(node, "workeroutput", {}).get("cpu_s", 0.0)

    @pytest.hookimpl(trylast=True)
    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        wall_s, taken_s = time.monotonic() - self._begin_s, self.cpu_s
        terminalreporter.write_line(
            f"tests took {wall_s:.0f} s (wall), {taken_s:.0f} CPU s; "
            f"reference loop {reference_s():.2f} CPU s"
        )


def pytest_configure(config: pytest.Config) -> None:
    """Measure from now on."""
    of_session(config)


def of_session(config: pytest.Config) -> SessionTime:
    """The plugin of this run, which others may ask for as well."""
    found: SessionTime | None = config.pluginmanager.get_plugin(NAME)
    if found is None:
        found = SessionTime(config)
        config.pluginmanager.register(found, NAME)
    return found


NAME = "time of the session"
