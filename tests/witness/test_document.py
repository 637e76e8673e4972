"""What docs/witness.md shows is what the command does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from specc_runtime.faults import UndecidedTransition

from specc.cli import main
from specc.tools.witness.subject import CODES
from tests.witness.runs import ROOT, run

DOCUMENT = (ROOT / "docs" / "witness.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (found,) = re.findall(rf"^```{language}\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    return str(found)


def without_assumptions() -> str:
    text = (ROOT / "specs" / "conveyor_gate.yaml").read_text(encoding="utf-8")
    start, end = text.index("      assume:\n"), text.index("\n\n  gate:")
    return text[:start].rstrip() + text[end:]


def test_the_example(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("my_gate.yaml").write_text(without_assumptions(), encoding="utf-8")
    (tmp_path / "plants").symlink_to(ROOT / "specs" / "plants")
    command, shown = block("console").split("\n", 1)
    assert main(command.split()[2:]) == 1
    assert capsys.readouterr().err == shown
    (scenario,) = Path("witnesses").glob("*.py")
    assert scenario.read_text(encoding="utf-8") == block("python")
    error = run(scenario.resolve(), tmp_path)
    assert isinstance(error, UndecidedTransition)
    lines = [f"{type(error).__name__}: {error}", *error.__notes__]
    assert "".join(f"{line}\n" for line in lines) == block("text")


def test_the_codes_are_those_that_can_be_asked_for() -> None:
    rows = [line for line in DOCUMENT.splitlines() if re.match(r"\| [EW]\d", line)]
    assert set(CODES) == {code for row in rows for code in re.findall(r"[EW]\d{4}", row)}
