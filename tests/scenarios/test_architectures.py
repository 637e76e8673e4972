"""Each architecture of section 5 fulfils its requirements, and seeded faults in it are found."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from specc.cli.main import main
from tests.scenarios.architectures import ARCHITECTURES, FOLDER, Architecture
from tests.scenarios.runs import copy_companions, run

EACH = pytest.mark.parametrize("each", ARCHITECTURES, ids=lambda each: each.name)


def explored(
    spec: Path, budget: int, capsys: pytest.CaptureFixture[str]
) -> list[dict[str, object]]:
    main(["explore", str(spec), "--budget", str(budget), "--format", "json"])
    findings: list[dict[str, object]] = json.loads(capsys.readouterr().out)["findings"]
    return findings


def fulfils(each: Architecture, seed: int) -> bool:
    """Whether a run meets all requirements, without a fault."""
    options = ("--duration", str(each.duration_s), "--seed", str(seed), "--check-operators")
    code, report = run(each.path, *options)
    assert report["requirements"]
    assert not report["faults"], report["faults"]
    verdicts = [each["verdict"] for each in report["requirements"]]
    assert (code == 0) == ("violated" not in verdicts)
    return verdicts == ["met"] * len(verdicts)


def test_every_architecture_is_in_the_table() -> None:
    assert {each.path for each in ARCHITECTURES} == set(FOLDER.glob("*.yaml"))
    assert all(each.duration_s <= 60 for each in ARCHITECTURES)
    assert all(len(each.path.read_text().splitlines()) <= 250 for each in ARCHITECTURES)


@EACH
def test_nothing_is_found_in_it(each: Architecture, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "--strict", str(each.path)]) == 0
    assert explored(each.path, each.budget, capsys) == []


@EACH
def test_a_run_meets_its_requirements(each: Architecture) -> None:
    assert fulfils(each, 0)


@pytest.mark.long
@EACH
def test_nine_of_ten_runs_meet_them(each: Architecture) -> None:
    assert sum(fulfils(each, seed) for seed in range(10)) >= 9


@EACH
def test_a_seeded_fault_is_found(
    each: Architecture, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "pyproject.toml").touch()  # the project whose files they are
    copy_companions(tmp_path)
    shutil.copytree(FOLDER, tmp_path / "architectures")
    spec = tmp_path / "architectures" / each.path.name
    text = spec.read_text(encoding="utf-8")
    for old, new in each.fault:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    spec.write_text(text, encoding="utf-8")
    found = [f for f in explored(spec, each.budget, capsys) if f["code"] == each.finds]
    assert found
    assert all(each["trace"] for each in found)
