"""The compiler works without what runs need, and a run says which extra it lacks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from unittest import mock

import pytest
from specc_runtime import extras

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


@pytest.mark.parametrize("name", short(["conveyor_gate", "irp_picking"], 0))
def test_the_compiler_alone(name: str, tmp_path: Path) -> None:
    """One process runs all commands one after the other."""
    specs, spec = ROOT / "specs", ROOT / f"specs/{name}.yaml"
    commands = [
        f"validate {spec} {specs}/skeletons",
        f"build {spec} --out out",
        f"fmt --check {spec} {specs}/skeletons",
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


def lacks(package: str, extra: str, said: str) -> re.Match[str] | None:
    """The words that a package is missing, with a line that brings its extra from this checkout."""
    line = rf"`\S+( -m pip)? install -e \S*{ROOT.name}\[{extra}\]'?`"
    return re.search(rf"(^|: ){package} is not installed: {line} brings it", said, re.MULTILINE)


INDEX, FOLDER = "", '{"url": "file:///srv/my%20specc", "dir_info": {}}'
EDITABLE = '{"url": "file:///srv/specc", "dir_info": {"editable": true}}'
GIT = '{"url": "https://h.org/specc", "vcs_info": {"vcs": "git", "commit_id": "c0ffee"}}'
WHEEL = '{"url": "file:///srv/specc-0.1-py3-none-any.whl", "archive_info": {}}'


@pytest.mark.parametrize(
    ("told", "cwd", "source"),
    [
        (INDEX, "/", "'specc[run]'"),
        (EDITABLE, "/srv/specc", "-e '.[run]'"),
        (EDITABLE, "/srv", "-e 'specc[run]'"),
        (EDITABLE, "/srv/other", "-e '/srv/specc[run]'"),
        (FOLDER, "/", "'srv/my specc[run]'"),
        (GIT, "/", "'specc[run] @ git+https://h.org/specc@c0ffee'"),
        (WHEEL, "/", "'specc[run]'"),
        ("no JSON", str(ROOT), "-e '.[run]'"),
    ],
)
def test_an_extra_comes_from_where_specc_is_from(
    told: str, cwd: str, source: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = mock.Mock(read_text=lambda _: told)
    monkeypatch.setattr(extras, "distribution", lambda _: there)
    monkeypatch.setattr(os, "getcwd", lambda: cwd)
    assert extras.lacking("numpy").endswith(f" install {source}` brings it")


def test_each_package_has_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for package, extra in (("pinocchio", "run"), ("networkx", "run"), ("cv2", "vision")):
        error = ModuleNotFoundError(name=f"{package}.inner")
        assert lacks(package, extra, extras.remedy(error))


def test_the_pip_that_is_named_is_that_of_the_interpreter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, other = tmp_path / "own env", tmp_path / "other"
    for folder in (own, other):
        folder.mkdir()
        (folder / "pip").touch(0o755)
    monkeypatch.setattr(sys, "executable", str(own / "python"))
    monkeypatch.setenv("PATH", f"{own}:{other}")
    assert "`pip install " in extras.lacking("rich")
    monkeypatch.setenv("PATH", f"{other}:{own}")
    assert f"`'{own}/python' -m pip install " in extras.lacking("rich")
    monkeypatch.chdir(tmp_path)
    assert "`'own env/python' -m pip install " in extras.lacking("rich")


@pytest.mark.long
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
    ),
)
def test_a_run_says_which_extra_it_lacks(
    spec: str, lacking: str, extra: str, tmp_path: Path
) -> None:
    path = str(ROOT / "specs" / f"{spec}.yaml")
    done = specc("run", path, "--duration", "0.1", without=(lacking,), folder=tmp_path)
    assert done.returncode == 2
    assert lacks(lacking, extra, done.stderr)
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_a_picture_says_which_extra_it_lacks(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("graph", path, without=("pygraphviz",), folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert lacks("pygraphviz", "graph", done.stderr) and done.stderr.count("\n") == 1


@pytest.mark.long
def test_a_page_says_which_extra_it_lacks(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("run", path, "--ui", "--duration", "1", without=("websockets",), folder=tmp_path)
    assert done.returncode == 2
    assert lacks("websockets", "ui", done.stderr) and done.stderr.count("\n") == 1


def test_a_bag_says_which_extra_it_lacks_before_it_is_written(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    options = ("--duration", "1", "--record", "gate.mcap", "--profile", "ros2")
    done = specc("run", path, *options, without=("rosbags",), folder=tmp_path)
    assert (done.returncode, [*tmp_path.iterdir()]) == (2, [])
    assert lacks("rosbags", "bags", done.stderr) and done.stderr.count("\n") == 1
    arm = str(ROOT / "tests/ros2/arm.yaml")
    done = specc("replay", arm, "--bag", ".", without=("rosbags",), folder=tmp_path)
    assert done.returncode == 2 and lacks("rosbags", "bags", done.stderr)


@pytest.mark.long
def test_a_plot_says_which_extra_it_lacks(tmp_path: Path) -> None:
    command = "plot", str(ROOT / "tests/recording/conveyor_gate.mcap")
    done = specc(*command, without=("matplotlib",), folder=tmp_path)
    assert (done.returncode, done.stdout, [*tmp_path.iterdir()]) == (2, "", [])
    assert lacks("matplotlib", "plot", done.stderr) and done.stderr.count("\n") == 1
    done = specc(*command, "--csv", without=("matplotlib", "mujoco"), folder=tmp_path)
    assert done.returncode == 0 and done.stdout.startswith("begin_s,end_s,subsystem,state\n")


def test_a_witness_says_which_extra_it_lacks(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("witness", path, without=("numpy",), folder=tmp_path)
    assert done.returncode == 2
    assert lacks("numpy", "run", done.stderr) and done.stderr.count("\n") == 1


@pytest.mark.long
def test_a_sweep_of_this_machine_needs_its_extra_for_plots_alone(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    options = ("--seeds", "0", "--duration", "0.1", "--set", "cruise=0.4,0.5")
    lacking = ("matplotlib", "distributed", "dask")
    done = specc("sweep", path, *options, without=lacking, folder=tmp_path)
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr
    assert lacks("no plots: matplotlib", "plot", done.stderr)
    done = specc("sweep", path, *options, "--scheduler", "h:1", without=lacking, folder=tmp_path)
    assert done.returncode == 0  # all runs are there already
    (tmp_path / "sweeps/conveyor_gate/runs.jsonl").unlink()
    done = specc("sweep", path, *options, "--scheduler", "h:1", without=lacking, folder=tmp_path)
    assert done.returncode == 2
    assert lacks("distributed", "sweep", done.stderr)


@pytest.mark.long
def test_a_run_without_images_needs_no_vision(tmp_path: Path) -> None:
    path = str(ROOT / "specs/conveyor_gate.yaml")
    done = specc("run", path, "--duration", "0.1", without=("cv2", "pinocchio"), folder=tmp_path)
    assert "not installed" not in done.stderr
    assert done.returncode in (0, 1)
