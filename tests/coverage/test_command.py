"""`specc coverage`: its output, its gaps at their lines, its exit codes, and what it refuses."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest

from specc.diagnostics.code import all_codes
from tests.commands import ROOT, specc

RECORDED = ROOT / "tests/recording/conveyor_gate.mcap"
CONVEYOR = ROOT / "specs/conveyor_gate.yaml"
FASTER = 'cruise: {is: "0.5[rad/s]"', 'cruise: {is: "0.6[rad/s]"'
NOT_TAKEN = {
    "idle terminal hold_asked -> holding",
    "holding error always -> alarm",
    "alarm terminal go_asked -> running",
    "alarm terminal hold_asked -> holding",
    "opening error always -> closing",
    "closing error always -> opening",
}


def items_of(*arguments: object) -> list[dict[str, Any]]:
    printed = specc("coverage", *arguments, "--format", "json")
    assert printed.returncode == 0, printed.stderr
    return list(json.loads(printed.stdout)["items"])


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    """A copy of the conveyor in a project of its own, with other texts in it."""
    text = CONVEYOR.read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "plants").mkdir(parents=True)
    shutil.copy(ROOT / "specs/plants/conveyor_gate.xml", folder / "plants")
    (folder / "conveyor_gate.yaml").write_text(text, encoding="utf-8")
    return folder / "conveyor_gate.yaml"


def run(spec: Path, file: Path, duration_s: float = 0.2) -> Path:
    done = specc("run", spec, "--duration", duration_s, "--record", file)
    assert done.returncode == 0, done.stderr
    return file


def test_a_table_and_the_gaps_are_printed() -> None:
    printed = specc("coverage", RECORDED)
    lines = printed.stdout.splitlines()
    assert printed.returncode == 0
    assert lines[0] == "1 run, 6 s"
    assert lines[2].split() == ["belt.c", "3/4", "3/7", "9/12", "3/3"]
    assert "all in all: 82.8 % (53/64)" in lines
    gaps = [line for line in lines if line.startswith("W")]
    rows = {re.findall("`(.+?)`", line)[0] for line in gaps if "no run takes row" in line}
    assert rows == NOT_TAKEN
    assert all(line.startswith("W1102 specs/conveyor_gate.yaml:") for line in gaps)


def test_rows_that_exploring_reaches_are_named() -> None:
    lines = specc("coverage", RECORDED, "--spec", CONVEYOR).stdout.splitlines()
    rows = {re.findall("`(.+?)`", each)[0]: each for each in lines if "no run takes row" in each}
    assert rows.keys() == NOT_TAKEN
    closed = rows.pop("idle terminal hold_asked -> holding")
    # The gate is closed at first, lets the belt run, and asks it to hold only then.
    assert closed.startswith("W1102") and "there is no way to it" in closed
    for line in rows.values():
        assert line.startswith("W1101") and "finds a way to it" in line


def test_without_steps_nothing_is_explored() -> None:
    printed = specc("coverage", RECORDED, "--spec", CONVEYOR, "--budget", 0)
    assert printed.stdout.startswith("1 run") and "W1101" not in printed.stdout


def test_annotations_stand_at_the_lines_of_the_gaps() -> None:
    printed = specc("coverage", RECORDED, "--format", "github")
    lines = CONVEYOR.read_text(encoding="utf-8").splitlines()
    found = re.findall(
        r"^::warning file=specs/conveyor_gate.yaml,line=(\d+),.*::(.*)$",
        printed.stdout,
        re.MULTILINE,
    )
    assert len(found) == len(printed.stdout.splitlines()) == 11
    for number, message in found:
        words = re.findall("`(.+?)`", message)[0].split()
        assert {words[0], words[-1]} <= set(re.findall(r"\w+", lines[int(number) - 1]))


@pytest.mark.parametrize(("least", "code"), [("82.8", 0), ("82.9", 1), ("0", 0), ("100", 1)])
def test_too_little_is_an_exit_code(least: str, code: int) -> None:
    printed = specc("coverage", RECORDED, "--fail-under", least)
    assert printed.returncode == code
    assert bool(printed.stderr) is bool(code)


@pytest.mark.parametrize("least", ["101", "-1", "nan", "much"])
def test_a_percentage_is_asked_for(least: str) -> None:
    printed = specc("coverage", RECORDED, f"--fail-under={least}")
    assert printed.returncode == 2
    assert "is not a percentage from 0 to 100" in printed.stderr


def test_runs_count_together(tmp_path: Path) -> None:
    """Of a recording that is named twice there is one run."""
    copy = shutil.copy(RECORDED, tmp_path)
    once, twice = items_of(RECORDED, RECORDED), items_of(RECORDED, copy)
    assert [2 * item.pop("count") for item in once] == [item.pop("count") for item in twice]
    assert once == twice


@pytest.mark.long
def test_another_run_fills_gaps_and_makes_none(tmp_path: Path) -> None:
    stuck = tmp_path / "stuck.mcap"
    specc("run", CONVEYOR, "--set", "patience=0.3[s]", "--duration", 4, "--record", stuck)
    first, both = (
        {
            (i["kind"], i["subsystem"], i["name"], i.get("truth")): i["count"]
            for i in items_of(*files)
        }
        for files in ([RECORDED], [RECORDED, stuck])
    )
    assert first.keys() == both.keys()
    assert all(count <= both[key] for key, count in first.items())
    gap = "row", "gate.c", "opening error always -> closing", None
    assert not first[gap] and both[gap]


@pytest.mark.long
@pytest.mark.no_replay("nothing but the beginnings of runs")
def test_recordings_of_different_specifications_are_refused(tmp_path: Path) -> None:
    rovers = run(ROOT / "specs/rovers.yaml", tmp_path / "rovers.mcap")
    printed = specc("coverage", RECORDED, rovers)
    assert (printed.returncode, printed.stdout) == (2, "")
    assert "of rovers, not conveyor_gate" in printed.stderr
    other = changed(tmp_path / "other", FASTER)
    faster = run(other, tmp_path / "faster.mcap")
    printed = specc("coverage", RECORDED, faster)
    assert (printed.returncode, printed.stdout) == (2, "")
    assert "they differ in constant `cruise`" in printed.stderr
    assert specc("coverage", faster, "--spec", other, "--budget", 0).returncode == 0


REORDERED = [
    ("# Two agents at", "# Both agents at"),
    (
        "        - [idle,    terminal, go_asked,   running]\n"
        "        - [idle,    terminal, hold_asked, holding]\n",
        "        - [idle,    terminal, hold_asked, holding]\n"
        "        - [idle,    terminal, go_asked,   running]\n",
    ),
]


@pytest.mark.long
def test_comments_order_and_circumstances_may_have_changed(tmp_path: Path) -> None:
    spec = changed(tmp_path / "other", *REORDERED)
    printed = specc("coverage", RECORDED, "--spec", spec, "--budget", 0)
    assert printed.returncode == 0, printed.stderr
    assert printed.stdout.splitlines()[:10] == specc("coverage", RECORDED).stdout.splitlines()[:10]
    row = "`idle terminal hold_asked -> holding`"
    assert re.search(rf"conveyor_gate.yaml:63: no run takes row {row}", printed.stdout)


@pytest.mark.long
def test_a_specification_that_has_changed_is_refused(tmp_path: Path) -> None:
    spec = changed(tmp_path / "other", FASTER)
    printed = specc("coverage", RECORDED, "--spec", spec)
    assert (printed.returncode, printed.stdout) == (2, "")
    assert "they differ in constant `cruise`" in printed.stderr
    printed = specc("coverage", RECORDED, "--spec", ROOT / "specs/rovers.yaml")
    assert (printed.returncode, printed.stdout) == (2, "")


@pytest.mark.long
@pytest.mark.no_replay("nothing but the beginning of a run")
def test_a_folder_stands_for_the_recordings_in_it(tmp_path: Path) -> None:
    """Each counts once, however often it is named."""
    done = specc("coverage", tmp_path)
    assert done.returncode == 2 and "has no recordings, *.mcap; `specc run --record`" in done.stderr
    for name in ("a.mcap", "b.mcap"):
        shutil.copy(RECORDED, tmp_path / name)
    (tmp_path / "c.txt").write_text("no recording")
    done = specc("coverage", tmp_path, tmp_path / "a.mcap")
    assert done.returncode == 0 and done.stdout.startswith("2 runs, 12 s\n")


def test_a_file_that_cannot_be_read_is_wrong_usage(tmp_path: Path) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text("specc: 1\n")
    for spec, code in ((tmp_path / "none.yaml", 2), (tmp_path, 2), (broken, 1)):
        done = specc("coverage", RECORDED, "--spec", spec)
        assert done.returncode == code and "error[" in done.stderr and not done.stdout


def test_comments_leave_gaps_out_of_the_count(tmp_path: Path) -> None:
    row = "- [idle,    terminal, hold_asked, holding]"
    spec = changed(tmp_path / "other", (row, f"{row} # specc: ignore[W1102] for others"))
    file = run(spec, tmp_path / "run.mcap")
    items = items_of(file)
    (ignored,) = [item for item in items if item["ignored"]]
    assert ignored["name"] == "idle terminal hold_asked -> holding"
    content = json.loads(specc("coverage", file, "--format", "json").stdout)
    assert content["all"]["of"] == len(items) - 1
    assert "idle terminal hold_asked" not in specc("coverage", file).stdout
    assert specc("validate", "--strict", spec).returncode == 0, (
        "the comment is no concern of others"
    )


@pytest.mark.long
@pytest.mark.no_replay("nothing but the beginning of a run")
def test_it_does_not_matter_from_where_it_is_called(tmp_path: Path) -> None:
    """Files that the recorded specification names are not looked for."""
    file = run(ROOT / "specs/examples/tray_cell.yaml", tmp_path / "run.mcap")
    here, there = (specc("coverage", file, cwd=folder) for folder in (ROOT, tmp_path))
    assert here.returncode == 0
    assert (here.stdout, here.stderr) == (there.stdout, there.stderr)


@pytest.mark.long
def test_what_is_left_of_a_cut_recording_counts(tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    content = RECORDED.read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    printed = specc("coverage", cut)
    assert printed.returncode == 3
    assert "cut" in printed.stderr
    assert "1 run, " in printed.stdout
    assert printed.stdout.count("as far as recordings say, some of which were cut") == 2


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    for file in (CONVEYOR, tmp_path / "none.mcap", tmp_path):
        printed = specc("coverage", RECORDED, file)
        assert (printed.returncode, printed.stdout) == (2, "")
        assert str(file) in printed.stderr


@pytest.mark.long
@pytest.mark.no_replay("nothing but the beginnings of runs")
@pytest.mark.parametrize("code", ["W1101", "W1102"])
def test_the_examples_of_codes(code: str, tmp_path: Path) -> None:
    page = all_codes()[code]
    for number, (example, is_found) in enumerate([(page.failing, True), (page.passing, False)]):
        folder = tmp_path / str(number)
        folder.mkdir()
        commands = [line.removeprefix("$ specc ") for line in example.splitlines()]
        *_, last = [specc(*shlex.split(words), cwd=folder) for words in commands]
        assert last.returncode == 0, last.stderr
        assert (code in last.stdout) is is_found
