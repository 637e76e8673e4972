"""`specc run --set`: a constant's value for one run, checked as if the file had it."""

import json
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from tests.scenarios.runs import SPECS
from tests.seeds import every

GATE = Path(__file__).resolve().parents[2] / "specs" / "conveyor_gate.yaml"
LIBRARY = """specc: 1
constants: {high: '2[m]', step: '1[mm]', floor: {type: "real[m]", is: 0}}
"""
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
        d: {type: "real[m]", init: middle + floor}
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
    every(
        2,
        [
            ({"low": "1.25[m]"}, 'low: "1[m]"', 'low: "1.25[m]"'),
            ({"low": "50[mm]", "on": "not True"}, 'low: "1[m]"', 'low: "50[mm]"'),
            ({"middle": "high - low / 4"}, "(low + high) / 2", "high - low / 4"),
            ({"q": "[1[rad], 2[deg]]"}, "[0, 90[deg]]", "[1[rad], 2[deg]]"),
            ({"q": "[0, 0]"}, "[0, 90[deg]]", "[0, 0[deg]]"),
            ({"high": "300[cm]"}, "'2[m]'", "'300[cm]'"),
            ({"step": "0"}, "'1[mm]'", "'0[mm]'"),
            ({"low": "1.25"}, 'low: "1[m]"', 'low: "1.25[m]"'),  # a number alone has the unit there
            ({"step": "-.5e-1 "}, "'1[mm]'", "'-0.05[mm]'"),
            ({"floor": "2"}, "is: 0}", 'is: "2[m]"}'),  # or else that of the declared type
        ],
    ),
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


FLEET = """specc: 1.1
system: fleet
constants: {reach: "1[m]"}
agents:
  carts: {for: {i: 1..2}, use: cart.yaml, with: {limit: reach * i, boss: boss}}
  boss:
    control:
      rate: 10 Hz
      y: {carts: {d: "real[m]"}}
      conditions: {terminal: {late: "elapsed > 1[s]"}}
      functions: {go: {y.carts.d: reach}}
      behaviours: {go: {functions: [go], terminal: late}}
      states: {S0: go, S1: go}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
plant: {model: carts.xml}
task:
  cycle: {of: boss.c, from: S1, to: S0}
  scene: {slide: [0, "200[mm]"]}
"""
CART = """specc: 1.1
parameters: {limit: "real[m]", boss: agent}
agent:
  virtual_effectors: {wheels: {use: wheels.yaml, with: {limit: 2 * limit}}}
  control:
    rate: 10 Hz
    x: {boss: {d: {type: "real[m]", init: 0}}}
    memory: {l: {type: "real[m]", init: limit}}
    functions: {look: {l: x.boss.d}}
    behaviours: {look: {functions: [look], terminal: never}}
    states: {S0: look}
    initial_state: S0
"""
WHEELS = """specc: 1.1
parameters: {limit: "real[m]"}
subsystem:
  rate: 10 Hz
  memory: {l: {type: "real[m]", init: limit}}
  functions: {roll: {l: l}}
  behaviours: {roll: {functions: [roll], terminal: never}}
  states: {S0: roll}
  initial_state: S0
"""
MODEL = """<mujoco><worldbody><body><joint name="slide" type="slide"/><geom size="1"/></body>
</worldbody></mujoco>"""


def fleet(folder: Path, **texts: str) -> Path:
    """A fleet in a folder, with other texts where some are given."""
    folder.mkdir(exist_ok=True)
    files = {"fleet": FLEET, "cart": CART, "wheels": WHEELS} | texts
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)
    (folder / "carts.xml").write_text(MODEL)
    return folder / "fleet.yaml"


@pytest.mark.parametrize(
    ("name", "text", "written"),
    every(
        3,
        [
            ("carts.limit", "3", {"fleet": ("reach * i", "'3[m]'")}),  # of all of them
            ("carts.wheels.limit", "70[cm]", {"cart": ("2 * limit", "'70[cm]'")}),
            ("scene.slide", "50", {"fleet": ('[0, "200[mm]"]', '"50[mm]"')}),
        ],
    ),
)
def test_parameters_are_set_by_what_they_are_of(
    tmp_path: Path, name: str, text: str, written: dict[str, tuple[str, str]]
) -> None:
    from specc.pipeline import build

    spec = fleet(tmp_path / "as_is")
    texts = {"fleet": FLEET, "cart": CART}
    other = {file: texts[file].replace(*change) for file, change in written.items()}
    built = build(str(spec), {name: text})
    assert built.files, built.result.diagnostics
    assert built.files != build(str(spec)).files
    expected = build(str(fleet(tmp_path / "written", **other)))
    assert expected.files, expected.result.diagnostics
    assert built.files == expected.files


@pytest.mark.long
def test_a_file_of_definitions_and_of_a_description_has_one_value() -> None:
    from specc.pipeline import build

    spec = str(SPECS / "architectures/reactive.yaml")
    as_is, other = build(spec), build(spec, {"fastest": "5[rad/s]"})
    assert other.files, other.result.diagnostics
    changed = {name for name in as_is.files if as_is.files[name] != other.files[name]}
    assert changed == {"blind_drive.py"}


def test_a_parameter_of_one_copy_is_its_own(tmp_path: Path) -> None:
    from specc.lang import show
    from specc.pipeline import compile_spec

    system = compile_spec(str(fleet(tmp_path)), {"carts_2.limit": "reach + 50[cm]"}).system
    assert system is not None
    limits = {s.qualified_name: show(s.constants[0].value) for s in system.subsystems[:4]}
    assert limits == {
        "carts_1.c": "1[m] * 1",
        "carts_1.wheels": "2 * (1[m] * 1)",
        "carts_2.c": "1[m] + 0.5[m]",
        "carts_2.wheels": "2 * (1[m] + 0.5[m])",
    }


@pytest.mark.long
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
        ("nothing=1[m]", ["known: `floor`, `high`, `low`, `middle`, `on`, `q`, `step`"]),
        ("margin=1[m]", ["unknown constant `margin`"]),  # a description's own
        ("limit=1[m]", ["unknown constant `limit`"]),  # its parameter
        ("other.c.limit=1[s]", ["`1[s]` is `real[s]`; expected `real[m]`", "--set:1:15"]),
        ("low=1[s]", ["`1[s]` is `real[s]`; expected `real[m]`", "--set:1:5", "declared as"]),
        ("low=1[]", ["--set:1:"]),
        ("middle=1", ["`1` is `int`; expected `real[m]`"]),  # written as a sum, of no one unit
        (
            "other.c.limits=1[m]",
            ["unknown parameter `other.c.limits`", "did you mean"],
        ),
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
