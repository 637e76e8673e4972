"""The rigid motion that brings one set of points onto another."""

from __future__ import annotations

import numpy as np

from specc_runtime.operators.arrays import Array


def fit_rigid(p_B: Array, p_A: Array) -> Array:
    """X_AB (4, 4) with the least sum of squares of X_AB p_B - p_A, for points (n, 3), n >= 3.

    Kabsch's method: the rotation comes from the singular vectors of the covariance.
    """
    mean_A, mean_B = p_A.mean(axis=0), p_B.mean(axis=0)
    U, _, Vt = np.linalg.svd((p_A - mean_A).T @ (p_B - mean_B))
    handedness = np.sign(np.linalg.det(U @ Vt))
    R_AB = U @ np.diag([1.0, 1.0, handedness]) @ Vt
    X_AB = np.eye(4)
    X_AB[:3, :3] = R_AB
    X_AB[:3, 3] = mean_A - R_AB @ mean_B
    return X_AB
