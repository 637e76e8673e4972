"""Times of whole processes, taken in turns."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter

from bench.harness.timing import undisturbed


@dataclass(frozen=True, slots=True)
class Times:
    """Medians over the repeats, ms."""

    wall_ms: float
    cpu_ms: float


Command = Callable[[int], Sequence[str]]
"""The arguments of a process in its n-th repeat."""


def in_turns(commands: Mapping[str, Command], repeats: int) -> dict[str, Times]:
    """Times of the commands, after one run of each that only warms the caches of files.

    Raises:
        subprocess.CalledProcessError: one of them failed.
    """
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    with undisturbed():
        for number in range(repeats + 1):
            for name, command in commands.items():
                times = _run(command(number))
                if number:
                    taken[name].append(times)
    return {
        name: Times(*(1e3 * median(column) for column in zip(*times, strict=True)))
        for name, times in taken.items()
    }


def _run(command: Sequence[str]) -> tuple[float, float]:
    """Wall and CPU seconds of a process and its children."""
    # Compiled modules are kept, as they are where specc is installed.
    kept = {"OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": ""}
    environment = {**os.environ, **kept}
    before, begin_s = _cpu_s(), perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=environment)
    return perf_counter() - begin_s, _cpu_s() - before


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
