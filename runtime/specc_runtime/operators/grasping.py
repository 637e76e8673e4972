"""LR and GC: where the two fingers take a box, and the pose of the end-effector for that.

F is the frame between the fingertips: z along the approach, y from the right finger to the left.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.irp6 import FINGERS_LOWER, FINGERS_UPPER
from specc_runtime.operators.kinematics import reachable
from specc_runtime.operators.vision.values import Object

# The fingers are asked to come this much closer than the side is wide, so that they press.
SQUEEZE_M = 0.004
SHORTEST_SIDE_M = FINGERS_LOWER + SQUEEZE_M
LONGEST_SIDE_M = FINGERS_UPPER - 0.002
MAX_SINK_M = 0.04  # irp6_grasping, the later variant
# A box tilted by less is taken from straight above: it lies flat, the tilt is an error of its pose.
LEVEL_RAD = 0.17
# The upmost face of a box can be tilted by at most 0.955 rad; beyond this the arm gets too low.
MAX_TILT_RAD = 0.6


@dataclass(frozen=True, slots=True, eq=False)
class FingerPoses:
    """Poses in B of the left and the right fingertip, (4, 4), with the axes of F."""

    X_Bl: Array
    X_Br: Array


class NotGraspable(ValueError):
    """An object that the gripper cannot take from above; carries its label and the reason."""

    def __init__(self, label: str, reason: str) -> None:
        """Keep the label of the object and the reason."""
        super().__init__(f"object {label} cannot be grasped: {reason}")
        self.label = label
        self.reason = reason


def left_right_grasp(target: Object) -> FingerPoses:
    """LR (text before eq. 67): poses of the fingertips that take a box, in B, from above.

    The approach is against the normal of the upmost face, straight down if that is nearly level.
    The fingers close across the shorter side of the face that fits them, their line through the
    middle of the box, at most MAX_SINK_M and never more than half way below the face. Of the two
    ways round, the left finger is the one farther from the column of the arm; this keeps the last
    joint within a quarter turn of its middle.

    Raises:
        NotGraspable: the upmost face is too steep, or neither of its sides fits the fingers.
    """
    R_BO, centre = target.X[:3, :3], target.X[:3, 3]
    up = int(np.argmax(np.abs(R_BO[2])))
    normal = R_BO[:, up] * np.sign(R_BO[2, up])
    if normal[2] < cos(MAX_TILT_RAD):
        raise NotGraspable(target.label, "no face of it is nearly level")
    face_centre = centre + normal * target.size[up] / 2
    approach = np.array([0.0, 0.0, -1.0]) if normal[2] > cos(LEVEL_RAD) else -normal
    across = _side_across(target, up)
    middle = face_centre + approach * min(MAX_SINK_M, target.size[up] / 2)
    R_BF = _axes(approach, R_BO[:, across], centre)
    reach = R_BF[:, 1] * (target.size[across] - SQUEEZE_M) / 2
    return FingerPoses(_pose(R_BF, middle + reach), _pose(R_BF, middle - reach))


def grasp_pose(fingers: FingerPoses, X_EF: Array) -> Array:
    """GC (eq. 68): the pose X_BE that brings F between the two fingertips."""
    middle = (fingers.X_Bl[:3, 3] + fingers.X_Br[:3, 3]) / 2
    X_BE: Array = _pose(fingers.X_Bl[:3, :3], middle) @ np.linalg.inv(X_EF)
    return X_BE


def graspable(target: Object, X_EF: Array, X_PG: Array, q_p: Array) -> bool:
    """Whether LR finds a grasp that the arm reaches, and with it the pre-grasp pose (eqs 67 to 69).

    Args:
        target: a box, in B.
        X_EF: (4, 4) centre of the gripper in the end-effector.
        X_PG: (4, 4) grasp pose seen from the pre-grasp pose.
        q_p: (6,) rad, joints before the motion, which choose the branch of IK.
    """
    try:
        X_BE = grasp_pose(left_right_grasp(target), X_EF)
    except NotGraspable:
        return False
    return reachable(X_BE, q_p) and reachable(X_BE @ np.linalg.inv(X_PG), q_p)


def _side_across(target: Object, up: int) -> int:
    """The axis of the box that the fingers close along: the shorter that fits them."""
    sides = target.size.tolist()
    fitting = [
        axis for axis in range(3) if axis != up and SHORTEST_SIDE_M <= sides[axis] <= LONGEST_SIDE_M
    ]
    if not fitting:
        raise NotGraspable(target.label, "no side of its uppermost face fits between the fingers")
    return min(fitting, key=lambda axis: sides[axis])


def _axes(approach: Array, side: Array, centre: Array) -> Array:
    """R_BF (3, 3): z along the approach, y along the side as it is across that, away from B."""
    y = side - approach * (approach @ side)
    y = y / np.linalg.norm(y)
    if y[0] * centre[0] + y[1] * centre[1] < 0:
        y = -y
    return np.column_stack([np.cross(y, approach), y, approach])


def _pose(R: Array, position: Array) -> Array:
    X = np.eye(4)
    X[:3, :3] = R
    X[:3, 3] = position
    return X
