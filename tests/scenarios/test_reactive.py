"""How long the three loops of specs/architectures/reactive.yaml take, and what `ages` says."""

from __future__ import annotations

import json
import re

import pytest

from specc.cli.main import main
from tests.scenarios.architectures import FOLDER
from tests.scenarios.runs import ROOT, run
from tests.seeds import short

PAGE = (ROOT / "docs/architectures.md").read_text(encoding="utf-8")
SPEC = FOLDER / "reactive.yaml"
LIMITS = {"blind": "reflex", "wary": "reaction", "guided": "guidance"}
"""Rover -> the constant that its requirement allows."""
LEAST_MS = {"blind": 10, "wary": 80, "guided": 340}
"""The periods on the way: 10; 20, 50 and 10; 20, 50, 200, 50 and 10, begun when they can be."""


def ages_ms(capsys: pytest.CaptureFixture[str]) -> dict[str, int]:
    """Age of what the wheels are told, for each rover."""
    assert main(["ages", str(SPEC), "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)["values"]
    told = [row for row in rows if row["element"] == "m_d"]
    return {row["reader"].split(".")[0]: round(1000 * row["age_s"]) for row in told}


def violated(*options: str, seconds: int = 20) -> list[str]:
    """The constants in the requirements that a run violates."""
    _, report = run(SPEC, "--duration", str(seconds), *options)
    found = [r["that"] for r in report["requirements"] if r["verdict"] == "violated"]
    return [name for name in LIMITS.values() if any(f"({name}," in that for that in found)]


@pytest.mark.parametrize("seconds", short([8, 20]))
def test_each_reacts_within_the_age_of_what_it_acts_on(
    seconds: int, capsys: pytest.CaptureFixture[str]
) -> None:
    ages = ages_ms(capsys)
    assert ages["blind"] < ages["wary"] < ages["guided"]
    rows = [f"| `{rover}` |.* | {LEAST_MS[rover]} ms | {age} ms |" for rover, age in ages.items()]
    assert all(re.search(row.replace("|", r"\|"), PAGE) for row in rows)
    exact = [f"--set={LIMITS[rover]}={age}[ms]" for rover, age in ages.items()]
    assert violated(*exact, seconds=seconds) == []


@pytest.mark.long
def test_no_loop_is_faster_than_its_periods() -> None:
    sooner = [f"--set={LIMITS[rover]}={least - 10}[ms]" for rover, least in LEAST_MS.items()]
    assert violated(*sooner) == list(LIMITS.values())
