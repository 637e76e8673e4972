"""Torques of any arm: against Pinocchio, and by what they do in a simulation."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.operators.arms.dynamics import (
    computed_torque,
    gravity_compensation,
    inverse_dynamics,
)
from specc_runtime.operators.arms.model import Arm, load_arm

from tests.operators import seven_joints as panda

N = 7
DAMPING = 0.5
MOTORS = "".join(f'<motor name="m{k}" joint="q{k}"/>' for k in range(1, N + 1))

vectors = st.lists(st.floats(-2.0, 2.0), min_size=N, max_size=N).map(np.array)


def file(folder: Path, by: str = "", **how: bool) -> str:
    """The arm with motors; `by` has attributes of its joints."""
    path = folder / "panda.xml"
    text = panda.model(drives=f"<actuator>{MOTORS}</actuator>", **how)
    path.write_text(text.replace('<joint name="q', f'<joint {by} name="q'))
    return str(path)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    return file(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def arm(path: str) -> Arm:
    return load_arm(path, "base", "flange", N)


@pytest.fixture(scope="module")
def other(path: str) -> tuple[pin.Model, pin.Data]:
    model = pin.buildModelFromMJCF(path)
    return model, model.createData()


@given(q=vectors, v=vectors, a=vectors)
def test_inverse_dynamics_is_that_of_pinocchio(
    arm: Arm, other: tuple[pin.Model, pin.Data], q: np.ndarray, v: np.ndarray, a: np.ndarray
) -> None:
    whole = (np.append(q, panda.FINGER_M), np.append(v, 0.0), np.append(a, 0.0))
    expected = pin.rnea(*other, *whole)[:N] + DAMPING * v
    assert inverse_dynamics(arm, q, v, a) == pytest.approx(expected, abs=1e-9)
    gravity = pin.computeGeneralizedGravity(*other, whole[0])[:N]
    assert gravity_compensation(arm, q) == pytest.approx(gravity, abs=1e-9)


@pytest.mark.parametrize("by", ["", 'actuatorgravcomp="true"'])
def test_a_weight_that_the_model_compensates_is_not_compensated_again(
    by: str, tmp_path: Path
) -> None:
    arm = load_arm(file(tmp_path, by, weightless=True), "base", "flange", N)
    assert gravity_compensation(arm, panda.HOME) == pytest.approx(np.zeros(N), abs=1e-9)


def test_errors_of_a_motion_with_computed_torque_fade_as_they_should(arm: Arm, path: str) -> None:
    model = mujoco.MjModel.from_xml_path(path)
    model.opt.timestep = step = 0.0005
    data = mujoco.MjData(model)
    w, e_0 = 20.0, np.full(N, 0.05)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel[:N] = 0.3
    data.qpos[:N] = panda.HOME - e_0
    for _ in range(600):
        q_d, v_d, a_d = motion(data.time)
        q, v = data.qpos[:N].copy(), data.qvel[:N].copy()
        data.ctrl[:] = computed_torque(arm, q, v, q_d, v_d, a_d, w)
        mujoco.mj_step(model, data)
    t = 600 * step
    left = motion(t)[0] - data.qpos[:N]
    assert left == pytest.approx(e_0 * (1 + w * t) * np.exp(-w * t), abs=2e-3)


def motion(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each joint swings about the start, at first with 0.3 rad/s."""
    one = np.ones(N)
    return (
        panda.HOME + 0.1 * np.sin(3 * t) * one,
        0.3 * np.cos(3 * t) * one,
        -0.9 * np.sin(3 * t) * one,
    )
