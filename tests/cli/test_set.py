"""`specc run --set`: a constant's value for one run, checked as if the file had it."""

import json
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main

GATE = Path(__file__).resolve().parents[2] / "specs" / "conveyor_gate.yaml"
LIBRARY = "specc: 1\nconstants: {high: '2[m]', step: '1[mm]'}\n"
PART = """specc: 1
parameters: {limit: "real[m]"}
constants: {low: "0[m]", margin: "1[m]"}
subsystem:
  rate: 10 Hz
  x: {one: {d: {type: "real[m]", init: 0}}}
  memory: {l: {type: bool, init: False}}
  functions: {look: {l: "x.one.d > limit + low - margin"}}
  behaviours: {look: {functions: [look], terminal: never}}
  states: {S0: look}
  initial_state: S0
"""
SYSTEM = """specc: 1
system: thresholds
use: [library.yaml]
constants: {low: "1[m]", middle: "(low + high) / 2", on: "True", q: "[0, 90[deg]]"}
agents:
  one:
    control:
      rate: 10 Hz
      y: {other: {d: "real[m]"}}
      memory:
        d: {type: "real[m]", init: middle}
        r: {type: bool, init: on}
        v: {type: "vector[2, rad]", init: q}
      conditions:
        initial: {below: d < low, above: d > high}
        terminal: {left: d < low or d > high}
      functions: {go: {y.other.d: d, d: "d + (step if r and v[0] < 1[rad] else 0[m])"}}
      behaviours: {wait: {functions: [go], terminal: left}}
      states: {S0: wait, S1: wait, S2: wait}
      initial_state: S0
      transitions:
        - [S0, terminal, below, S1]
        - [S0, terminal, above, S2]
        - [S1, terminal, always, S0]
        - [S2, terminal, always, S0]
  other:
    control: {use: part.yaml, with: {limit: middle}}
"""


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return put(tmp_path, SYSTEM, LIBRARY)


def put(folder: Path, system: str, library: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "library.yaml").write_text(library)
    (folder / "part.yaml").write_text(PART)
    (folder / "spec.yaml").write_text(system)
    return folder / "spec.yaml"


def ran(spec: Path, *settings: str) -> dict[str, Any]:
    """The report of a short run."""
    options = [part for setting in settings for part in ("--set", setting)]
    assert main(["run", str(spec), "--duration", "3", "--report", "r.json", *options]) == 0
    return json.loads(Path("r.json").read_text())


@pytest.mark.parametrize(
    ("settings", "old", "new"),
    [
        ({"low": "1.25[m]"}, 'low: "1[m]"', 'low: "1.25[m]"'),
        ({"low": "50[mm]", "on": "not True"}, 'low: "1[m]"', 'low: "50[mm]"'),
        ({"middle": "high - low / 4"}, "(low + high) / 2", "high - low / 4"),
        ({"q": "[1[rad], 2[deg]]"}, "[0, 90[deg]]", "[1[rad], 2[deg]]"),
        ({"q": "[0, 0]"}, "[0, 90[deg]]", "[0, 0[deg]]"),
        ({"high": "300[cm]"}, "'2[m]'", "'300[cm]'"),
        ({"step": "0"}, "'1[mm]'", "'0[mm]'"),
    ],
)
def test_the_code_is_that_of_a_file_with_the_value(
    spec: Path, tmp_path: Path, settings: dict[str, str], old: str, new: str
) -> None:
    from specc.pipeline import build

    assert (SYSTEM + LIBRARY).count(old) == 1
    system = SYSTEM.replace('on: "True"', 'on: "not True"') if "on" in settings else SYSTEM
    written = put(tmp_path / "written", system.replace(old, new), LIBRARY.replace(old, new))
    built = build(str(spec), settings)
    assert built.files == build(str(written)).files != build(str(spec)).files


def test_a_run_behaves_by_the_value_and_reports_it(spec: Path, tmp_path: Path) -> None:
    before = sorted(path.name for path in tmp_path.iterdir())
    as_written = ran(GATE)
    assert "set" not in as_written
    assert as_written["subsystems"]["gate.c"]["transitions_taken"]
    blind = ran(GATE, "seen=1[mm]", " patience = 2[s] ")
    assert blind["set"] == {"seen": "1[mm]", "patience": "2[s]"}
    assert not blind["subsystems"]["gate.c"]["transitions_taken"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*before, "r.json"])


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("lo=1[m]", ["unknown constant `lo`", "did you mean `low`?", "--set:1:1"]),
        ("nothing=1[m]", ["known: `high`, `low`, `middle`, `on`, `q`, `step`"]),
        ("margin=1[m]", ["unknown constant `margin`"]),  # a description's own
        ("limit=1[m]", ["unknown constant `limit`"]),  # its parameter
        ("low=1[s]", ["`1[s]` is `real[s]`; expected `real[m]`", "--set:1:5", "declared as"]),
        ("low=1", ["`1` is `int`; expected `real[m]`"]),
        ("on=3", ["`3` is `int`; expected `bool`"]),
        ("q=[0, 0, 0]", ["--set:1:3"]),
        ("low=1[m", ["the bracket is not closed"]),
        ("low=", ["the expression is empty"]),
        ("low=\udcff", ["a character that no expression has", "--set:1:5"]),
        ("low=middle", ["`middle`", "--set:1:5"]),  # only those above it
        ("low", ["argument --set: 'low' is not `name=value`"]),
        ("=1[m]", ["argument --set: '=1[m]' is not `name=value`"]),
    ],
)
def test_a_setting_that_is_wrong_is_wrong_usage(
    spec: Path, capsys: pytest.CaptureFixture[str], setting: str, told: list[str]
) -> None:
    try:
        code = main(["run", str(spec), "--duration", "1", "--set", setting])
    except SystemExit as stop:
        code = int(str(stop.code))
    said = capsys.readouterr().err
    assert code == 2
    assert [words for words in told if words not in said] == []


def test_a_constant_is_set_once(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["run", str(spec), "--set", "low=1[m]", "--set", "low=2[m]"])
    assert stop.value.code == 2
    assert "`low` is given twice" in capsys.readouterr().err


@pytest.mark.parametrize("setting", ["low=3[m]", "high=0.5[m]"])
def test_what_no_longer_proves_is_an_error(
    spec: Path, capsys: pytest.CaptureFixture[str], setting: str
) -> None:
    assert main(["run", str(spec), "--duration", "1", "--set", setting]) == 1
    assert "error[E0602]" in capsys.readouterr().err
