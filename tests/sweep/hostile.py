"""Folders of sweeps that ask for much: a megabyte each, of runs that are all done."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

from specc.cli import sweep
from specc.cli.main import main

SPEC = """specc: 1
system: swept
constants: {k: 1}
agents:
  one:
    control:
      rate: 10 Hz
      y: {two: {n: int}}
      functions: {tell: {y.two.n: k}}
      behaviours: {tell: {functions: [tell], terminal: never}}
      states: {S0: tell}
      initial_state: S0
  two:
    control:
      rate: 10 Hz
      x: {one: {n: int}}
      behaviours: {rest: {functions: [], terminal: never}}
      states: {S0: rest}
      initial_state: S0
"""
COMMAND = ("sweep", "swept.yaml", "--duration=1", "--out=runs")
FOLDER, LOG = Path("runs"), Path("runs/runs.jsonl")
_SEEDS_OF_UNITS = 9000


def line(seed: int, figures: Mapping[str, Any], **values: str) -> str:
    """A line of the log: a run with some figures."""
    run = {"success": True, "reason": "", **figures}
    return json.dumps({"set": values, "seed": seed, "run": run})


def begun(*arguments: str) -> None:
    """Make the specification here, and the folder that a sweep of it begins with."""
    Path("swept.yaml").write_text(SPEC, encoding="utf-8")
    with patch.object(sweep, "_run", lambda *_: 0):
        assert main([*COMMAND, *arguments]) == 0


def put(lines: Iterable[str]) -> None:
    """Put these runs into the folder."""
    LOG.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def _of_all_runs() -> Iterator[str]:
    for seed in range(2):
        for k in range(1, 3):
            yield line(seed, {f"c{i}": i * k for i in range(15_000)}, k=str(k))


def of_one_run(runs: int = 1000, columns: int = 60) -> Iterator[str]:
    """Runs none of whose columns another one has."""
    for seed in range(runs):
        yield line(seed, {f"c{columns * seed + i}": i for i in range(columns)})


def _of_settings() -> Iterator[str]:
    for k in range(1, 1001):
        yield line(0, {f"c{2 * k + i}": i for i in range(2)} | {"pad": "x" * 800}, k=str(k))


def _of_names() -> Iterator[str]:
    for k in range(1, 3):
        yield line(0, {"$" + "long " * 90_000: k, "reason": "long " * 10_000}, k=str(k))


def _of_units() -> Iterator[str]:
    for seed in range(_SEEDS_OF_UNITS):
        yield line(seed, {}, k=f"1[{'m/' * 20}s**{seed}]")
    yield line(0, {}, k="1")


HOSTILE: Mapping[str, tuple[Sequence[str], Callable[[], Iterable[str]]]] = {
    "many columns": (("--set=k=1,2", "--seeds=0:2"), _of_all_runs),
    "columns of one run": (("--seeds=0:1000",), of_one_run),
    "columns of one setting": (("--set=k=1:1000:1000", "--seeds=0:1"), _of_settings),
    "long names": (("--set=k=1,2", "--seeds=0:1"), _of_names),
    "many units": (("--set=k=1", "--seeds=0:1"), _of_units),
}
"""Arguments of the command, and the lines of the log."""
