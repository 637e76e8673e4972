"""Whether the open hand has room beside other objects on its straight way to a grasp.

In F, between the fingertips with z along the approach. The sizes are those of the hand with open
fingers, with a margin for the errors of poses and of the approach.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.irp6 import FINGERS_UPPER
from specc_runtime.operators.vision.values import Object, move_points

MARGIN_M = 0.006
FINGER_HALF_WIDTH_M = 0.011
FINGER_THICKNESS_M = 0.016
HAND_HALF_SIDES_M = (0.037, 0.066)
HAND_ABOVE_TIPS_M = 0.09


def hand_has_room(X_BF: Array, others: tuple[Object, ...]) -> bool:
    """Whether no point of the dense clouds of others, in B, is in the way of the hand to X_BF."""
    X_FB = np.linalg.inv(X_BF).astype(np.float64)
    return not any(_in_the_way(move_points(X_FB, each.C_rgb.points)).any() for each in others)


def _in_the_way(points: Array) -> NDArray[np.bool_]:
    """For points in F (n, 3), whether the fingers or the hand sweep over them."""
    x, y = np.abs(points[:, 0]), np.abs(points[:, 1])
    inner = FINGERS_UPPER / 2 - MARGIN_M
    outer = FINGERS_UPPER / 2 + FINGER_THICKNESS_M + MARGIN_M
    beside = (x < FINGER_HALF_WIDTH_M + MARGIN_M) & (inner < y) & (y < outer)
    half_x, half_y = HAND_HALF_SIDES_M
    under_hand = (x < half_x + MARGIN_M) & (y < half_y + MARGIN_M)
    z = points[:, 2]
    at_fingers = beside & (z < MARGIN_M)
    at_hand = under_hand & (z < MARGIN_M - HAND_ABOVE_TIPS_M)
    return np.asarray(at_fingers | at_hand)
