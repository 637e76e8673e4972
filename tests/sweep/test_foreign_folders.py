"""Folders of sweeps as strangers might make them: data, that leads nowhere else."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from specc.cli import sweep
from specc.cli.main import main
from specc.tools.sweep import summary
from tests.recording.test_foreign_code import TALK
from tests.sweep import hostile

COMMAND = ["sweep", "talk.yaml", "--seeds=0:2", "--duration=1", "--out=runs"]
ODD: list[Any] = [
    *("x", "=cmd()", "\x1b]0;own\x07\n::error::own", "a" * 5000, 1e308, 10**400, -1, True, None),
    *([], {}, [[1]], {"a": {"b": 1}}, float("nan"), float("inf"), "../../own", "\udc80", ""),
]


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that the sweep would go on with."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    Path("talk.yaml").write_text(TALK)
    with monkeypatch.context() as patched:
        patched.setattr(sweep, "_run", lambda *_: 0)
        assert main(COMMAND) == 0
    (Path("runs") / "runs.jsonl").unlink()
    Path("runs/runs.csv").unlink()
    return Path("runs")


def test_links_are_refused(runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Else pictures elsewhere would be removed, and files elsewhere be written."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "mine.png").write_bytes(b"mine")
    (outside / "mine.txt").write_bytes(b"mine")
    for name in ("plots", ".work", "runs.jsonl", "runs.csv", "summary.csv"):
        for target in (outside, outside / "mine.txt", outside / "new"):
            (runs / name).symlink_to(target)
            assert main(COMMAND) == 2
            told = capsys.readouterr().err
            assert f"{name} is a link or no file" in told
            (runs / name).unlink()
    os.mkfifo(runs / "runs.jsonl")
    assert main(COMMAND) == 2 and "runs.jsonl is a link or no file" in capsys.readouterr().err
    assert sorted(path.name for path in outside.iterdir()) == ["mine.png", "mine.txt"]


@pytest.mark.long
def test_rows_are_data(runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever stands in them becomes a table, or is refused; nothing is printed raw."""
    before = {path for path in tmp_path.rglob("*") if runs.resolve() not in path.parents}
    others = ("ended", "simulated_s", "wall_s", "../own", "cycle.a", "\x1b[2J")
    for keys in (("success", "reason"), others):
        for odd in ODD:
            rows = [
                {
                    "set": {},
                    "seed": seed,
                    "run": {"success": True, "reason": ""} | dict.fromkeys(keys, value),
                }
                for seed, value in enumerate((odd, 1.0))
            ]
            text = "\n".join(map(json.dumps, rows)) + "\n"
            (runs / "runs.jsonl").write_text(text)
            code = main(COMMAND)
            out, err = capsys.readouterr()
            assert code in (0, 2), (keys, odd, err)
            assert not {"\x1b", "\x07"} & {*out, *err} and "\n::" not in out + err
    after = {path for path in tmp_path.rglob("*") if runs.resolve() not in path.parents}
    assert after == before


@pytest.fixture
def begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    hostile.begun("--seeds=0:1")


@pytest.mark.long
@pytest.mark.usefixtures("begun")
def test_a_table_out_of_proportion_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """Every row has a field for each column, whichever run has it."""
    hostile.put(hostile.of_one_run())
    assert main([*hostile.COMMAND, "--seeds=0:1000"]) == 2
    assert "runs.jsonl: 1000 runs with 60002 columns" in capsys.readouterr().err
    assert main([*hostile.COMMAND, "--seeds=0:2"]) == 0
    assert "2 runs" in capsys.readouterr().out


@pytest.mark.long
@pytest.mark.usefixtures("begun")
def test_what_is_told_and_drawn_of_a_folder_is_bounded(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(summary, "MOST", 2)
    long = "long " * 50_000
    for k in (1, 2):
        figures = {long: k, "success": False, "reason": long, "b": k, "c": k}
        hostile.put([*hostile.LOG.read_text().splitlines(), hostile.line(0, figures, k=str(k))])
    assert main([*hostile.COMMAND, "--set=k=1,2", "--seeds=0:1"]) == 0
    out = capsys.readouterr().out
    assert "no plots of 2 other columns: runs/summary.csv" in out and len(out) < 2000
    assert len(list(Path("runs/plots").iterdir())) == 4
    Path("runs/sweep.json").write_text(json.dumps(dict.fromkeys(map(str, range(1000)))))
    assert main([*hostile.COMMAND, "--seeds=0:1"]) == 2
    assert len(capsys.readouterr().err) < 300


@pytest.mark.long
@pytest.mark.usefixtures("begun")
def test_hostile_folders(capsys: pytest.CaptureFixture[str]) -> None:
    for name, (arguments, lines) in hostile.HOSTILE.items():
        hostile.put(lines())
        assert hostile.LOG.stat().st_size > 800_000, name
        assert main([*hostile.COMMAND, *arguments]) in (0, 2), name
        told = capsys.readouterr()
        assert len(told.out + told.err) < 5000, name
