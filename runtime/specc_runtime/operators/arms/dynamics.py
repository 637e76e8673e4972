"""Torques of any arm: what carries its weight, and what accelerates it as it is wanted.

The masses, springs, dampers, rotors and compensations of weight are those of the model; contacts,
ends of ranges, friction and couplings of joints are left out. All other joints are at rest.
"""

from __future__ import annotations

import numpy as np

from specc_runtime.operators.arms.library import mujoco
from specc_runtime.operators.arms.model import Arm
from specc_runtime.operators.arrays import Array


def inverse_dynamics(arm: Arm, q: Array, v: Array, a: Array) -> Array:
    """Torques tau (n,), N*m (N of slides), with which the arm at q, v has the acceleration a.

    tau = M(q) a + c(q, v) + g(q) + D v + K (q - q_0) - what the model adds to compensate weight,

    by the recursive algorithm of Newton and Euler in MuJoCo (R. Featherstone, "Rigid body dynamics
    algorithms", 2008, 5.3).

    Args:
        arm: of n joints.
        q, v, a: (n,), rad, rad/s and rad/s2; m of slides.
    """
    data = arm.at(q)
    data.qvel[:] = data.qacc[:] = 0.0
    data.qvel[arm.velocities], data.qacc[arm.velocities] = v, a
    mujoco.mj_inverse(arm.model, data)
    helped = np.where(arm.model.jnt_actgravcomp[arm.joints], data.qfrc_gravcomp[arm.velocities], 0)
    torques: Array = data.qfrc_inverse[arm.velocities] - helped
    return torques


def gravity_compensation(arm: Arm, q: Array) -> Array:
    """Torques (n,), N*m, that hold the arm at rest at q (n,), rad: g(q) and springs."""
    rest = np.zeros_like(q)
    return inverse_dynamics(arm, q, rest, rest)


def computed_torque(
    arm: Arm, q: Array, v: Array, q_d: Array, v_d: Array, a_d: Array, stiffness: float
) -> Array:
    """Torques (n,), N*m, by which the arm follows q_d, v_d, a_d (n,), and errors fade.

    The arm gets a = a_d + 2 w (v_d - v) + w^2 (q_d - q), so that each error e obeys
    e'' + 2 w e' + w^2 e = 0, as far as the model is right (B. Siciliano et al., "Robotics", 2009,
    8.5.2).

    Args:
        arm, q, v: as of `inverse_dynamics`, measured.
        q_d, v_d, a_d: (n,), desired.
        stiffness: w, 1/s.
    """
    a = a_d + 2.0 * stiffness * (v_d - v) + stiffness * stiffness * (q_d - q)
    return inverse_dynamics(arm, q, v, a)
