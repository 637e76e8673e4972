"""Runs one after another in one process: none leaves anything to the next one."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.main import run
from specc_runtime.options import Options
from specc_runtime.session import Session

from specc import output, pipeline
from tests.seeds import short
from tests.sweep.runs import GATE, HAZARDS, environment


def package(folder: Path) -> Path:
    built = pipeline.build(str(GATE))
    directory = folder / built.system
    output.write(directory, built.files)
    return directory


def sessions() -> int:
    """How many there are, those of other tests included."""
    gc.collect()
    return sum(type(each) is Session for each in gc.get_objects())


@pytest.mark.long
def test_a_run_is_forgotten_when_it_is_over(tmp_path: Path) -> None:
    directory, before = package(tmp_path), sessions()
    for seed in range(3):
        run(Options(directory, GATE.parent, seed=seed, duration_s=0.2, inline=True, quiet=True))
    assert sessions() == before


def test_every_job_has_its_answer_and_what_runs_print_is_none(tmp_path: Path) -> None:
    job: dict[str, Any] = {
        "directory": str(package(tmp_path)),
        "base": str(GATE.parent),
        "duration_s": 0.2,
    }
    jobs = [
        {**job, "seed": 0},
        {**job, "directory": "none"},
        {**job, "seed": 1},
        {**job, "seed": 0},
    ]
    done = subprocess.Popen(
        [sys.executable, "-m", "specc_runtime.serving", str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert done.stdin and done.stdout
    answers = []
    for one in jobs:
        done.stdin.write(json.dumps(one) + "\n")
        done.stdin.flush()
        answers.append(json.loads(done.stdout.readline()))
    _, told = done.communicate(timeout=60)
    assert done.returncode == 0
    assert [answer["code"] for answer in answers] == [0, 2, 0, 0]
    first, nothing, second, again = (answer["report"] for answer in answers)
    assert nothing is None
    assert "none is not a generated system" in told
    assert first["records_sha256"] == again["records_sha256"] != second["records_sha256"]


def hazardous(tmp_path: Path, operator: str) -> subprocess.Popen[bytes]:
    """A process that has a run with this operator as its job."""
    (tmp_path / "hazards.py").write_text(operator, encoding="utf-8")
    (tmp_path / "hazards.yaml").write_text(HAZARDS, encoding="utf-8")
    built = pipeline.build(str(tmp_path / "hazards.yaml"))
    output.write(tmp_path / "code" / built.system, built.files)
    job = {
        "directory": str(tmp_path / "code" / built.system),
        "base": str(tmp_path),
        "duration_s": 0.2,
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "specc_runtime.serving", str(tmp_path)],
        env=environment(tmp_path),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdin
    process.stdin.write(json.dumps(job).encode() + b"\n")
    process.stdin.flush()
    return process


def test_a_run_ends_when_the_input_does(tmp_path: Path) -> None:
    """Although its operator never gives the interpreter to anybody else."""
    endless = (
        "import os, re\ndef do(m, n):\n    os.write(2, b'.')\n    re.match('(a+)+b', 'a' * 99)"
    )
    process = hazardous(tmp_path, endless)
    assert process.stdin and process.stderr
    assert process.stderr.read(1) == b"."
    process.stdin.close()
    assert process.stderr.read() == b""  # which the run had, too, until its end
    assert process.wait(timeout=60) == 0


@pytest.mark.parametrize("how", short(["forks", "another program"], 0))
def test_a_run_and_what_it_started_end_when_the_process_is_killed(tmp_path: Path, how: str) -> None:
    start = {
        "forks": "os.fork()",
        "another program": "subprocess.Popen([sys.executable, '-c', WAIT])",
    }
    waits = (
        "import os, subprocess, sys, time\n"
        "WAIT = 'import os, time; os.write(2, b\".\"); time.sleep(60)'\n"
        f"def do(m, n):\n    {start[how]}\n    exec(WAIT)"
    )
    process = hazardous(tmp_path, waits)
    assert process.stderr
    assert process.stderr.read(2) == b".."
    process.kill()
    out, told = process.communicate(timeout=30)  # until nobody has its outputs
    assert (out, told) == (b"", b"")


def test_what_an_operator_started_ends_with_the_run(tmp_path: Path) -> None:
    forks = (
        "import os, time\ndef do(m, n):\n    if not n and not os.fork():\n"
        "        time.sleep(30)\n        os.write(2, b'late')\n        os._exit(0)\n    return n"
    )
    process = hazardous(tmp_path, forks)
    assert process.stdout
    assert json.loads(process.stdout.readline())["code"] == 0
    _, told = process.communicate(timeout=60)  # until nobody has its standard error
    assert b"late" not in told
