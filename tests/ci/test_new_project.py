"""A project as `specc init` makes it passes the pre-commit hooks and the action without an edit."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from specc.cli.init import skeletons
from specc.read import read_file
from tests.cli.robots import SERVOS, arm
from tests.commands import ROOT, specc

HOOKS: Any = read_file(str(ROOT / ".pre-commit-hooks.yaml")).data


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def action(folder: Path, tmp_path: Path) -> subprocess.CompletedProcess[str]:
    """Run the step of the action that validates, as it is."""
    program = tmp_path / "specc"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m specc "$@"\n')
    program.chmod(0o755)
    outside = {key: value for key, value in os.environ.items() if not key.startswith("GITHUB_")}
    environment = {**outside, "PYTHONPATH": str(ROOT), "SPECC_PATHS": "."}
    command = [str(ROOT / ".ci/validate"), str(program)]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def assert_green(folder: Path, tmp_path: Path) -> None:
    before = contents(folder)
    for hook in HOOKS:
        program, *command = shlex.split(hook["entry"])
        assert program == "specc"
        done = specc(*command, *hook["args"], cwd=folder)
        assert done.returncode == 0, (hook["id"], done.stderr)
    strict = specc("validate", ".", "--strict", cwd=folder)
    assert strict.returncode == 0, strict.stderr
    done = action(folder, tmp_path)
    assert (done.returncode, done.stdout) == (0, "")
    assert contents(folder) == before  # a hook that changes files fails


@pytest.fixture
def project(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "project"
    folder.mkdir()
    yield folder


@pytest.mark.long
def test_all_skeletons_in_one_project(project: Path, tmp_path: Path) -> None:
    for name in skeletons():
        assert specc("init", name, "--skeleton", name, cwd=project).returncode == 0
    used = (project / "arm/arm.yaml").read_text(encoding="utf-8")
    assert "use: specc:joint_arm" in used
    assert_green(project, tmp_path)


def test_a_robot_of_a_model(project: Path, tmp_path: Path) -> None:
    model = tmp_path / "lamp.xml"
    model.write_text(arm(SERVOS), encoding="utf-8")
    assert specc("init", project, "--model", model).returncode == 0
    assert_green(project, tmp_path)


@pytest.mark.long
def test_with_a_copy_of_the_library(project: Path, tmp_path: Path) -> None:
    """A folder of parts validates by itself, whoever uses them or not."""
    assert specc("init", project, "--skeleton", "arm").returncode == 0
    shutil.copytree(ROOT / "specs/lib", project / "lib")
    assert_green(project, tmp_path)
    done = specc("validate", "lib", cwd=project)
    assert done.returncode == 0, done.stderr
