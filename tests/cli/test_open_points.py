"""Open points fail nothing but `--strict`; each command refuses those that it needs."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from specc.cli import main

pytestmark = pytest.mark.usefixtures("pipeline")


@pytest.fixture
def specs(workspace: Path) -> None:
    (workspace / "early.yaml").write_text("system: early\nrateless: 1\n")
    (workspace / "unplanted.yaml").write_text("system: unplanted\nplantless: 1\n")


@pytest.mark.usefixtures("specs")
def test_validate_counts_them_apart(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "early.yaml", "unplanted.yaml", "wrong.yaml"]) == 1
    shown = capsys.readouterr().err
    assert shown.splitlines()[-1] == "3 files checked: 1 error, 0 warnings, 2 open points"
    assert "open[O0601]: key rateless" in shown
    assert main(["validate", "early.yaml"]) == 0
    assert main(["validate", "early.yaml", "--strict"]) == 1


@pytest.mark.usefixtures("specs")
def test_build_refuses_what_it_needs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "early.yaml"]) == 1
    assert not Path("generated/early").exists()
    assert "open[O0601]" in capsys.readouterr().err
    assert main(["build", "unplanted.yaml"]) == 0
    assert Path("generated/unplanted").is_dir()


@pytest.mark.usefixtures("specs")
def test_run_needs_a_plant(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "unplanted.yaml", "--duration", "1"]) == 1
    assert "open[O0501]" in capsys.readouterr().err


@pytest.mark.usefixtures("specs")
def test_formats(capsys: pytest.CaptureFixture[str]) -> None:
    printed = {}
    for form in ("json", "sarif", "github", "junit"):
        assert main(["validate", "early.yaml", "--format", form]) == 0
        printed[form] = capsys.readouterr().out
    data = json.loads(printed["json"])
    assert data["summary"]["open_points"] == 1
    assert data["diagnostics"][0]["severity"] == "open"
    run = json.loads(printed["sarif"])["runs"][0]
    assert run["results"][0]["level"] == "note"
    assert run["tool"]["driver"]["rules"][0]["defaultConfiguration"] == {"level": "note"}
    assert printed["github"].startswith("::notice file=early.yaml,")
    suite = ElementTree.fromstring(printed["junit"])
    assert suite.get("failures") == "0"
    assert "O0601" in (suite.findtext(".//system-out") or "")


def test_an_open_point_cannot_be_ignored(workspace: Path) -> None:
    with pytest.raises(SystemExit):
        main(["validate", "good.yaml", "--ignore", "O0601"])
