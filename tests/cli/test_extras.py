"""The compiler works without what runs need, and a run says which extra it lacks."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.seeds import short

ROOT = Path(__file__).parents[2]
RUN = ("numpy", "mujoco", "pinocchio", "rich", "cv2")
WITHOUT = """\
import sys
for name in sys.argv.pop(1).split(","):
    sys.modules[name] = None
from specc.cli import main
sys.exit(main())
"""
EACH = """\
import sys
for name in sys.argv[1].split(","):
    sys.modules[name] = None
from specc.cli import main
for line in sys.stdin:
    print("ended", line.split()[0], main(line.split()), flush=True)
"""


def specc(
    *arguments: str, without: tuple[str, ...], folder: Path
) -> subprocess.CompletedProcess[str]:
    """The command where some packages are not installed."""
    return subprocess.run(
        [sys.executable, "-c", WITHOUT, ",".join(without), *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT}/runtime"},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_compiler_alone(tmp_path: Path) -> None:
    """One process runs all commands one after the other."""
    specs, spec = ROOT / "specs", ROOT / "specs/irp_picking.yaml"
    commands = [
        f"validate {spec} {specs}/conveyor_gate.yaml",
        f"build {spec} --out out",
        f"fmt --check {specs}",
        f"status {spec}",
        f"ages {spec}",
        f"graph {spec} --format dot",
        f"diff {spec} {spec}",
        "explain E0601",
        "schema",
        "init new",
    ]
    done = subprocess.run(
        [sys.executable, "-c", EACH, ",".join(RUN)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT}/runtime"},
        input="\n".join(commands),
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr
    ended = [line for line in done.stdout.splitlines() if line.startswith("ended ")]
    assert ended == [f"ended {command.split()[0]} 0" for command in commands]


@pytest.mark.parametrize(
    ("spec", "lacking", "extra"),
    short(
        [
            ("conveyor_gate", "numpy", "run"),
            ("conveyor_gate", "mujoco", "run"),
            ("conveyor_gate", "rich", "run"),
            ("irp_picking", "pinocchio", "run"),
            ("irp_picking", "cv2", "vision"),
        ],
        0,
        4,
    ),
)
def test_a_run_says_which_extra_it_lacks(
    spec: str, lacking: str, extra: str, tmp_path: Path
) -> None:
    path = str(ROOT / "specs" / f"{spec}.yaml")
    done = specc("run", path, "--duration", "0.1", without=(lacking,), folder=tmp_path)
    assert done.returncode == 2
    assert f"{lacking} is not installed: `pip install 'specc[{extra}]'` brings it" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_picture_says_which_extra_it_lacks(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("graph", path, without=("pygraphviz",), folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    words = "specc: pygraphviz is not installed: `pip install 'specc[graph]'` brings it\n"
    assert done.stderr == words


def test_a_witness_says_which_extra_it_lacks(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("witness", path, without=("numpy",), folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "specc: numpy is not installed: `pip install 'specc[run]'` brings it\n"


@pytest.mark.long
def test_a_sweep_of_this_machine_needs_its_extra_for_plots_alone(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    options = ("--seeds", "0", "--duration", "0.1", "--set", "cruise=0.4,0.5")
    lacking = ("matplotlib", "distributed", "dask")
    done = specc("sweep", path, *options, without=lacking, folder=tmp_path)
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr
    assert "no plots: matplotlib is not installed; `pip install 'specc[sweep]'`" in done.stderr
    done = specc("sweep", path, *options, "--scheduler", "h:1", without=lacking, folder=tmp_path)
    assert done.returncode == 0  # all runs are there already
    (tmp_path / "sweeps/conveyor_gate/runs.jsonl").unlink()
    done = specc("sweep", path, *options, "--scheduler", "h:1", without=lacking, folder=tmp_path)
    assert done.returncode == 2
    assert "distributed is not installed; `pip install 'specc[sweep]'`" in done.stderr


def test_a_run_without_images_needs_no_vision(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("run", path, "--duration", "0.1", without=("cv2", "pinocchio"), folder=tmp_path)
    assert "not installed" not in done.stderr
    assert done.returncode in (0, 1)
