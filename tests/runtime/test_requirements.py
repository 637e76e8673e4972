"""Requirements in runs: verdicts, the tick and the values that decide them, and the exit code."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from specc.tools.sweep.running import figures_of
from tests.seeds import every

SPEC = """
specc: 1.1
system: pair
constants: {patience: "0.5[s]"}
agents:
  counter:
    control:
      rate: 10 Hz
      y: {listener: {v: "real[m/s]"}}
      memory:
        v: {type: "real[m/s]", init: 0}
        n: {type: int, init: 0}
        w: {type: "vector[2, m/s]", init: "[1[m/s], 2[m/s]]"}
      functions: {count: {v: "v + 0.25[m/s]", n: n + 1, y.listener.v: v}}
      conditions: {terminal: {fast: "n >= 8"}}
      behaviours: {count: {functions: [count], terminal: fast}, rest: {terminal: never}}
      states: {counting: count, resting: rest}
      initial_state: counting
      transitions: [[counting, terminal, always, resting]]
  listener:
    control:
      rate: 5 Hz
      x: {counter: {v: "real[m/s]"}}
      memory: {seen: {type: "real[m/s]", init: 0}}
      functions: {listen: {seen: "x.counter.v if present(x.counter.v) else seen"}}
      behaviours: {listen: {functions: [listen], terminal: never}}
      states: {S0: listen}
      initial_state: S0
"""
# After its step at k / 10 s the counter has n = k + 1 and v = n / 4 m/s, until n = 8 at 0.7 s.


def watched(folder: Path, text: str, code: int, duration: str = "2") -> dict[str, Any]:
    """What the report of a run says of one requirement."""
    spec, report = folder / "pair.yaml", folder / "report.json"
    spec.write_text(f'{SPEC}require:\n  - that: "{text}"\n    because: of the test\n')
    options = ["--duration", duration, "--report", str(report)]
    assert main(["run", str(spec), *options]) == code
    (found,) = json.loads(report.read_text())["requirements"]
    assert found.pop("that") == text
    assert found.pop("because") == "of the test"
    return dict(found)


@pytest.mark.parametrize(
    ("text", "margin"),
    every(
        2,
        [
            ("always(counter.c.v <= 2[m/s])", 0.0),
            ("always(counter.c.v < 2.5[m/s])", 0.5),
            (
                "always(counter.c.n > 4 implies within(patience, state(counter.c) == resting))",
                1,
            ),
            (
                "always(state(counter.c) == resting implies historically(1[s], counter.c.v > 0))",
                0.25,
            ),
            ("always(present(listener.c.x.counter.v) implies listener.c.x.counter.v >= 0)", 0.0),
            ("always(listener.c.seen < 2[m/s])", 0.25),
            ("within(1[s], counter.c.n == 8)", None),
            ("always(0 <= counter.c.v < 2.5[m/s])", 0.25),
            ("always(all(v > 0.25[m/s] for v in counter.c.w))", 0.75),
            ("always(all(0 < v < 5[m/s] for v in counter.c.w))", 1.0),
            ("always(any(v > 1.5[m/s] and not v > 2.25[m/s] for v in counter.c.w))", 0.25),
            ("always(any(counter.c.n == 0 or v > 1.5[m/s] for v in counter.c.w))", 0.5),
            # What is compared only as long as the rest does not hold may have no value.
            (
                "always(any(counter.c.n > 0 or listener.c.x.counter.v > v for v in counter.c.w))",
                2.0,
            ),
        ],
    ),
)
def test_what_holds_is_met(tmp_path: Path, text: str, margin: float | None) -> None:
    found = watched(tmp_path, text, code=0)
    asked = True if "implies" in text else None
    told = {"verdict": "met", "margin": margin, "time_s": None, "values": {}, "asked": asked}
    assert found == told


@pytest.mark.parametrize(
    ("text", "margin", "time_s", "values"),
    [
        ("always(counter.c.v < 1[m/s])", -1.0, 0.3, {"counter.c.v": 1.0}),
        # What is sent at 0.1 s is there at 0.2 s; memory is as it is after the step.
        (
            "always(not (present(listener.c.x.counter.v) and listener.c.x.counter.v > 0))",
            -1.75,
            0.2,
            {"present(listener.c.x.counter.v)": True, "listener.c.x.counter.v": 0.25},
        ),
        (
            "always(counter.c.n == 2 implies within(patience, state(counter.c) == resting))",
            None,
            0.1,
            {"counter.c.n": 2, "state(counter.c)": "counting"},
        ),
        ("since(counter.c.n > 5, counter.c.n == 2)", None, 0.0, {"counter.c.n": 1}),
        (
            "always(all(counter.c.v - v < 0.5[m/s] for v in counter.c.w))",
            -0.5,
            0.5,
            {"counter.c.v": 1.5, "counter.c.w": "array([1., 2.])"},
        ),
    ],
)
def test_what_fails_is_violated(
    tmp_path: Path, text: str, margin: float | None, time_s: float, values: dict[str, Any]
) -> None:
    found = watched(tmp_path, text, code=1)
    assert found["verdict"] == "violated"
    assert found["margin"] == margin
    assert found["time_s"] == pytest.approx(time_s)
    assert found["values"] == values


def test_what_is_never_asked_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = {
        "always(counter.c.n > 9 implies counter.c.v < 0)": False,
        "always(counter.c.n > 7 implies counter.c.v > 0)": True,
        "always(counter.c.n > 7 implies (counter.c.v < 0 implies counter.c.n < 0))": False,
        "always(counter.c.n > 0 and (counter.c.n > 9 implies counter.c.v < 0))": None,
        "always((counter.c.n > 9 implies False) and (counter.c.n == 3 implies True))": True,
        "always(throughout(1[s], counter.c.n > 9 implies counter.c.v < 0))": False,
        "within(1[s], counter.c.n == 5 implies state(counter.c) == counting)": True,
        "within(200[ms], counter.c.n == 5 implies state(counter.c) == counting)": False,
        "always(counter.c.n == 8 implies within(9[s], counter.c.n > 9))": True,
        "counter.c.n == 2 implies counter.c.v < 0": False,
        "always(1[s] / ((counter.c.n - 1) * 1[s]) > 9 implies counter.c.v < 0)": False,
    }
    for text, told in asked.items():
        found = watched(tmp_path, text, code=0)
        assert found["asked"] is told, text
        out = capsys.readouterr().out
        assert ("never asked" in out) == (told is False and found["verdict"] == "met"), text


def test_names_and_reasons_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec, report = tmp_path / "pair.yaml", tmp_path / "report.json"
    item = '{name: slow, that: "always(counter.c.v < 1[m/s])", because: it is calm}'
    spec.write_text(f"{SPEC}require: [{item}]\n")
    assert main(["run", str(spec), "--duration", "2", "--report", str(report)]) == 1
    assert "violated slow: always(counter.c.v < 1[m/s])" in (out := capsys.readouterr().out)
    assert "because: it is calm" in out
    data = json.loads(report.read_text())
    assert data["requirements"][0]["name"] == "slow"
    assert {"verdict of slow", "margin of slow"} <= figures_of(data, 1).keys()


@pytest.mark.parametrize(
    ("text", "duration", "time_s"),
    [
        ("always(listener.c.x.counter.v >= 0)", "2", 0.0),  # nothing was sent yet
        ("always(throughout(patience, state(counter.c) == counting))", "0.7", 0.2),
        ("always(1[m/s] / (counter.c.v - 1[m/s]) < 100)", "2", 0.3),  # cannot be computed
    ],
)
def test_what_is_not_known_is_unknown(
    tmp_path: Path, text: str, duration: str, time_s: float
) -> None:
    found = watched(tmp_path, text, code=0, duration=duration)
    assert (found["verdict"], found["margin"]) == ("unknown", None)
    assert found["time_s"] == pytest.approx(time_s)


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        ("always(listener.c.seen > 0)", "unknown"),
        ("always(listener.c.seen > 0 or counter.c.n < 9)", "met"),
        ("always(state(counter.c) == counting or counter.c.n == 8)", "met"),
    ],
)
def test_what_a_step_that_failed_would_have_made_is_unknown(
    tmp_path: Path, text: str, verdict: str
) -> None:
    spec, report = tmp_path / "pair.yaml", tmp_path / "report.json"
    failing = SPEC.replace("functions: {listen: {", "functions: {listen: {k: k + 1, ").replace(
        "x.counter.v if present(x.counter.v) else seen", "1[m/s] / (3 - k)"
    )
    failing = failing.replace("memory: {seen", "memory: {k: {type: int, init: 0}, seen")
    spec.write_text(f'{failing}require: [{{that: "{text}", because: of the test}}]\n')
    assert main(["run", str(spec), "--duration", "2", "--report", str(report)]) == 1
    told = json.loads(report.read_text())
    assert (told["ended"], told["faults"][0]["stamp"]) == ("fault", 3)
    assert told["requirements"][0]["verdict"] == verdict


def test_a_run_without_requirements_says_nothing_of_them(tmp_path: Path) -> None:
    spec, report = tmp_path / "pair.yaml", tmp_path / "report.json"
    spec.write_text(SPEC)
    assert main(["run", str(spec), "--duration", "0.5", "--report", str(report)]) == 0
    assert "requirements" not in json.loads(report.read_text())


def test_requirements_change_nothing_in_a_run(tmp_path: Path) -> None:
    digests = []
    for part in ("", 'require: [{that: "always(counter.c.v < 0)", because: of the test}]\n'):
        spec, report = tmp_path / "pair.yaml", tmp_path / "report.json"
        spec.write_text(SPEC + part)
        main(["run", str(spec), "--duration", "2", "--report", str(report)])
        digests.append(json.loads(report.read_text())["records_sha256"])
    assert digests[0] == digests[1]


def test_what_is_required_is_a_part_of_what_changed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
    old.write_text(SPEC)
    new.write_text(f'{SPEC}require: [{{that: "always(counter.c.n < 9)", because: it rests}}]\n')
    main(["diff", str(old), str(new)])
    assert "requirement" in capsys.readouterr().out
