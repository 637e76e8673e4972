"""`specc validate`, `explain`, `schema` and what holds for every command."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from specc import __version__
from specc.cli.main import main
from specc.cli.streams import FORMATS
from tests.seeds import short

ROOT = Path(__file__).parents[2]


def specc(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-m", "specc", *arguments],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )


pytestmark = pytest.mark.usefixtures("pipeline", "workspace")


@pytest.mark.parametrize(
    ("specs", "code", "summary"),
    [
        (["good.yaml"], 0, "1 file checked: 0 errors, 0 warnings"),
        (["odd.yaml"], 0, "1 file checked: 0 errors, 1 warning"),
        (["wrong.yaml"], 1, "1 file checked: 1 error, 0 warnings"),
        (["good.yaml", "wrong.yaml", "odd.yaml"], 1, "3 files checked: 1 error, 1 warning"),
        (["none.yaml"], 2, "1 file checked: 1 error, 0 warnings"),
        (["wrong.yaml", "./wrong.yaml", "wrong.yaml"], 1, "1 file checked: 1 error, 0 warnings"),
        (["wrong.yaml", "."], 2, "1 file checked: 2 errors, 0 warnings"),
        (["odd.yaml", "--strict"], 1, "1 file checked: 1 error, 0 warnings"),
        (["odd.yaml", "--ignore", "W0001"], 0, "1 file checked: 0 errors, 0 warnings, 1 ignored"),
    ],
)
def test_validate(
    specs: list[str], code: int, summary: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", *specs]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.splitlines()[-1] == summary


def test_a_finding_shows_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    main(["validate", "wrong.yaml"])
    assert capsys.readouterr().err == (
        "error[E0101]: key wrong\n"
        " --> wrong.yaml:2:1\n"
        "  |\n"
        "2 | wrong: 1\n"
        "  | ^^^^^\n"
        "\n"
        "1 file checked: 1 error, 0 warnings\n"
    )


@pytest.mark.parametrize("form", [form for form in FORMATS["validate"] if form != "text"])
def test_data_goes_to_standard_output(form: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "wrong.yaml", "--format", form]) == 1
    printed = capsys.readouterr()
    assert printed.err == ""
    assert "E0101" in printed.out


def test_data_can_be_read_back(capsys: pytest.CaptureFixture[str]) -> None:
    main(["validate", "wrong.yaml", "good.yaml", "--format", "json"])
    data = json.loads(capsys.readouterr().out)
    assert data["summary"]["files"] == ["wrong.yaml", "good.yaml"]
    assert data["diagnostics"][0]["location"]["line"] == 2


def test_colour_only_on_a_terminal_that_wants_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    main(["validate", "wrong.yaml"])
    assert "\x1b[" in capsys.readouterr().err
    monkeypatch.setenv("NO_COLOR", "1")
    main(["validate", "wrong.yaml"])
    assert "\x1b[" not in capsys.readouterr().err


def test_explain(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "e0011"]) == 0
    assert capsys.readouterr().out.startswith("E0011 (error): duplicate key\n")
    assert main(["explain", "e0202"]) == 0
    assert capsys.readouterr().out.startswith(
        "E0202 is part of E0201 now.\n\nE0201 (error): unknown name\n"
    )
    assert main(["explain"]) == 0
    assert "E0011  duplicate key\n" in capsys.readouterr().out
    assert main(["explain", "E0011x"]) == 2
    assert "E0011" in capsys.readouterr().err


def test_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "specc specification"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["validate"],
        ["nonsense"],
        ["validate", "good.yaml", "--format", "xml"],
        ["validate", "good.yaml", "--ignore", "E0101"],
        ["validate", "good.yaml", "--select", "W9"],
        ["run", "good.yaml", "--cycles", "0"],
        ["run", "good.yaml", "--duration", "-1"],
        ["run", "good.yaml", "--duration", "nan"],
        ["run", "good.yaml", "--seed", "-1"],
        ["run", "good.yaml", "--renderer", "other"],
    ],
)
def test_wrong_usage(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
    assert "usage: specc" in capsys.readouterr().err


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"specc {__version__}\n"


def test_an_interrupt_is_one_line(pipeline: Any, capsys: pytest.CaptureFixture[str]) -> None:
    pipeline.fault = KeyboardInterrupt()
    assert main(["validate", "good.yaml"]) == 130
    assert capsys.readouterr().err == "specc: interrupted\n"


def test_an_interrupt_that_python_wraps(pipeline: Any, capsys: pytest.CaptureFixture[str]) -> None:
    pipeline.fault = RuntimeError("Error calling __set_name__")
    pipeline.fault.__cause__ = KeyboardInterrupt()
    assert main(["validate", "good.yaml"]) == 130
    assert capsys.readouterr().err == "specc: interrupted\n"


def test_a_fault_of_specc_is_no_traceback(
    pipeline: Any,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pipeline.fault = RecursionError("deep\x1b")
    assert main(["validate", "good.yaml"]) == 70
    printed = capsys.readouterr().err
    assert "RecursionError: deep\\x1b" in printed
    assert "Traceback" not in printed
    monkeypatch.setenv("SPECC_TRACEBACK", "1")
    with pytest.raises(RecursionError):
        main(["validate", "good.yaml"])


@pytest.mark.parametrize("arguments", short([["explain"], ["schema"]], 0))
def test_a_reader_that_goes_away_is_no_traceback(arguments: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "specc", *arguments],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=False,
    )
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


def test_validating_imports_nothing_heavy() -> None:
    code = (
        "import sys, specc.cli\n"
        "assert specc.cli.main(['validate', sys.argv[1]]) == 0\n"
        "heavy = {'rich', 'numpy', 'networkx', 'jinja2', 'z3', 'mujoco'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(ROOT / "specs/irp_picking.yaml")],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=True,
    )
    assert done.stdout == "[]\n"


def test_the_module_is_the_command() -> None:
    assert specc("--version").stdout == f"specc {__version__}\n"


def test_a_file_name_that_is_no_text(capsys: pytest.CaptureFixture[str]) -> None:
    for form in FORMATS["validate"]:
        assert main(["validate", "\udcff\x1b none.yaml", "--format", form]) == 2
        printed = capsys.readouterr()
        shown = printed.err if form == "text" else printed.out
        assert "none.yaml" in shown
        assert "\x1b" not in shown
