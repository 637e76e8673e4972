"""docs/patterns.md: its files are complete, and its commands answer as it shows."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.docs.test_two_gates import changed, specc
from tests.docs.test_your_robot import FILE, pattern
from tests.house.tree import ROOT

TEXT = (ROOT / "docs" / "patterns.md").read_text(encoding="utf-8")
CHANGE_AND_ANSWER = re.compile(
    r"(?:^```diff\n(?P<change>(?:[-+].*\n)+)```\n\n(?:.*\n)*?)?"
    r"^```console\n\$ (?P<command>.*)\n(?P<shown>(?:.*\n)*?)```$",
    re.MULTILINE,
)
STEPS = list(CHANGE_AND_ANSWER.finditer(TEXT))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("patterns")
    shutil.copytree(ROOT / "specs" / "plants", folder / "plants")
    for file in FILE.finditer(TEXT):
        (folder / file["path"]).write_text(file["text"], encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "step",
    [
        # What runs nothing is quick.
        pytest.param(
            step,
            id=step["command"],
            marks=pytest.mark.long if re.search("pytest| run |pause", step["command"]) else (),
        )
        for step in STEPS
    ],
)
def test_a_command_answers_as_shown(step: re.Match[str], folder: Path) -> None:
    spec = folder / "estop.yaml"
    text = spec.read_text(encoding="utf-8")
    if step["change"]:
        spec.write_text(changed(text, step["change"]), encoding="utf-8")
    answer = specc(step["command"], folder)
    spec.write_text(text, encoding="utf-8")
    assert re.search(pattern(step["shown"]), answer), answer


def test_every_block_is_used() -> None:
    assert TEXT.count("```") == 2 * (
        len(STEPS) + len(FILE.findall(TEXT)) + sum(step["change"] is not None for step in STEPS)
    )
