"""docs/your_robot.md: its files make up one folder, in which its commands answer as it shows."""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path
from unittest import mock

import pytest
import specc_runtime

from tests.commands import modules_of, specc

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "your_robot.md"
EXAMPLE = DOCUMENT.parents[1] / "specs" / "examples" / "panda_bin.yaml"
TEXT = DOCUMENT.read_text(encoding="utf-8")
FILE = re.compile(r"^`(?P<path>[\w/.]+)`:\n\n```\w+\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FENCES = re.compile(r"^```\w+$", re.MULTILINE)
STEPS = [step for block in CONSOLE.findall(TEXT) for step in block.split("$ ")[1:]]


def pattern(shown: str) -> str:
    """What a shown answer allows: `...` stands for any lines, or for the rest of a line."""
    lines = [re.escape(line) for line in shown.splitlines()]
    any_lines = [r"(?:.*\n)*?" if line == r"\.\.\." else f"{line}\n" for line in lines]
    return "".join(any_lines).replace(r"\.\.\.", ".*")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robot")
    for file in FILE.finditer(TEXT):
        path = folder / file["path"]
        path.parent.mkdir(exist_ok=True)
        path.write_text(file["text"], encoding="utf-8")
    return folder


def test_every_block_is_a_file_or_a_command() -> None:
    assert len(FENCES.findall(TEXT)) == len(FILE.findall(TEXT)) + len(CONSOLE.findall(TEXT))


def test_what_is_shown_of_the_example_is_in_it() -> None:
    """Lines of the specification, deeper than the text around them; commands are of `specc`."""
    section = TEXT.split("\n## ")[1]
    shown = [line.strip() for line in re.findall(r"^ {8}(.+)$", section, re.MULTILINE)]
    text = EXAMPLE.read_text(encoding="utf-8")
    system, _, _ = text.partition("\nscenarios:\n")
    assert f"It has {len(system.splitlines())} lines" in section
    missing = [line for line in shown if line not in text]
    assert all(line.startswith("specc ") for line in missing), missing
    assert len(shown) > len(missing) > 0


@pytest.mark.long
def test_the_commands_answer_as_shown(folder: Path) -> None:
    """Those of `specc` and scripts run in this process, others in a shell."""
    for step in STEPS:
        command, _, shown = step.partition("\n")
        said = answer(command, folder)
        assert re.fullmatch(pattern(shown), said), f"$ {command}\n{said}"


def answer(command: str, folder: Path) -> str:
    program, *arguments = shlex.split(command)
    if program == "specc":
        return specc(*arguments, cwd=folder, together=True).stdout
    if program == "python":
        printed = io.StringIO()
        argv = mock.patch.object(sys, "argv", arguments)
        output = contextlib.redirect_stdout(printed)
        with modules_of(folder), contextlib.chdir(folder), argv, output:
            runpy.run_path(arguments[0], run_name="__main__")
        return printed.getvalue()
    scripts = str(Path(sys.executable).parent)
    environment = {**os.environ, "PATH": os.pathsep.join((scripts, os.environ["PATH"]))}
    environment.pop("PYTHONPATH", None)
    environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # those of our own tests
    return subprocess.run(
        command,
        shell=True,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
        check=False,
    ).stdout


def test_a_plant_of_ones_own_takes_forty_lines(folder: Path) -> None:
    text = (folder / "robots" / "rover.py").read_text(encoding="utf-8")
    assert len([line for line in text.splitlines() if line.strip()]) <= 40


def test_what_is_public_is_listed() -> None:
    section = TEXT.split("## 10. What is public\n")[1]
    rows = [row.split("|")[1] for row in section.splitlines() if row.startswith("| `")]
    assert sorted(re.findall(r"`(\w+)`", " ".join(rows))) == sorted(specc_runtime.__all__)
    for name in specc_runtime.__all__:
        assert getattr(specc_runtime, name) is not None
    with pytest.raises(AttributeError, match="Robot"):
        _ = specc_runtime.Robot


def test_public_names_load_no_more_than_they_need() -> None:
    code = (
        "import sys; from specc_runtime import NO_SAMPLE, Latest, Plant, PlantError, UsageError; "
        "print(*sys.modules)"
    )
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert not {"numpy", "mujoco", "cv2", "rich"} & set(loaded)
