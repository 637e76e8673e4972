"""The IRp-6 as its published URDF describes it; shares nothing with the operators."""

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

HALF_PI = np.pi / 2
# Origins of the frames of joints q1 to q6 in the one before, and turns of the frame about x.
JOINTS = (
    ((0.0, 0.0, 0.25 + 0.3), 0.0),
    ((0.0, 0.0, 0.4), -HALF_PI),
    ((0.455, 0.0, 0.0), 0.0),
    ((0.0, 0.67, 0.0), 0.0),
    ((0.0, 0.0, 0.0), -HALF_PI),
    ((0.0, 0.0, 0.19), HALF_PI),
)

LOWER = np.array([-2.4, -2.2689280276, -0.6108652382, -1.5707963268, -10.0, -2.88])
UPPER = np.array([2.9670597284, -0.872664626, 0.6981317008, 1.6057029118, 10.0, 2.93])
MOTOR_LOWER = np.array([-470.0, -110.0, -80.0, -70.0, -80.0, -1000.0])
MOTOR_UPPER = np.array([450.0, 100.0, 100.0, 380.0, 490.0, 3000.0])
FRONT = np.array([0.0, -HALF_PI, 0.0, 0.0, 3 * HALF_PI, -HALF_PI])  # published; tool downwards


def shift(x: float, y: float, z: float) -> Matrix:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def turn(axis: str, angle: float) -> Matrix:
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    pose = np.eye(4)
    pose[i, i] = pose[j, j] = np.cos(angle)
    pose[j, i] = np.sin(angle)
    pose[i, j] = -pose[j, i]
    return pose


def link_poses(q: Matrix) -> list[Matrix]:
    """Poses in B of the six links; the last is the wrist."""
    poses, pose = [], np.eye(4)
    for (origin, about_x), angle in zip(JOINTS, q, strict=True):
        pose = pose @ shift(*origin) @ turn("x", about_x) @ turn("z", float(angle))
        poses.append(pose)
    return poses


def end_effector(q: Matrix) -> Matrix:
    return link_poses(q)[-1] @ shift(0.0, 0.0, 0.25)


def tool_down(x: float, y: float, z: float, yaw: float) -> Matrix:
    """Pose of E at a place in B with its z axis downwards."""
    return shift(x, y, z) @ turn("z", yaw) @ turn("x", np.pi)
