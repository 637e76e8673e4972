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
from types import SimpleNamespace

import pytest

from specc.tools.sweep.running import Bundle, NoRun, SweepJob, run_job
from tests.sweep.runs import GATE, command, environment, hazards, swept, table

OPTIONS = ("--set", "cruise=0.4,0.5", "--seeds", "0:8", "--duration", "20")


def dask(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments, "--no-dashboard"],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.fixture
def scheduler(tmp_path: Path) -> subprocess.Popen[str]:
    return dask(tmp_path, "scheduler", "--host", "127.0.0.1", "--port", "0")


@pytest.fixture
def cluster(tmp_path: Path, scheduler: subprocess.Popen[str]) -> Iterator[str]:
    """The address of a scheduler with two workers, which are in folders of their own."""
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
        # With all that it started: one that is just starting a worker anew hears nothing else.
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=60)


@pytest.mark.long
def test_a_cluster_makes_the_same_table_although_a_worker_dies(
    cluster: str, tmp_path: Path
) -> None:
    alone, together = tmp_path / "alone", tmp_path / "together"
    alone.mkdir()
    together.mkdir()
    assert swept(alone, GATE, *OPTIONS).returncode == 0
    sweep = begun(together, cluster)
    os.kill(worker_in(tmp_path / "left"), signal.SIGKILL)
    told, _ = sweep.communicate(timeout=300)
    assert sweep.returncode == 0, told
    assert table(together) == table(alone)
    assert not left_in(tmp_path)


def begun(folder: Path, cluster: str) -> subprocess.Popen[str]:
    """A sweep on the cluster, of which two runs are done."""
    sweep = subprocess.Popen(
        command(GATE, "--out", "out", "--scheduler", cluster, *OPTIONS),
        cwd=folder,
        env=environment(folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    log = folder / "out" / "runs.jsonl"
    while sweep.poll() is None and (not log.exists() or log.read_bytes().count(b"\n") < 2):
        time.sleep(0.02)
    return sweep


def left_in(folder: Path) -> list[Path]:
    """What sweeps left on the workers."""
    return list(folder.glob("*/dask-scratch-space/*/specc-*"))


@pytest.mark.long
def test_what_is_left_on_workers_and_who_is_gone(
    cluster: str, scheduler: subprocess.Popen[str], tmp_path: Path
) -> None:
    killed = begun(tmp_path, cluster)
    killed.kill()
    killed.communicate()
    assert len(left_in(tmp_path)) == 2
    done = swept(tmp_path, GATE, "--scheduler", cluster, *OPTIONS)
    assert (done.returncode, left_in(tmp_path)) == (0, []), done.stderr
    shutil.rmtree(tmp_path / "out")
    orphaned = begun(tmp_path, cluster)
    scheduler.kill()
    told, _ = orphaned.communicate(timeout=120)
    assert orphaned.returncode == 2
    assert "specc: the workers are gone; the same command goes on where this ended" in told


def test_a_worker_with_other_versions_is_refused(tmp_path: Path) -> None:
    from specc.tools.sweep.cluster import Shipment  # of a package that takes a second

    shipment = Shipment("specc-test", Bundle({}, "base"))
    shipment.versions["numpy"] = "0.1"
    worker = SimpleNamespace(local_directory=str(tmp_path), address="tcp://there")
    with pytest.raises(RuntimeError, match=r"tcp://there has numpy .*, not 0\.1 as here"):
        shipment.setup(worker)
    assert not list(tmp_path.iterdir())
    with pytest.raises(NoRun, match=r"tcp://there has numpy .*, not 0\.1 as here"):
        run_job(SweepJob("specc-test", "", {}, 0, {}, 1.0))  # of a worker that joins late
    shipment.teardown(worker)


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
