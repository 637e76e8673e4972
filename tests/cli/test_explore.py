"""`specc explore`: what goes wrong between machines."""

import itertools
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from specc.cli.progress import grouped
from specc.tools.explore.composition import Composition, Configuration

ROOT = Path(__file__).resolve().parents[2]
CASES = ROOT / "tests/explore/cases"
CONVEYOR = str(ROOT / "specs/conveyor_gate.yaml")


@pytest.mark.long
def test_the_flagship_is_explored_completely(capsys: pytest.CaptureFixture[str]) -> None:
    spec = str(ROOT / "specs/irp_picking.yaml")
    assert main(["explore", spec, "--format", "json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["findings"] == []
    assert all(each["complete"] for each in data["slices"])
    assert {name for each in data["slices"] for name in each["machines"]} == {
        "irp.c", "irp.m", "irp.g", "irp.k",
    }  # fmt: skip
    assert [(a["subsystem"], a["verdict"]) for a in data["assumptions"]] == [("irp.m", "proved")]


@pytest.mark.parametrize(
    "spec", sorted(ROOT.glob("specs/skeletons/*/*.yaml")), ids=lambda s: s.stem
)
def test_skeletons_have_no_finding(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explore", str(spec)]) == 0
    said = capsys.readouterr()
    assert "all in all: complete" in said.out
    assert "0 errors, 0 warnings" in said.err


@pytest.mark.long
def test_the_example_of_the_documentation(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = (ROOT / "docs/explore.md").read_text(encoding="utf-8")
    example = re.search(r"\$ specc explore (\S+)\n(.*?)```", shown, re.DOTALL)
    assert example
    monkeypatch.chdir(ROOT)
    assert main(["explore", example[1]]) == 0
    said = capsys.readouterr()
    assert said.out + said.err == example[2]


def test_what_every_run_comes_to_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explore", str(CASES / "lost-start.yaml")]) == 1
    said = capsys.readouterr().err
    assert "error[W1005]: `x.panel.start` is lost: `drive.c` does not look at it in" in said
    assert "0.1 s: `panel.c` from `pressing` to `pressed`" in said


def test_what_rests_on_measurements_is_a_warning(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explore", str(CASES / "wait-value.yaml"), "--format", "json"]) == 0
    (finding,) = json.loads(capsys.readouterr().out)["findings"]
    assert finding["code"] == "W1003"
    assert not finding["decided"]
    assert finding["rests_on"] == ["`seen` in `client.c`"]
    assert {step["subsystem"] for step in finding["trace"]} == {"client.c", "server.c"}


def test_a_small_budget_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explore", CONVEYOR, "--budget", "5"]) == 0
    said = capsys.readouterr().out
    assert "belt.c, gate.c: ended at the bound after" in said
    assert said.endswith("not everything was explored in 5 steps: --budget allows for more\n")
    assert main(["explore", str(CASES / "wait-value.yaml")]) == 0
    assert "--budget" not in capsys.readouterr().out


def test_what_lacks_memory_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def exhausted(self: Composition, here: Configuration) -> Any:
        raise MemoryError

    monkeypatch.setattr(Composition, "successors", exhausted)
    assert main(["explore", CONVEYOR]) == 0
    said = capsys.readouterr().out
    assert "belt.c, gate.c: out of memory after 1 state, 0 s into the runs" in said
    assert said.count(": not explored") == 3
    assert "--budget" not in said


@pytest.mark.parametrize("after", [0, 1, 5])
def test_ctrl_c_leaves_what_was_found(
    after: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The rest is said not to be explored, of the requirements too."""
    following, calls = Composition.successors, itertools.count()

    def interrupted(self: Composition, here: Configuration) -> Any:
        if next(calls) == after:
            raise KeyboardInterrupt
        return following(self, here)

    monkeypatch.setattr(Composition, "successors", interrupted)
    assert main(["explore", CONVEYOR]) == 130
    said = capsys.readouterr()
    assert "belt.c, gate.c: interrupted after" in said.out
    assert "belt.c: assumption `not (fresh(x.gate.go) and fresh(x.gate.hold))`: not" in said.out
    assert said.out.count(": not explored") == 3
    assert said.err.endswith("0 errors, 0 warnings\nspecc: interrupted\n")


def test_comments_and_options_hide_findings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (CASES / "lost-start.yaml").read_text(encoding="utf-8")
    assert "states: {warming" in text
    spec = tmp_path / "spec.yaml"
    spec.write_text(text, encoding="utf-8")
    assert main(["explore", str(spec), "--ignore", "W10"]) == 0
    line = next(line for line in text.splitlines() if "states: {warming" in line)
    meant = f"{line} # specc: ignore[W1005] it is pressed again"
    spec.write_text(text.replace(line, meant), encoding="utf-8")
    assert main(["explore", str(spec)]) == 0
    assert "1 ignored" in capsys.readouterr().err
    assert main(["validate", "--strict", str(spec)]) == 0
    weak = str(CASES / "wait-value.yaml")
    assert main(["explore", weak, "--strict"]) == 1


@pytest.mark.parametrize("budget", ["0", "-1", "1e9", "99999999999", "two"])
def test_budgets_that_are_none(budget: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["explore", CONVEYOR, f"--budget={budget}"])
    assert ended.value.code == 2
    assert "is not a whole number from 1 to 99999999" in capsys.readouterr().err


def test_a_faulty_specification_is_not_explored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("specc: 1\nsystem: demo\nagents: {a: {control: {rate: 10}}}\n")
    assert main(["explore", str(spec)]) == 1
    assert "E0104" in capsys.readouterr().err


def test_what_never_came_does_not_come_again(capsys: pytest.CaptureFixture[str]) -> None:
    main(["explore", str(CASES / "circle-pair.yaml")])
    said = capsys.readouterr()
    assert "waits for `x.two.ready`, which never comes" in said.err
    assert "explored completely: 1 state\n" in said.out


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_terminal_shows_how_far_the_search_is(
    is_terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    seconds = itertools.count()
    monkeypatch.setattr("specc.cli.progress.time.monotonic", lambda: float(next(seconds)))
    assert main(["explore", CONVEYOR, "--budget", "5"]) == 0
    said = capsys.readouterr().err
    if is_terminal:
        line = "belt.c, gate.c: 1 state, 1 waiting, 0 s into the runs, pass 1 of 3"
        assert said.startswith(f"\r\x1b[2K{line}")
        assert "\r\x1b[2K1 file checked" in said  # the last line is gone
    else:
        assert said == "1 file checked: 0 errors, 0 warnings\n"


def test_large_numbers_are_grouped() -> None:
    assert [grouped(n) for n in (31, 1200, 1_234_567)] == ["31", "1 200", "1 234 567"]
