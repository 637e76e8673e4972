"""docs/two_gates.md: its changes fit the tutorial's file, and its commands answer as it shows."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import specc as in_process
from tests.docs.test_your_robot import pattern
from tests.docs.tutorial import pieces

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "two_gates.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)

EXERCISE = "specc run specs/my_gate.yaml --seed 3 --duration 30"


def changed(text: str, difference: str) -> str:
    """The text after the parts of a difference, each of which fits one place."""
    for part in difference.split("@@\n"):
        old, new = (
            "".join(line[1:] for line in part.splitlines(keepends=True) if line[0] in kept)
            for kept in (" -", " +")
        )
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def specc(command: str, folder: Path) -> str:
    """What a command says, on both streams."""
    scripts = str(Path(sys.executable).parent)
    path = os.pathsep.join((scripts, os.environ["PATH"]))
    return subprocess.run(
        command,
        shell=True,
        cwd=folder,
        env={**os.environ, "PATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
        check=False,
    ).stdout


def written(folder: Path) -> Path:
    """The tutorial's specification without its scenarios, in a folder with its plant."""
    spec = folder / "specs" / "my_gate.yaml"
    shutil.copytree(ROOT / "specs" / "plants", spec.parent / "plants")
    text, _, _ = "".join(pieces("yaml")).partition("\nscenarios:\n")
    spec.write_text(text, encoding="utf-8")
    return spec


def test_the_changes_fit_and_what_comes_of_them_is_valid(tmp_path: Path) -> None:
    """The short form of the test below, without its commands."""
    spec = written(tmp_path)
    for kind, block in BLOCK.findall(TEXT):
        if kind == "diff":
            spec.write_text(changed(spec.read_text(encoding="utf-8"), block), encoding="utf-8")
    found = in_process("validate", spec, cwd=tmp_path, together=True)
    assert found.returncode == 0, found.stdout


@pytest.mark.long
def test_the_changes_fit_and_the_commands_answer_as_shown(tmp_path: Path) -> None:
    spec = written(tmp_path)
    for kind, block in BLOCK.findall(TEXT):
        if kind == "diff":
            spec.write_text(changed(spec.read_text(encoding="utf-8"), block), encoding="utf-8")
        for step in block.split("$ ")[1:]:
            command, _, shown = step.partition("\n")
            said = specc(command, tmp_path)
            assert re.fullmatch(pattern(shown), said), f"$ {command}\n{said}"
    verdicts = [specc(EXERCISE, tmp_path)]
    gives_up = "[opening, error,    always, closing]"
    text = spec.read_text(encoding="utf-8")
    assert gives_up in text
    spec.write_text(text.replace(gives_up, gives_up.replace("closing", "halting")))
    verdicts.append(specc(EXERCISE, tmp_path))
    assert ["\nviolated within" in said for said in verdicts] == [True, False]
    assert "\nmet within" in verdicts[1]
