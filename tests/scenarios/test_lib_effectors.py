"""The arm of n joints and the gripper of the library, with models that are made here."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from specc.cli import main
from tests.commands import specc

ARM_HZ = 200
V_MAX, A_MAX = 1.5, 4.0
SIZES = [3, pytest.param(7, marks=pytest.mark.long)]

SPEC = """\
specc: 1.2
system: cell
constants:
  a: {{is: "{a}", title: a posture}}
  b: {{is: "{b}", title: another one}}
agents:
  cell:
    title: Moves, halts, goes on, grasps and lets go
    kind: CE
    real_effectors:
      arm:
        x: {{q_d: {{type: "vector[{n}, rad]", safe: {{is: q_m, otherwise: 0 * a}}}}}}
        y: {{q_m: "vector[{n}, rad]"}}
      gripper:
        x: {{d_d: {{type: "real[m]", safe: {{is: d_m, otherwise: "0[m]"}}}}}}
        y: {{d_m: "real[m]"}}
    virtual_effectors:
      arm:
        use: specc:joint_arm
        rate: 200 Hz
        with: {{n: {n}, v_max: "{v}", a_max: "{acc}", tolerance: "0.01[rad]"}}
      gripper:
        use: specc:parallel_gripper
        rate: 100 Hz
        with:
          opened: "0.08[m]"
          closed: "0[m]"
          stiffness: "2000[N/m]"
          F_max: "20[N]"
          slow: "1[mm/s]"
          settled: "0.1[s]"
          tolerance: "2[mm]"
    control:
      title: Task
      rate: 20 Hz
      x:
        arm: {{q: {{type: "vector[{n}, rad]", init: 0 * a}}, moving: {{type: bool, init: False}}}}
        gripper: {{d: {{type: "real[m]", init: 0}}, grasped: {{type: bool, init: False}}}}
      y: {{arm: {{q_d: "vector[{n}, rad]", halt: bool}}, gripper: {{close: bool}}}}
      conditions:
        terminal:
          at_a: elapsed >= 0.2[s] and not x.arm.moving and near(x.arm.q, a, 0.01[rad])
          half_way: elapsed >= 0.5[s]
          stands: elapsed >= 0.2[s] and not x.arm.moving
          opened: x.gripper.d > 7.5[cm]
          grasped: x.gripper.grasped
      functions:
        go_to_a: {{y.arm.q_d: a}}
        go_to_b: {{y.arm.q_d: b}}
        halt: {{y.arm.halt: True}}
        close: {{y.gripper.close: True}}
        open: {{y.gripper.close: False}}
      behaviours:
        tell_a: {{functions: [go_to_a], terminal: always}}
        tell_b: {{functions: [go_to_b], terminal: always}}
        tell_halt: {{functions: [halt], terminal: always}}
        tell_both: {{functions: [halt, go_to_a], terminal: always}}
        tell_close: {{functions: [close], terminal: always}}
        tell_open: {{functions: [open], terminal: always}}
        reach_a: {{terminal: at_a}}
        go_on: {{terminal: half_way}}
        stop: {{terminal: stands}}
        squeeze: {{terminal: grasped}}
        let_go: {{terminal: opened}}
      states:
        telling_a: tell_a
        reaching_a: reach_a
        telling_b: tell_b
        leaving: go_on
        telling_halt: tell_halt
        telling_both: tell_both
        halting: stop
        telling_close: tell_close
        squeezing: squeeze
        telling_open: tell_open
        letting_go: let_go
      initial_state: telling_a
      transitions:
        - [telling_a,     terminal, always, reaching_a]
        - [reaching_a,    terminal, always, telling_b]
        - [telling_b,     terminal, always, leaving]
        - [leaving,       terminal, always, telling_halt]
        - [telling_halt,  terminal, always, telling_both]
        - [telling_both,  terminal, always, halting]
        - [halting,       terminal, always, telling_close]
        - [telling_close, terminal, always, squeezing]
        - [squeezing,     terminal, always, telling_open]
        - [telling_open,  terminal, always, letting_go]
        - [letting_go,    terminal, always, telling_a]
plant:
  model: cell.xml
  bind:
    cell.E.arm.q_d: {{actuators: [{drives}]}}
    cell.E.arm.q_m: {{joints: [{joints}]}}
    cell.E.gripper.d_d: {{actuators: [jaw]}}
    cell.E.gripper.d_m: {{joints: [jaw]}}
  observe:
    force: {{type: "real[N]", actuators: [jaw]}}
task: {{cycle: {{of: cell.c, from: letting_go, to: telling_a}}}}
require:
  - that: "always(once(20[ms], not present(cell.E.gripper.d_d)) or abs(plant.force) <= 22[N])"
    because: the gripper crushes nothing
  - {{that: "within(40[s], state(cell.c) == letting_go)", because: the task is done}}
"""


def model(n: int) -> str:
    """A chain of n links, each turning about another axis than the last, and a gripper beside."""
    links, ends = "", ""
    for k in range(1, n + 1):
        axis = "0 0 1" if k % 2 else "0 1 0"
        links += (
            f'<body pos="0 0 0.1"><joint name="j{k}" axis="{axis}" armature="0.05"/>'
            '<geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.02" mass="0.1"/>'
        )
        ends += "</body>"
    drives = "".join(
        f'<position name="d{k}" joint="j{k}" kp="400" kv="15"/>' for k in range(1, n + 1)
    )
    return f"""\
<mujoco>
  <option timestep="0.001" gravity="0 0 0" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    {links}{ends}
    <body pos="1 0 0">
      <geom type="box" size="0.01 0.02 0.02" pos="-0.01 0 0" contype="1" conaffinity="1"/>
      <body pos="0.05 0 0">
        <joint name="jaw" type="slide" axis="1 0 0" ref="0.05" damping="60" armature="0.2"/>
        <geom type="box" size="0.01 0.02 0.02" pos="0.01 0 0" contype="1" conaffinity="1"/>
      </body>
      <geom type="box" size="0.015 0.01 0.01" pos="0.015 0 0" contype="1" conaffinity="1"/>
    </body>
  </worldbody>
  <actuator>{drives}<position name="jaw" joint="jaw" kp="2000"/></actuator>
</mujoco>
"""


def listed(values: list[object]) -> str:
    return f"[{', '.join(map(str, values))}]"


def cell(folder: Path, n: int) -> Path:
    """The specification of a cell whose arm has n joints, with its model, in a folder."""
    spec = folder / "cell.yaml"
    each = range(1, n + 1)
    spec.write_text(
        SPEC.format(
            n=n,
            a=listed([f"{(-1) ** k * 0.3 * k / n}[rad]" for k in each]),
            b=listed([f"{1.2 - 2.0 * k / n}[rad]" for k in each]),
            v=listed([f"{V_MAX}[rad/s]" for _ in each]),
            acc=listed([f"{A_MAX}[rad/s**2]" for _ in each]),
            drives=", ".join(f"d{k}" for k in each),
            joints=", ".join(f"j{k}" for k in each),
        )
    )
    (folder / "cell.xml").write_text(model(n))
    return spec


def columns(record: Path, signal: str) -> tuple[np.ndarray, np.ndarray]:
    """The times and the values of a vector in a recording."""
    told = specc("plot", record, signal, "--csv")
    assert told.returncode == 0, told.stderr
    rows = [row for row in list(csv.reader(told.stdout.splitlines()))[1:] if row[1]]
    table = np.array(rows, float)
    return table[:, 0], table[:, 1:]


@pytest.mark.long
@pytest.mark.parametrize("n", SIZES)
def test_an_arm_of_any_size_keeps_its_bounds(n: int, tmp_path: Path) -> None:
    record, report = tmp_path / "run.mcap", tmp_path / "report.json"
    done = specc("run", cell(tmp_path, n), "--cycles", "1", "--record", record, "--report", report)
    assert done.returncode == 0, done.stderr
    taken = json.loads(report.read_text())["subsystems"]["cell.arm"]["transitions_taken"]
    assert taken["moving terminal otherwise -> holding"] == 1
    assert taken["moving terminal halted -> braking"] == 1
    assert taken["braking terminal otherwise -> holding"] == 1  # told to go and to halt, it halts
    time_s, q = columns(record, "cell.arm.y.E.q_d")
    assert np.diff(time_s) == pytest.approx(1.0 / ARM_HZ)
    v = np.diff(q, axis=0) * ARM_HZ
    assert V_MAX * 0.99 < np.abs(v).max() < V_MAX * 1.005
    assert A_MAX * 0.99 < np.abs(np.diff(v, axis=0)).max() * ARM_HZ < A_MAX * 1.005


@pytest.mark.long
@pytest.mark.parametrize("n", [3, 7])
def test_exploring_finds_nothing(
    n: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explore", str(cell(tmp_path, n)), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["findings"] == []


def test_the_cell_has_no_findings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", str(cell(tmp_path, 3)), "--strict"]) == 0
    assert "0 errors, 0 warnings" in capsys.readouterr().err
