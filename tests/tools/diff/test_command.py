"""`specc diff` on the command line: formats and exit codes."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from specc.cli.main import main
from tests.tools.diff.conftest import BASE, edited

CHANGED = edited(
    ("rate: 20 Hz", "rate: 25 Hz"),
    ("unsent: not fresh(x.desk.order)", "unsent: fresh(x.desk.mode)"),
    ("W: world", "W: the |hall|"),
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.yaml").write_text(BASE)
    (tmp_path / "new.yaml").write_text(CHANGED)
    (tmp_path / "reworded.yaml").write_text(edited(("W: world", "W: hall")))
    (tmp_path / "broken.yaml").write_text(edited(("near_goal: d < gap", "near_goal: d < gup")))
    return tmp_path


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("old.yaml", "old.yaml", 0),
        ("old.yaml", "reworded.yaml", 0),
        ("old.yaml", "new.yaml", 1),
        ("old.yaml", "broken.yaml", 1),
        ("none.yaml", "old.yaml", 2),
    ],
)
@pytest.mark.usefixtures("folder")
def test_exit_codes(old: str, new: str, code: int) -> None:
    assert main(["diff", old, new]) == code


@pytest.mark.usefixtures("folder")
def test_text(capsys: pytest.CaptureFixture[str]) -> None:
    main(["diff", "old.yaml", "new.yaml"])
    assert capsys.readouterr().out == (
        "cart.c\n"
        "  ~ subsystem: rate changed\n"
        "      old: 20 Hz\n"
        "      new: 25 Hz\n"
        "  ~ initial condition unsent: meaning changed\n"
        "      old: not fresh(x.desk.order)\n"
        "      new: fresh(x.desk.mode)\n"
        "      only the old one holds when fresh(x.desk.order) is false, "
        "fresh(x.desk.mode) is false\n"
        "      only the new one holds when fresh(x.desk.order) is true, "
        "fresh(x.desk.mode) is true\n"
        "\n"
        "without a change of meaning:\n"
        "\n"
        "system\n"
        "  ~ frame W changed\n"
        "      old: world\n"
        "      new: the |hall|\n"
        "\n"
        "old.yaml -> new.yaml: 2 differences, 1 remark\n"
    )


@pytest.mark.usefixtures("folder")
def test_markdown(capsys: pytest.CaptureFixture[str]) -> None:
    main(["diff", "old.yaml", "new.yaml", "--format", "markdown"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "## old.yaml → new.yaml"
    assert "| subsystem: rate changed | `20 Hz` | `25 Hz` |  |" in lines
    assert "| frame W changed | `world` | `the \\|hall\\|` |  |" in lines
    assert "<summary>1 change without a change of meaning</summary>" in lines


def test_what_changed_in_all_copies_of_a_description_is_told_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    specs = Path(__file__).parents[3] / "specs"
    new = Path(shutil.copytree(specs, tmp_path / "specs"))
    rover = new / "parts" / "rover.yaml"
    rover.write_text(rover.read_text().replace("rate: 10 Hz", "rate: 20 Hz"))
    assert main(["diff", str(specs / "rovers.yaml"), str(new / "rovers.yaml")]) == 1
    told = capsys.readouterr().out
    assert told.startswith("rovers_1.c, rovers_2.c, rovers_3.c, rovers_4.c\n  ~ subsystem: rate")
    assert told.count("rate changed") == 1
    assert told.endswith(": 4 differences, 0 remarks\n")


@pytest.mark.usefixtures("folder")
def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    main(["diff", "old.yaml", "new.yaml", "--format", "json"])
    found = json.loads(capsys.readouterr().out)
    assert found["version"] == 1
    assert found["equal"] is False
    rate, condition = found["differences"]
    assert (rate["where"], rate["part"], rate["aspect"]) == ("cart.c", "subsystem", "rate")
    assert condition["only_old"] == [
        {"fact": "fresh(x.desk.order)", "value": "false"},
        {"fact": "fresh(x.desk.mode)", "value": "false"},
    ]
    assert [remark["part"] for remark in found["remarks"]] == ["frame"]


@pytest.mark.usefixtures("folder")
def test_errors_of_either_file_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", "broken.yaml", "old.yaml", "--format", "json"]) == 1
    shown = json.loads(capsys.readouterr().out)["diagnostics"]
    assert "O0205" in {each["code"] for each in shown}
    assert any("did you mean `gap`" in each["help"] for each in shown)
