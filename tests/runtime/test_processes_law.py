"""Any system has the same records wherever its subsystems compute; and runs end as they do."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest
from specc_runtime.application import execute
from specc_runtime.cycle import Executor
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.processes.worker import Processes
from specc_runtime.records import RecordDigest

from specc import output
from specc.emit import fill_templates
from specc.lower import lower
from tests.commands import ROOT, forgotten
from tests.recording.runs import report_of, specc
from tests.runtime.apart import FAR, SPEC, built, misdeed
from tests.seeds import blocks
from tests.soundness.law import marks_of
from tests.soundness.running import (
    Script,
    ScriptedPlant,
    compiled,
    only_about_machines,
)
from tests.soundness.specifications import specification
from tests.soundness.values import NASTY

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("apart")
    with forgotten(folder):
        yield built(folder)


@pytest.mark.no_replay("the test does it")
@pytest.mark.parametrize(
    ("name", "duration_s", "apart"),
    [
        ("conveyor_gate", 6.0, ("gate.c", "belt.drive", "gate.eye")),
        ("rovers", 4.0, ("dispatcher.c", "rovers_2.c")),
        ("irp_picking", 1.2, ("irp.k",)),
        ("irp_picking", 1.2, ("irp.c", "irp.m")),
    ],
)
def test_a_recorded_run_is_the_same(
    name: str, duration_s: float, apart: Sequence[str], tmp_path: Path
) -> None:
    reports = []
    for names in ((), tuple(apart)):
        run = Options(
            ROOT / "generated" / name,
            ROOT / "specs",
            duration_s=duration_s,
            quiet=True,
            apart=names,
            report=tmp_path / f"{len(names)}.json",
            record=tmp_path / f"{len(names)}.mcap",
            record_exact=True,
        )
        with forgotten():
            assert execute(run) == 0
        reports.append(report_of(tmp_path / f"{len(names)}.json"))
        spec = ROOT / "specs" / f"{name}.yaml"
        done = specc("replay", run.record, "--spec", spec, "--check")
        assert done.returncode == 0, done.stdout + done.stderr
    assert reports[0] == reports[1]
    assert reports[0]["records_sha256"]


@pytest.mark.parametrize("seeds", blocks(range(2), long=2, each=6))
def test_random_systems_are_the_same(seeds: Sequence[int], tmp_path: Path) -> None:
    for seed in seeds:
        tree = specification(Random(seed))
        result = compiled(tree, tmp_path)
        system = result.system
        if system is None or not only_about_machines(result):
            continue
        package = tmp_path / f"random_{seed}"
        assert not [*output.write(package, fill_templates(lower(system, None)))]
        script = Script(system, str(seed), marks_of(system), NASTY)
        names = [s.qualified_name for s in system.subsystems][:3]
        with forgotten(tmp_path):
            alone, apart = (_ran(package, script, names[:n]) for n in (0, 3))
        assert alone == apart, f"seed {seed}"


def _ran(package: Path, script: Script, names: Sequence[str]) -> object:
    """Digest, commands and faults of a run in which these compute apart."""
    options = Options(package, Path(), apart=tuple(names))
    system = load_system(package, "")
    processes = Processes()
    processes.begin(system, options)
    processes.wait()
    digest = RecordDigest()
    plant = ScriptedPlant(script) if system.plant else None
    executor = Executor(system, plant, [digest], inline=True, processes=processes)
    try:
        with np.errstate(all="ignore"):
            while executor.tick < 40 and executor.advance():
                pass
            executor.finish()
    finally:
        executor.close()
    faults = [fault.as_data() for fault in executor.faults]
    return digest.hexdigest(), plant and plant.commands, faults


@pytest.mark.no_replay("the specification is not in it")
def test_a_run_goes_on_from_a_recording(package: Path, tmp_path: Path) -> None:
    """The process begins where the snapshot says."""
    base = package.parent.parent
    whole = Options(
        package, base, duration_s=4.0, quiet=True, record=tmp_path / "a.mcap", record_exact=True
    )
    with forgotten(base):
        assert execute(replace(whole, report=tmp_path / "whole.json", apart=(FAR,))) == 0
        rest = replace(whole, record=None, record_exact=False, resume=(tmp_path / "a.mcap", 2.0))
        for names in ((), (FAR,)):
            assert execute(replace(rest, report=tmp_path / f"{len(names)}.json", apart=names)) == 0
    reports = [report_of(tmp_path / f"{n}.json") for n in ("whole", 0, 1)]
    assert len({report["records_sha256"] for report in reports}) == 1


BEGINS = """
import sys
from pathlib import Path
sys.path[:0] = [{root!r}, {runtime!r}]
from specc_runtime import interruption, watchdog
interruption.GRACE_S = interruption.SAFE_S = 0.5
watchdog.Watchdog.__init__.__defaults__ = (0.5,)
from specc_runtime.application import execute
from specc_runtime.options import Options
sys.exit(execute(Options(Path({package!r}), Path({base!r}), duration_s=1e6, quiet=True,
                         apart=("far.c",), report=Path({report!r}))))
"""


@contextmanager
def _begun(package: Path, report: Path) -> Iterator[subprocess.Popen[str]]:
    """A run in a process, which is killed at the end."""
    text = BEGINS.format(
        root=str(ROOT),
        runtime=str(ROOT / "runtime"),
        package=str(package),
        base=str(package.parent.parent),
        report=str(report),
    )
    run = subprocess.Popen([sys.executable, "-c", text], stderr=subprocess.PIPE, text=True)
    try:
        yield run
    finally:
        run.kill()
        run.communicate()


def _until(condition: Callable[[], object]) -> None:
    limit_s = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < limit_s
        time.sleep(0.02)


def _children(process: int) -> list[int]:
    path = Path(f"/proc/{process}/task/{process}/children")
    return [*map(int, path.read_text().split())] if path.exists() else []


def _is_computing(process: int) -> bool:
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "R"


@pytest.mark.parametrize("name", ["", "hang", "sleep", "hold"])
def test_no_process_outlives_a_run_that_is_killed(name: str, package: Path, tmp_path: Path) -> None:
    """Whatever it is doing, holding the interpreter included."""
    with misdeed(name), _begun(package, tmp_path / "r.json") as run:
        _until(lambda: _children(run.pid))
        (child,) = _children(run.pid)
        _until(lambda: _is_computing(child))
        time.sleep(1.5)
        run.kill()
        run.wait()
        _until(lambda: not os.path.exists(f"/proc/{child}"))


@pytest.mark.parametrize("name", ["hang", "sleep", "hold"])
def test_ctrl_c_ends_a_run_whose_process_hangs(name: str, package: Path, tmp_path: Path) -> None:
    with misdeed(name), _begun(package, tmp_path / "r.json") as run:
        assert run.stderr is not None
        told = "no progress for 0.5 s: operator ACT (tests.runtime.misdeeds:act) in far.c"
        assert any(("holding" if name == "hold" else told) in line for line in run.stderr)
        (child,) = _children(run.pid)
        run.send_signal(signal.SIGINT)
        assert run.wait(60) == 130
        assert not os.path.exists(f"/proc/{child}")
    report = json.loads((tmp_path / "r.json").read_text())
    (fault,) = report["faults"]
    assert (fault["fault"], fault["subsystem"]) == ("StepAbandoned", FAR)
    assert fault["message"].startswith("Abandoned: still computing 0.5 s")


def test_garbage_ends_a_run_with_a_fault_and_its_report(package: Path, tmp_path: Path) -> None:
    with misdeed("babble 0"), _begun(package, tmp_path / "r.json") as run:
        _, said = run.communicate(timeout=60)
    report = json.loads((tmp_path / "r.json").read_text())
    assert (run.returncode, report["ended"]) == (1, "fault"), said
    assert [fault["fault"] for fault in report["faults"]] == ["ProcessEnded"]
    assert "Traceback" not in said


def test_a_budget_places_a_subsystem_in_real_time(tmp_path: Path) -> None:
    """Its slow steps are late, nobody else is made to wait, and replay finds no difference."""
    spec = tmp_path / "apart.yaml"
    text = SPEC.replace("rate: 10 Hz", "rate: 10 Hz\n      budget: 90 ms")
    spec.write_text(text.replace("n: {type: int, init: 0}", "n: {type: int, init: 30}", 1))
    files = "--report", tmp_path / "r.json", "--record", tmp_path / "r.mcap", "--record-exact"
    with misdeed("slow"):
        command = "run", str(spec), "--real-time", "--duration", "3", *map(str, files)
        done = subprocess.run(  # it locks the memory of its process
            [sys.executable, "-m", "specc", *command],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads((tmp_path / "r.json").read_text())["real_time"]
    assert told["steps"][FAR]["process"]
    assert not told["steps"]["near.c"]["process"]
    assert told["steps"][FAR]["p99_us"] > told["steps"][FAR]["budget_us"] == 9e4
    assert told["skipped"][FAR] > 0
    assert f"{FAR} took" in done.stdout
    assert set(told["punctual"]) == {"objects frozen", "memory locked", "SCHED_FIFO"}
    replayed = specc("replay", tmp_path / "r.mcap", "--spec", spec, "--check")
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
