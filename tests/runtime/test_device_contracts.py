"""Contracts of devices in runs: a broken one is reported by its name, recorded and explained."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from specc.tools.sweep.running import figures_of

SPEC = """\
specc: 1.3
system: hoist
agents:
  hoist:
    real_effectors:
      lift:
        x: {h_d: {type: "real[m]", safe: 0}}
        y: {h: {type: "real[m]", init: 0}}
        through: 50 Hz
        contracts:
          arrives:
            that: "always(stays(y.E.lift.h_d, 1[s]) implies abs(x.E.lift.h - y.E.lift.h_d) < 1[cm])"
            because: its drive is strong enough
          above: always(x.E.lift.h >= -1[mm])
    control:
      rate: 10 Hz
      conditions: {terminal: {up: "x.lift.h > 0.49[m]"}}
      behaviours:
        lift: {functions: [{y.lift.h_d: "0.5[m]"}], terminal: up}
        rest: {terminal: never}
      states: {lifting: lift, resting: rest}
      initial_state: lifting
      transitions: [[lifting, terminal, always, resting]]
plant:
  python: "own_hoist:Lift"
  bind: {hoist.E.lift.h_d: {}, hoist.E.lift.h: {}}
"""
LIFT = """\
class Lift:
    def reset(self, seed):
        self.h, self.wanted = 0.0, 0.0

    def sample(self, name):
        return self.h

    def actuate(self, name, value):
        self.wanted = value

    def advance(self, duration_s):
        step = SPEED * duration_s
        self.h += max(-step, min(step, self.wanted - self.h))

    def close(self):
        pass
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, which Python imports from."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for module in ("own_hoist", "hoist", "hoist.system"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    (tmp_path / "hoist.yaml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def run(folder: Path, speed: float, *options: str) -> tuple[int, dict[str, Any]]:
    (folder / "own_hoist.py").write_text(f"SPEED = {speed}\n{LIFT}", encoding="utf-8")
    options = ("--duration", "3", "--report", "run.json", *options)
    code = main(["run", "hoist.yaml", *options])
    return code, json.loads((folder / "run.json").read_text(encoding="utf-8"))


def test_a_contract_that_a_run_keeps_is_met(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, report = run(folder, 1.0)
    assert code == 0
    found = [(r["contract"], r["verdict"], "name" in r) for r in report["requirements"]]
    assert found == [("lift.arrives", "met", False), ("lift.above", "met", False)]
    assert "contract met lift.arrives: always(stays(y.E.lift.h_d" in capsys.readouterr().out


def test_a_broken_contract_is_reported_by_its_name(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, report = run(folder, 0.25, "--record", "run.mcap")
    assert code == 1
    arrives, above = report["requirements"]
    assert (arrives["contract"], arrives["verdict"]) == ("lift.arrives", "violated")
    # The command is there from 0.14 s on: 0.1 s, and a period of the effector, and its next one.
    assert arrives["time_s"] == pytest.approx(1.12)
    assert above["verdict"] == "met"
    assert arrives["values"]["hoist.E.lift.h_d"] == 0.5
    shown = capsys.readouterr().out
    assert "broken contract lift.arrives: always(" in shown
    assert "because: its drive is strong enough" in shown
    assert figures_of(report, code)["reason"] == "broken contract: lift.arrives"
    assert main(["why", "run.mcap@2", "--spec", "hoist.yaml"]) == 0
    shown = capsys.readouterr().out
    assert "the contract is broken at 1.12 s: lift.arrives: always(" in shown
    assert "at 1.12 s: stays(y.E.lift.h_d, 1[s]) held" in shown


def test_a_recording_is_judged_as_the_run_was(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(folder, 0.25, "--record", "run.mcap")
    capsys.readouterr()
    assert main(["replay", "run.mcap", "--spec", "hoist.yaml"]) == 1
    assert "broken contract lift.arrives: always(" in capsys.readouterr().out


def test_a_resumed_run_goes_on_counting(folder: Path) -> None:
    _, whole = run(folder, 0.25, "--record", "run.mcap")
    code = main(["run", "hoist.yaml", "--from", "run.mcap@1", "--duration", "3", "--report", "r"])
    assert code == 1
    again = json.loads((folder / "r").read_text(encoding="utf-8"))
    assert again["requirements"] == whole["requirements"]


def test_copies_of_a_device_have_contracts_of_their_own(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SPEC.replace("  hoist:\n    real", "  'hoist{i}':\n    for: {i: 1..2}\n    real")
    text = text.replace(
        "{hoist.E.lift.h_d: {}, hoist.E.lift.h: {}}",
        "{hoist1.E.lift.h_d: {}, hoist1.E.lift.h: {}, hoist2.E.lift.h_d: {}, hoist2.E.lift.h: {}}",
    )
    (folder / "hoist.yaml").write_text(text, encoding="utf-8")
    code, report = run(folder, 1.0)
    assert code == 0
    assert [r["contract"] for r in report["requirements"]] == [
        "hoist1.E.lift.arrives",
        "hoist1.E.lift.above",
        "hoist2.E.lift.arrives",
        "hoist2.E.lift.above",
    ]
