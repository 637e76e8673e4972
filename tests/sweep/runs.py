"""Sweeps as a user starts them, and a specification of hazards."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.commands import specc

ROOT = Path(__file__).parents[2]
GATE = ROOT / "specs/conveyor_gate.yaml"

HAZARDS = """specc: 1
system: hazards
constants: {mode: "0", level: "1[m]"}
operators:
  do: {signature: "(mode: int, seen: int) -> int", python: "hazards:do"}
agents:
  one:
    control:
      rate: 10 Hz
      y: {two: {n: int}}
      memory: {k: {type: int, init: 0}}
      functions: {count: {k: "do(mode, k) + 1", y.two.n: k}}
      behaviours: {count: {functions: [count], terminal: never}}
      states: {S0: count}
      initial_state: S0
  two:
    control:
      rate: 10 Hz
      x: {one: {n: int}}
      memory: {last: {type: "real[m]", init: level}}
      functions: {listen: {last: last}}
      behaviours: {listen: {functions: [listen], terminal: never}}
      states: {S0: listen}
      initial_state: S0
"""
OPERATOR = """import os, time
from pathlib import Path
used = []
def do(mode, seen):
    used.append(seen)
    if mode == 5 and len(used) != seen + 1:
        raise ValueError("there was another run")
    if mode == 1:
        raise ValueError("no such thing")
    if mode == 2:
        os._exit(3)
    if mode == 4:
        starter = Path(f"/proc/{os.getppid()}/stat").read_text().rpartition(")")[2].split()[1]
        os.kill(int(starter), 9)
    while mode == 3:
        time.sleep(1)
    return seen
"""


def hazards(folder: Path) -> Path:
    """The specification of hazards: its operator fails, ends the process or hangs, by `mode`."""
    (folder / "hazards.py").write_text(OPERATOR, encoding="utf-8")
    path = folder / "hazards.yaml"
    path.write_text(HAZARDS, encoding="utf-8")
    return path


def command(spec: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "specc", "sweep", str(spec), *options]


def environment(folder: Path) -> dict[str, str]:
    """With modules from a folder."""
    path = os.pathsep.join((str(folder), os.environ.get("PYTHONPATH", "")))
    return {**os.environ, "PYTHONPATH": path}


def swept(folder: Path, spec: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """A sweep into `out` below the folder."""
    return specc("sweep", spec, "--out", "out", *options, cwd=folder, env=environment(folder))


def table(folder: Path) -> list[dict[str, Any]]:
    """The rows of `out`, without wall times."""
    with (folder / "out" / "runs.csv").open(encoding="utf-8", newline="") as file:
        return [{n: v for n, v in row.items() if n != "wall_s"} for row in csv.DictReader(file)]
