"""How far the joints of a robot go in a run that is to hold its pose."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from specc_runtime.plants.mujoco.driven import moments
from specc_runtime.plants.mujoco.plant import MujocoPlant

NEAR = {mujoco.mjtJoint.mjJNT_HINGE.value: 0.05, mujoco.mjtJoint.mjJNT_SLIDE.value: 0.005}
"""Kind of joint -> how far it may go, rad or m."""


@contextmanager
def farthest() -> Iterator[dict[str, float]]:
    """Joint with an actuator -> the farthest from its first position, in parts of what it may.

    Of all plants that advance meanwhile.
    """
    found: dict[str, float] = {}
    first: dict[str, float] = {}
    advance = MujocoPlant.advance

    def watched(self: Any, duration_s: float) -> None:
        model, data = self._model, self._data
        rows = [moments(model, data, index) for index in range(model.nu)]
        joints = {int(model.dof_jntid[dof]) for row in rows for dof in np.flatnonzero(row)}
        for joint in (joint for joint in joints if int(model.jnt_type[joint]) in NEAR):
            name, where = model.joint(joint).name, float(data.qpos[model.jnt_qposadr[joint]])
            far = abs(where - first.setdefault(name, where)) / NEAR[int(model.jnt_type[joint])]
            found[name] = max(far, found.get(name, 0.0))
        advance(self, duration_s)

    MujocoPlant.advance = watched  # type: ignore[method-assign]  # measured around
    try:
        yield found
    finally:
        MujocoPlant.advance = advance  # type: ignore[method-assign]  # measured around
