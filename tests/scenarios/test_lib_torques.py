"""The arm with torques of the library, with an arm of seven joints under its weight."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from specc.cli import main
from tests.commands import specc
from tests.operators import seven_joints as panda
from tests.scenarios.test_lib_effectors import columns, listed

HZ = 250
TAU_MAX = 87.0
AWAY = panda.HOME + np.array([0.5, 0.4, -0.3, 0.5, 0.4, -0.5, 0.6])
SPEC = f"""\
specc: 1.2
system: cell
files: {{robot: cell.xml}}
constants:
  one: "{listed([1] * 7)}"
  home: "{listed([f"{q}[rad]" for q in panda.HOME])}"
  away: "{listed([f"{q}[rad]" for q in AWAY])}"
agents:
  cell:
    kind: CE
    real_effectors:
      arm:
        x: {{tau: {{type: "vector[7, N*m]", safe: "0[N*m] * one"}}}}
        y: {{q_m: "vector[7, rad]"}}
    virtual_effectors:
      arm:
        use: specc:torque_arm
        rate: {HZ} Hz
        with:
          n: 7
          model: robot
          base: '"base"'
          tip: '"flange"'
          v_max: 1.5[rad/s] * one
          a_max: 5[rad/s**2] * one
          tau_max: "{TAU_MAX}[N*m] * one"
          w: 20[1/s]
          tolerance: 2[mrad]
    control:
      rate: 25 Hz
      x: {{arm: {{q: {{type: "vector[7, rad]", init: home}}, moving: {{type: bool, init: False}}}}}}
      y: {{arm: {{q_d: "vector[7, rad]", halt: bool}}}}
      conditions:
        terminal:
          away: elapsed >= 0.2[s] and not x.arm.moving and near(x.arm.q, away, 2[mrad])
          half_way: elapsed >= 0.4[s]
          stands: elapsed >= 0.2[s] and not x.arm.moving
      functions: {{go: {{y.arm.q_d: away}}, back: {{y.arm.q_d: home}}, halt: {{y.arm.halt: True}}}}
      behaviours:
        go: {{functions: [go], terminal: always}}
        back: {{functions: [back], terminal: always}}
        halt: {{functions: [halt], terminal: always}}
        reach: {{terminal: away}}
        leave: {{terminal: half_way}}
        stop: {{terminal: stands}}
      states:
        going: go
        reaching: reach
        turning: back
        leaving: leave
        halting: halt
        stopping: stop
      initial_state: going
      transitions:
        - [going,    terminal, always, reaching]
        - [reaching, terminal, always, turning]
        - [turning,  terminal, always, leaving]
        - [leaving,  terminal, always, halting]
        - [halting,  terminal, always, stopping]
        - [stopping, terminal, always, going]
plant:
  model: cell.xml
  bind:
    cell.E.arm.tau: {{actuators: [m1, m2, m3, m4, m5, m6, m7]}}
    cell.E.arm.q_m: {{joints: [q1, q2, q3, q4, q5, q6, q7]}}
task: {{cycle: {{of: cell.c, from: stopping, to: going}}}}
"""


def cell(folder: Path) -> Path:
    motors = "".join(f'<motor name="m{k}" joint="q{k}"/>' for k in range(1, 8))
    (folder / "cell.xml").write_text(panda.model(drives=f"<actuator>{motors}</actuator>"))
    spec = folder / "cell.yaml"
    spec.write_text(SPEC)
    return spec


def test_an_arm_with_torques_follows_its_motion_under_its_weight(tmp_path: Path) -> None:
    record, report = tmp_path / "run.mcap", tmp_path / "report.json"
    done = specc("run", cell(tmp_path), "--cycles", "1", "--record", record, "--report", report)
    assert done.returncode == 0, done.stderr
    taken = json.loads(report.read_text())["subsystems"]["cell.arm"]["transitions_taken"]
    assert taken["moving terminal otherwise -> holding"] == 1
    assert taken["moving terminal halted -> braking"] == 1
    _, tau = columns(record, "cell.arm.y.E.tau")
    _, q = columns(record, "cell.arm.x.E.q_m")
    assert 10.0 < np.abs(tau).max() <= TAU_MAX
    assert np.abs(q[: HZ // 50] - panda.HOME).max() < 2e-3  # it does not sag at the start
    v = np.diff(q, axis=0) * HZ
    assert 1.0 < np.abs(v).max() < 1.5 * 1.05
    assert np.abs(v[-1]).max() < 0.02


def test_the_cell_has_no_findings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", str(cell(tmp_path)), "--strict"]) == 0
    assert "0 errors, 0 warnings" in capsys.readouterr().err


@pytest.mark.long
def test_exploring_finds_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explore", str(cell(tmp_path)), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["findings"] == []
