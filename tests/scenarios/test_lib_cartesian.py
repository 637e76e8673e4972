"""The Cartesian arm and the pose tracker of the library, with an arm of seven joints."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from specc_runtime.operators.approach import at_rest
from specc_runtime.operators.arms.ways import Way

from specc.cli import main
from specc.testing import Stepped
from tests.commands import specc
from tests.operators import seven_joints as panda
from tests.scenarios.test_lib_effectors import columns, listed
from tests.seeds import short

HZ = 100
V_MAX, A_MAX, W_MAX, ALPHA_MAX = 0.4, 1.0, 1.5, 4.0
Q_V_MAX, Q_A_MAX = 2.0, 10.0
POSES = {
    "a": "pose([0.45[m], 0.25[m], 0.4[m]], [1, 0, 0, 0])",
    "b": "pose([0.45[m], -0.25[m], 0.5[m]], [0.9238795325, 0.3826834324, 0, 0])",
    "far": "pose([1.2[m], 0, 0.4[m]], [1, 0, 0, 0])",
}
BODY = """\
specc: 1.2
system: cell
frames: {{B: base, E: flange}}
files: {{robot: cell.xml}}
constants: {{v: "{v}", a: "{a}"}}
agents:
  cell:
    kind: CE
    real_effectors:
      arm:
        x: {{q_d: {{type: "vector[7, rad]", safe: {{is: q_m, otherwise: "{zero}"}}}}}}
        y: {{q_m: "vector[7, rad]"}}
    virtual_effectors:
      arm:
        use: specc:{effector}
        rate: 100 Hz
        with:
          n: 7
          model: robot
          base: '"base"'
          tip: '"flange"'
          B: B
          E: E
          q_v_max: v
          q_a_max: a
          tolerance: "{tolerance}[mm]"
          angle_tolerance: "0.02[rad]"
{bounds}{control}
plant:
  model: cell.xml
  bind:
    cell.E.arm.q_d: {{actuators: [d1, d2, d3, d4, d5, d6, d7]}}
    cell.E.arm.q_m: {{joints: [q1, q2, q3, q4, q5, q6, q7]}}
"""
BOUNDS = f"""\
          v_max: "{V_MAX}[m/s]"
          a_max: "{A_MAX}[m/s**2]"
          w_max: "{W_MAX}[rad/s]"
          alpha_max: "{ALPHA_MAX}[rad/s**2]"
"""
GO = f"""\
    control:
      rate: 20 Hz
      x:
        arm:
          X_BE: {{type: "pose[B, E]", init: identity()}}
          moving: {{type: bool, init: False}}
          unreachable: {{type: bool, init: False}}
      y: {{arm: {{T_d: "pose[B, E]", halt: bool}}}}
      let: {{told: "elapsed >= 0.2[s] and not x.arm.moving", X: x.arm.X_BE}}
      conditions:
        terminal:
          at_a: "told and near(X, {POSES["a"]}, 2[mm], 0.01[rad])"
          at_b: "told and near(X, {POSES["b"]}, 2[mm], 0.01[rad])"
          stands: told
          half_way: elapsed >= 0.6[s]
        error: {{refused: told and x.arm.unreachable}}
      functions:
        tell_a: {{y.arm.T_d: "{POSES["a"]}"}}
        tell_b: {{y.arm.T_d: "{POSES["b"]}"}}
        tell_far: {{y.arm.T_d: "{POSES["far"]}"}}
        halt: {{y.arm.halt: True}}
      behaviours:
        tell_a: {{functions: [tell_a], terminal: always}}
        tell_b: {{functions: [tell_b], terminal: always}}
        tell_far: {{functions: [tell_far], terminal: always}}
        halt: {{functions: [halt], terminal: always}}
        reach_a: {{terminal: at_a, error: refused}}
        reach_b: {{terminal: at_b, error: refused}}
        go_on: {{terminal: half_way}}
        stand: {{terminal: stands}}
      states:
        telling_a: tell_a
        reaching_a: reach_a
        telling_b: tell_b
        leaving: go_on
        telling_a_again: tell_a
        turning_back: go_on
        halting: halt
        standing: stand
        telling_far: tell_far
        staying: stand
        telling_b_again: tell_b
        reaching_b: reach_b
      initial_state: telling_a
      transitions:
        - [telling_a,       terminal, always, reaching_a]
        - [reaching_a,      terminal, always, telling_b]
        - [telling_b,       terminal, always, leaving]
        - [leaving,         terminal, always, telling_a_again]
        - [telling_a_again, terminal, always, turning_back]
        - [turning_back,    terminal, always, halting]
        - [halting,         terminal, always, standing]
        - [standing,        terminal, always, telling_far]
        - [telling_far,     terminal, always, staying]
        - [staying,         terminal, always, telling_b_again]
        - [telling_b_again, terminal, always, reaching_b]
        - [reaching_b,      terminal, always, telling_a]
        - [[reaching_a, reaching_b], error, always, telling_a]
"""
FOLLOW = """\
    control:
      rate: 50 Hz
      x:
        arm: {X_BE: {type: "pose[B, E]", init: identity()}, there: {type: bool, init: False}}
      y: {arm: {T_d: "pose[B, E]"}}
      memory: {seen: {type: "pose[B, E]", init: identity()}, was_there: {type: bool, init: False}}
      let: {turn: "elapsed * 2[rad/s]"}
      conditions: {terminal: {round: "turn >= 2 * pi and was_there and position(seen).z > 0[m]"}}
      functions:
        lead:
          y.arm.T_d: >-
            pose([0.45[m] + 0.1[m] * cos(turn), 0.1[m] * sin(turn), 0.45[m]], [1, 0, 0, 0])
        watch: {seen: x.arm.X_BE, was_there: x.arm.there}
      behaviours: {lead: {functions: [lead, watch], terminal: round}}
      states: {leading: lead}
      initial_state: leading
      transitions: [[leading, terminal, always, leading]]
"""


def cell(folder: Path, effector: str, bounds: str, control: str, task: str) -> Path:
    spec = folder / "cell.yaml"
    text = BODY.format(
        effector=effector,
        tolerance=2 if bounds else 10,
        bounds=bounds,
        control=control.rstrip("\n"),
        zero=listed(["0[rad]", "0[rad]", "0[rad]", "-1[rad]", "0[rad]", "1[rad]", "0[rad]"]),
        v=listed([f"{Q_V_MAX}[rad/s]"] * 7),
        a=listed([f"{Q_A_MAX}[rad/s**2]"] * 7),
    )
    spec.write_text(f"{text}task: {{cycle: {task}}}\n")
    drives = "".join(
        f'<position name="d{k}" joint="q{k}" kp="4000" kv="100"/>' for k in range(1, 8)
    )
    (folder / "cell.xml").write_text(
        panda.model(drives=f"<actuator>{drives}</actuator>", weightless=True)
    )
    return spec


def going(folder: Path) -> Path:
    task = "{of: cell.c, from: reaching_b, to: telling_a}"
    return cell(folder, "cartesian_arm", BOUNDS, GO, task)


def following(folder: Path) -> Path:
    return cell(folder, "pose_tracker", "", FOLLOW, "{of: cell.c, from: leading, to: leading}")


def run(spec: Path) -> tuple[dict[str, int], np.ndarray]:
    """The transitions of the arm and the joint positions that it was sent, each period."""
    record, report = spec.with_suffix(".mcap"), spec.with_suffix(".json")
    done = specc(
        "run", spec, "--cycles", "1", "--duration", "30", "--record", record, "--report", report
    )
    assert done.returncode == 0, done.stderr
    taken = json.loads(report.read_text())["subsystems"]["cell.arm"]["transitions_taken"]
    time_s, q = columns(record, "cell.arm.y.E.q_d")
    assert np.diff(time_s) == pytest.approx(1.0 / HZ)
    return taken, q


@pytest.mark.long
def test_an_arm_goes_straight_to_poses_and_keeps_its_bounds(tmp_path: Path) -> None:
    taken, q = run(going(tmp_path))
    assert taken["moving terminal interrupted -> braking"] == 2
    assert taken["braking terminal goes_on -> setting_out"] == 1
    assert taken["braking terminal otherwise -> holding"] == 1
    assert taken["setting_out terminal refused -> holding"] == 1
    assert taken["moving terminal otherwise -> holding"] == 2
    assert np.abs(np.diff(q, axis=0)).max() * HZ <= Q_V_MAX
    check_bounds(q)
    p = np.array([panda.direct(each)[:3, 3] for each in q])
    v = np.diff(p, axis=0) * HZ
    assert np.linalg.norm(v, axis=1).max() > 0.95 * V_MAX
    straight(p, v)


def check_bounds(q: np.ndarray) -> None:
    """Velocity and acceleration, angular ones as well, of the flange."""
    X = [panda.direct(each) for each in q]
    v = np.diff([each[:3, 3] for each in X], axis=0) * HZ
    w = np.array([turn(*pair) for pair in pairwise(X)]) * HZ
    assert np.linalg.norm(v, axis=1).max() < 1.001 * V_MAX
    assert np.linalg.norm(w, axis=1).max() < 1.001 * W_MAX
    assert np.linalg.norm(np.diff(v, axis=0), axis=1).max() * HZ < 1.02 * A_MAX
    assert np.linalg.norm(np.diff(w, axis=0), axis=1).max() * HZ < 1.02 * ALPHA_MAX


def straight(p: np.ndarray, v: np.ndarray) -> None:
    """Between two rests positions lie on a line."""
    moves = np.linalg.norm(v, axis=1) > 1e-5
    ends = np.flatnonzero(np.diff(np.concatenate(([False], moves, [False])))).reshape(-1, 2)
    assert len(ends) == 4
    for start, end in ends:
        way = p[end] - p[start]
        off = p[start:end] - p[start]
        off = off - np.outer(off @ way, way) / (way @ way)
        assert np.linalg.norm(off, axis=1).max() < 1e-5


def turn(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Axis times angle of a small turn."""
    R = Y[:3, :3] @ X[:3, :3].T
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2


@pytest.mark.long
def test_an_arm_follows_a_pose_with_bounded_joints(tmp_path: Path) -> None:
    _, q = run(following(tmp_path))
    v = np.diff(q, axis=0) * HZ
    assert np.abs(v).max() <= Q_V_MAX * 1.001
    assert np.abs(np.diff(v, axis=0)).max() * HZ <= Q_A_MAX * 1.001
    p = np.array([panda.direct(each)[:3, 3] for each in q[len(q) // 2 :]])
    from_centre = np.linalg.norm(p - [0.45, 0.0, 0.45], axis=1)
    assert from_centre == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize("seed", short(range(12), 1))
def test_bounds_hold_whatever_it_is_told_and_whenever(seed: int, tmp_path: Path) -> None:
    """With drives that follow at once; poses anywhere in reach, and some nearby and out of it.

    Until joints cannot follow a line, which planning may miss between its samples.
    """
    q = commanded(Stepped(going(tmp_path), "cell.arm"), np.random.default_rng(seed))
    assert np.abs(np.diff(q, axis=0)).max() * HZ <= Q_V_MAX * (1 + 1e-9)
    check_bounds(np.array(q))


def test_joints_that_cannot_follow_a_line_leave_it_and_brake(tmp_path: Path) -> None:
    arm = Stepped(going(tmp_path), "cell.arm")
    arm.step({"x.E.q_m": panda.HOME})
    X_0 = panda.direct(panda.HOME)
    X_1 = X_0.copy()
    X_1[0, 3] += 1.0  # out of reach
    way = Way(X_0, X_1, np.full(1, V_MAX), np.full(1, A_MAX))
    arm.place("moving", memory={"way": way, "share": at_rest(np.zeros(1))})
    q, states = [panda.HOME], []
    while arm.state != "holding" and len(q) < 500:
        arm.step({"x.E.q_m": q[-1]})
        q.append(arm["y.E.q_d"])
        states.append(arm.state)
        assert arm["y.c.unreachable"] == (arm.state != "moving")
    moves, leaves = states.count("moving"), states.count("leaving")
    assert states == ["moving"] * moves + ["leaving"] * leaves + ["holding"]
    v = np.diff(q, axis=0) * HZ
    assert np.abs(v).max() <= Q_V_MAX
    assert np.abs(np.diff(v[moves - 1 :], axis=0)).max() * HZ <= Q_A_MAX * (1 + 1e-9)
    assert not v[-1].any()
    assert arm["y.c.moving"] is False


def commanded(arm: Stepped, rng: np.random.Generator) -> list[np.ndarray]:
    """Desired joint positions while it is told to go elsewhere, or to halt, six times."""
    q = [panda.HOME]
    arm.step({"x.E.q_m": panda.HOME})
    for _ in range(6):
        told = {"x.c.T_d": goal(rng, q[-1])} if rng.uniform() < 0.9 else {"x.c.halt": True}
        for _ in range(rng.integers(1, 200)):
            arm.step({"x.E.q_m": q[-1], **told})
            told = {}
            if arm.state == "leaving":
                return q
            q.append(arm["y.E.q_d"])
    return q


def goal(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """A pose that the arm has at other joint positions, nearby or anywhere, or moved by 30 cm."""
    spread = rng.choice([0.1, 0.5, 2.0])
    X = panda.direct(np.clip(q + rng.uniform(-spread, spread, 7), panda.LOWER, panda.UPPER))
    X[:3, 3] += rng.choice([0.0, 0.0, 0.3]) * rng.uniform(-1.0, 1.0, 3)
    return X


@pytest.mark.parametrize("make", [going, following])
def test_the_cells_have_no_findings(
    make: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(make)
    assert main(["validate", str(make(tmp_path)), "--strict"]) == 0
    assert "0 errors, 0 warnings" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("make", [going, following])
def test_exploring_finds_nothing(
    make: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(make)
    assert main(["explore", str(make(tmp_path)), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["findings"] == []
