"""`specc init`: every skeleton validates without a finding and runs in MuJoCo at once."""

import json
from pathlib import Path

import pytest

from specc.cli import main
from specc.cli.init import skeletons
from tests.seeds import every


def spec_in(folder: Path) -> Path:
    (spec,) = folder.glob("*.yaml")
    return spec


def test_there_is_a_choice() -> None:
    assert {"joint", "sense-act", "two-agents"} <= set(skeletons())


@pytest.mark.parametrize("name", every(4, list(skeletons())))
def test_a_skeleton_runs(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "robots" / name
    assert main(["init", str(folder), "--skeleton", name]) == 0
    assert str(spec_in(folder)) in capsys.readouterr().out
    assert main(["validate", "--strict", str(spec_in(folder))]) == 0
    assert main(["fmt", "--check", str(spec_in(folder))]) == 0
    report = tmp_path / "report.json"
    done = main(["run", str(spec_in(folder)), "--cycles", "2", "--report", str(report)])
    assert done == 0
    told = json.loads(report.read_text(encoding="utf-8"))
    assert told["faults"] == []
    assert [cycle["ended"] for cycle in told["cycles"]] == ["completed", "completed"]


@pytest.mark.parametrize("name", skeletons())
def test_every_step_of_a_skeleton_is_done(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["init", str(tmp_path), "--skeleton", name])
    capsys.readouterr()
    assert main(["status", str(spec_in(tmp_path))]) == 0
    assert capsys.readouterr().out.endswith("\nevery step is done\n")


@pytest.mark.long
@pytest.mark.parametrize("name", skeletons())
def test_a_skeleton_has_two_scenarios_that_pass(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["init", str(tmp_path), "--skeleton", name])
    assert f"specc test {spec_in(tmp_path)}\n" in capsys.readouterr().out
    assert main(["test", str(spec_in(tmp_path)), "--jobs", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[-2:]] == ["passed", "passed"]


def test_nothing_is_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init"]) == 0
    assert (tmp_path / "joint.yaml").is_file()


def test_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "plants").mkdir()
    mine = tmp_path / "plants/joint.xml"
    mine.write_text("mine")
    assert main(["init", str(tmp_path)]) == 2
    assert str(mine) in capsys.readouterr().err
    assert mine.read_text() == "mine"
    assert not (tmp_path / "joint.yaml").exists()


def test_an_unknown_skeleton(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", str(tmp_path), "--skeleton", "joints"]) == 2
    assert "joint" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["taken"], "taken is a file"),
        ([""], "the directory has no name"),
        (["new", "--skeleton", "joimt"], "did you mean joint? there are arm, joint"),
        (["new", "--skeleton", "zzz"], "there are arm, joint"),
    ],
)
def test_what_cannot_be_started_is_said(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("mine")
    assert main(["init", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_nothing_is_left_behind_if_a_file_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "plants").write_text("a file where a directory has to be")
    assert main(["init", str(tmp_path)]) == 2
    assert "cannot write" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["plants"]
