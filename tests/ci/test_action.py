"""What GitHub Actions and pre-commit run, run by hand."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from specc.cli import main
from specc.read import read_file
from tests.policy.specs import write
from tests.tools.scenarios.belt import scenario, spec

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "tests/diagnostics/sarif-2.1.0.json"


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    folder = tmp_path / "repo"
    write(folder / "a spec.yaml")
    bad = write(folder / "b.yaml")
    bad.write_text(bad.read_text().replace("S0: work}", "S0: wrk}"))
    program = tmp_path / "specc"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m specc "$@"\n')
    program.chmod(0o755)
    return folder


def validate(
    folder: Path, script: str = "validate", **inputs: str
) -> subprocess.CompletedProcess[str]:
    environment = {
        **{key: value for key, value in os.environ.items() if not key.startswith("GITHUB_")},
        "PYTHONPATH": str(ROOT),
        "GITHUB_OUTPUT": str(folder.parent / "output"),
        "GITHUB_STEP_SUMMARY": str(folder.parent / "summary"),
        **{f"SPECC_{name.upper()}": value for name, value in inputs.items()},
    }
    command = [str(ROOT / ".ci" / script), str(folder.parent / "specc")]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_findings_are_annotations_and_fail_the_step(repository: Path) -> None:
    done = validate(repository, paths=".")
    assert done.returncode == 1
    assert "::error file=b.yaml,line=12," in done.stdout
    assert done.stdout.count("::warning file=a spec.yaml,") == 2
    assert "2 files checked: 1 error" in (repository.parent / "summary").read_text()


@pytest.mark.long
def test_paths_and_arguments_are_one_a_line(repository: Path) -> None:
    assert validate(repository, paths="a spec.yaml").returncode == 0
    done = validate(repository, paths="a spec.yaml\n\n", arguments="--strict\n--ignore\nW0611\n")
    assert (done.returncode, done.stdout) == (0, "")
    assert validate(repository, paths="a spec.yaml", arguments="--strict").returncode == 1


@pytest.mark.long
def test_a_sarif_file_that_follows_the_schema_is_left_behind(repository: Path) -> None:
    assert validate(repository, sarif="specc.sarif").returncode == 1
    log = json.loads((repository / "specc.sarif").read_text())
    jsonschema.validate(log, json.loads(SCHEMA.read_text()))
    assert {result["ruleId"] for result in log["runs"][0]["results"]} >= {"E0201", "W0611"}
    assert (repository.parent / "output").read_text() == "sarif=specc.sarif\n"


def test_wrong_usage_fails_the_step(repository: Path) -> None:
    assert validate(repository, paths="b.yaml", arguments="--nonsense").returncode == 2


@pytest.mark.long
def test_scenarios_that_fail_fail_the_step(repository: Path) -> None:
    belt = spec(repository, scenario("whole", "always(desk.c.v < 1[m/s])"), name="belt")
    assert validate(repository, "test", test="").stdout == ""
    done = validate(repository, "test", test="belt.yaml\n", junit="all.xml")
    assert done.returncode == 0 and "passed  whole" in done.stdout
    assert "passed  whole" in (repository.parent / "summary").read_text()
    assert 'name="whole"/>' in (repository / "all.xml").read_text()
    belt.write_text(belt.read_text().replace("desk.c.v < 1[m/s]", "desk.c.v < 0.1[m/s]"))
    assert validate(repository, "test", test="belt.yaml").returncode == 1
    assert (repository / "specc-test/whole-0.mcap").is_file()


def test_the_action_gives_its_inputs_to_its_scripts() -> None:
    action: Any = read_file(str(ROOT / "action.yml")).data
    steps = action["runs"]["steps"]
    used = " ".join(str(value) for step in steps for value in step["env"].values())
    assert set(re.findall(r"inputs\.(\w+)", used)) == action["inputs"].keys()
    for step in steps:
        script = shlex.split(step["run"])[0].removeprefix("$GITHUB_ACTION_PATH/")
        assert os.access(ROOT / script, os.X_OK)
        names = set(re.findall(r"\$\{(\w+)[:}]", (ROOT / script).read_text()))
        assert step["env"].keys() <= names


def test_the_hooks_run_what_exists(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.yaml")
    hooks: Any = read_file(str(ROOT / ".pre-commit-hooks.yaml")).data
    assert [hook["id"] for hook in hooks] == ["specc-validate", "specc-fmt"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for hook in hooks:
        program, *command = shlex.split(hook["entry"])
        assert program in project["scripts"]
        assert hook["pass_filenames"] is False
        assert main([*command, *hook["args"]]) == 0
        assert re.search(hook["files"], "specs/a.yaml")
    assert hooks[0]["additional_dependencies"] == project["optional-dependencies"]["proof"]
    capsys.readouterr()
