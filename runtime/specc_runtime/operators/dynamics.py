"""Gravity of the arm. The only module that knows of Pinocchio."""

from dataclasses import dataclass
from os.path import isfile
from struct import pack, unpack
from typing import Any

import numpy as np
import pinocchio as pin

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.irp6 import TORQUE_CONSTANT
from specc_runtime.operators.motors import motor_torque

ARM_JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6")
_KINDS = ("JointModelRX", "JointModelRY", "JointModelRZ")
_ARM = f"<{3 + 26 * len(ARM_JOINTS)}d"


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """Rigid-body model of the six arm joints; an opaque handle, made by `load_arm`."""

    model: Any
    scratch: Any


def load_arm(path: str) -> Arm:
    """Arm of the MJCF file at path, with joints q1 to q6 and all other joints locked.

    What hangs from the wrist (sensor, hand, fingers) becomes part of the last link. Pinocchio takes
    masses only from explicit `<inertial>` elements or from geoms that can collide, and ignores
    `<include>`.

    Raises:
        FileNotFoundError: no such file.
        ValueError: a joint q1 to q6 is missing or is not a hinge, or they come in another order.
    """
    if not isfile(path):
        raise FileNotFoundError(f"no MJCF file {path}")
    whole = pin.buildModelFromMJCF(path)
    locked = [i for i in range(1, whole.njoints) if whole.names[i] not in ARM_JOINTS]
    model = pin.buildReducedModel(whole, locked, pin.neutral(whole))
    names = tuple(model.names)[1:]
    if names != ARM_JOINTS or model.nq != len(ARM_JOINTS):
        raise ValueError(f"{path}: expected the hinges {ARM_JOINTS} in this order, found {names}")
    return Arm(model, model.createData())


def gravity_feedforward(q: Array, arm: Arm) -> Array:
    """GF: motor currents (6,) A that hold the arm against gravity at joint positions q (6,) rad.

    (dm/dq)^-T g(q) / kt, with g the generalised gravity forces of the arm. They are not limited.
    """
    gravity: Array = pin.computeGeneralizedGravity(arm.model, arm.scratch, q)
    return motor_torque(gravity, q) / TORQUE_CONSTANT


def encode_arm(arm: Arm) -> bytes:
    """Gravity and, of each joint, axis, place, and mass, centre and inertia of its link, as floats.

    Raises:
        ValueError: a joint turns about no axis of its own frame.
    """
    model = arm.model
    numbers = [*model.gravity.linear]
    for joint in range(1, model.njoints):
        link = model.inertias[joint]
        axis = _KINDS.index(model.joints[joint].shortname())
        place = model.jointPlacements[joint].homogeneous[:3].ravel()
        numbers += (axis, *place, link.mass, *link.lever, *link.inertia.ravel())
    return pack(_ARM, *numbers)


def decode_arm(data: bytes) -> Arm:
    """See `encode_arm`. Raises struct.error or ValueError for other bytes."""
    numbers = np.array(unpack(_ARM, data))
    model = pin.Model()
    model.gravity.linear = numbers[:3]
    rows = numbers[3:].reshape(len(ARM_JOINTS), -1)
    for name, (axis, *row) in zip(ARM_JOINTS, rows.tolist(), strict=True):
        place, centre, inertia = (np.array(row[a:b]) for a, b in ((0, 12), (13, 16), (16, 25)))
        X = place.reshape(3, 4)
        kind = getattr(pin, _KINDS[int(axis)])()
        joint = model.addJoint(model.njoints - 1, kind, pin.SE3(X[:, :3], X[:, 3]), name)
        model.inertias[joint] = pin.Inertia(row[12], centre, inertia.reshape(3, 3))
    return Arm(model, model.createData())
