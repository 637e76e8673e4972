"""Sweeps on a Dask cluster: the same table, also when a worker dies on the way."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.sweep.runs import GATE, command, environment, hazards, swept, table

OPTIONS = ("--set", "cruise=0.4,0.5", "--seeds", "0:8", "--duration", "20")


def dask(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments, "--no-dashboard"],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler with two workers, which are in folders of their own."""
    scheduler = dask(tmp_path, "scheduler", "--host", "127.0.0.1", "--port", "0")
    assert scheduler.stderr is not None
    address = next(
        found[1] for line in scheduler.stderr if (found := re.search(r"tcp://([\d.]+:\d+)", line))
    )
    workers = []
    for name in ("left", "right"):
        (tmp_path / name).mkdir()
        place = ("--nthreads", "1", "--local-directory", str(tmp_path / name))
        workers.append(dask(tmp_path / name, "worker", f"tcp://{address}", *place))
    yield address
    for process in (*workers, scheduler):
        process.send_signal(signal.SIGINT)
    for process in (*workers, scheduler):
        process.communicate(timeout=60)


def test_a_cluster_makes_the_same_table_although_a_worker_dies(
    cluster: str, tmp_path: Path
) -> None:
    alone, together = tmp_path / "alone", tmp_path / "together"
    alone.mkdir()
    together.mkdir()
    assert swept(alone, GATE, *OPTIONS).returncode == 0
    sweep = subprocess.Popen(
        command(GATE, "--out", "out", "--scheduler", cluster, *OPTIONS),
        cwd=together,
        env=environment(together),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    log = together / "out" / "runs.jsonl"
    while sweep.poll() is None and (not log.exists() or log.read_bytes().count(b"\n") < 2):
        time.sleep(0.02)
    os.kill(worker_in(tmp_path / "left"), signal.SIGKILL)
    told, _ = sweep.communicate(timeout=300)
    assert sweep.returncode == 0, told
    assert table(together) == table(alone)
    assert not list(tmp_path.glob("*/dask-scratch-space/*/specc-*"))


@pytest.mark.long
def test_a_run_that_kills_whatever_worker_makes_it_is_a_row(cluster: str, tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    for name in ("left", "right"):  # the folders where workers find their modules
        shutil.copy(tmp_path / "hazards.py", tmp_path / name)
    options = ("--set", "mode=4,0", "--seeds", "0:2", "--duration", "1")
    done = swept(tmp_path, spec, "--scheduler", cluster, *options)
    assert done.returncode == 0, done.stderr
    reasons = [row["reason"] for row in table(tmp_path)]
    assert reasons == ["its worker died, again and again"] * 2 + [""] * 2


def worker_in(folder: Path) -> int:
    """The process that works there, not the one that guards it."""
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and _works_in(process, folder):
            found.append(int(process.name))
    assert len(found) == 1
    return found[0]


def _works_in(process: Path, folder: Path) -> bool:
    try:
        here = (process / "cwd").resolve() == folder.resolve()
        return here and b"spawn_main" in (process / "cmdline").read_bytes()
    except OSError:
        return False
