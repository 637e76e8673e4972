"""A belt with a panel and nothing else, whose scenarios pass or fail in a way of their own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.commands import specc

SYSTEM = """\
specc: 1.3
system: belt
constants: {fast: "0.2[m/s]", pace: {is: 0.5, range: [0, 1], live: true}}
agents:
  desk:
    real_receptors: {panel: {y: {go: bool, start: bool, v: "real[m/s]"}, through: 10 Hz}}
    control:
      rate: 10 Hz
      memory: {v: {type: "real[m/s]", init: "0[m/s]"}}
      functions: {rest: {v: "0[m/s]"}, run: {v: "min(x.panel.v * pace, fast)"}}
      states:
        S0: {functions: [rest], terminal: {when: x.panel.start}}
        S1: {functions: [run], terminal: {when: not x.panel.go}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
plant:
  bind:
    desk.R.panel.start: {panel: button}
    desk.R.panel.go: {panel: switch, init: True}
    desk.R.panel.v: {panel: slider, range: ["0[m/s]", "0.5[m/s]"], init: "0.4[m/s]"}
"""
TASK = """\
task:
  cycle: {of: desk.c, from: S1, to: S0}
  disturb: [{at: "2[s]", adjust: {pace: 0.25}, because: of the test}]
require:
  - {that: "always(desk.c.v < 0.21[m/s])", because: of the test}
"""
START = '{at: "0.5[s]", press: start}'
STOP = '{when: "state(desk.c) == S1", delay: ["0.2[s]", "1.2[s]"], turn: {go: false}}'
STOPPED = "within(2[s], desk.c.v > 0.1[m/s]) and within(2.5[s], not desk.R.panel.go)"


def scenario(name: str, *expect: str, panel: str = "", more: str = "") -> str:
    """The text of a scenario; by default somebody starts the belt."""
    items = panel or START
    formulas = "".join(f"      - '{formula}'\n" for formula in expect)
    return (
        f"  {name}:\n    because: of the test\n    panel: [{items}]\n"
        f"    duration: 3[s]\n{more}    expect:\n{formulas}"
    )


def spec(folder: Path, *scenarios: str, name: str = "belt") -> Path:
    """A specification with these scenarios."""
    path = folder / f"{name}.yaml"
    text = "".join(scenarios)
    path.write_text(f"{SYSTEM}{TASK}" + (f"scenarios:\n{text}" if text else ""))
    return path


def results_of(folder: Path, *arguments: object, code: int = 0) -> Any:
    """Test the specification in a folder; the results, if there are any."""
    done = specc("test", "belt.yaml", "--budget", 0, "--jobs", 1, *arguments, cwd=folder)
    assert done.returncode == code, done.stdout + done.stderr
    file = folder / "specc-test/results.json"
    return json.loads(file.read_text()) if file.exists() else None


def single(folder: Path, seed: int, *arguments: object) -> dict[str, Any]:
    """The report of one run by `specc run`."""
    report = folder / "report.json"
    report.unlink(missing_ok=True)
    done = specc("run", *arguments, "--seed", seed, "--report", report, cwd=folder)
    assert report.exists(), done.stderr
    return dict(json.loads(report.read_text()))
