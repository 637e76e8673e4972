"""Joints that stay where they are, whatever drives them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.model import find, positions_of, velocities_of

_HEAVY = 1e5  # times its own inertia; from 1e7 on the solver of contacts loses digits


class HeldJoints:
    """Some joints, kept at the positions of now."""

    def __init__(self, model: Any, data: Any, joints: Sequence[int]) -> None:
        self._data = data
        self._where, self._moving = positions_of(model, joints), velocities_of(model, joints)
        self._positions = data.qpos[self._where].copy()

    def put_back(self) -> None:
        """To the kept positions, at rest."""
        self._data.qpos[self._where] = self._positions
        self._data.qvel[self._moving] = 0.0


class Brakes:
    """Joints that are blocked, until they are released.

    To all other joints a blocked one is as good as welded, since its inertia is that of a very
    large rotor (`armature`), and after each step it is put back where it was. Dry friction or an
    equality does neither: MuJoCo's constraints are soft, and creep under a load.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self._model, self._data = model, data
        self._own = np.array((model.dof_armature, model.dof_M0))
        self.release()

    def release(self) -> None:
        """All of them."""
        self._model.dof_armature[:], self._model.dof_M0[:] = self._own
        self._joints: set[int] = set()
        self.joints: HeldJoints | None = None
        """What to put back after each step."""

    def set(self, joint: str, blocked: bool) -> None:
        """Block a joint, or release it.

        One that moves stops at once, and all others go on with the momentum that there is.

        Raises:
            PlantError: no such joint.
        """
        model, data = self._model, self._data
        index = find(model, "joint", joint)
        moving = velocities_of(model, (index,))
        momentum = np.zeros((1, model.nv))
        mujoco.mj_mulM(model, data, momentum[0], data.qvel)
        rotor = blocked * _HEAVY * self._own[1, moving]
        # MuJoCo takes the second for bodies whose inertia no other joint changes.
        model.dof_armature[moving], model.dof_M0[moving] = self._own[:, moving] + rotor
        mujoco.mj_makeM(model, data)
        mujoco.mj_factorM(model, data)
        if blocked:
            velocities = np.zeros((1, model.nv))
            mujoco.mj_solveM(model, data, velocities, momentum)
            data.qvel[:] = velocities[0]
        (self._joints.add if blocked else self._joints.discard)(index)
        self.hold()

    def hold(self) -> None:
        """From now on at the positions of now."""
        self.joints = (
            HeldJoints(self._model, self._data, tuple(self._joints)) if self._joints else None
        )
        if self.joints is not None:
            self.joints.put_back()
        mujoco.mj_step1(self._model, self._data)
