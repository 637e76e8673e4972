"""Ground truth of a simulated plant: for setting scenes and judging runs, never for agents."""

from collections.abc import Mapping
from math import atan2, hypot
from typing import Any

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.model import find, initial_positions, names_of

_FREE, _BALL = mujoco.mjtJoint.mjJNT_FREE.value, mujoco.mjtJoint.mjJNT_BALL.value
_FREE_ARE = ("x", "y", "z", "yaw")


class GroundTruth:
    """Poses, shapes, contacts and forces as the simulation knows them. World axes, SI units."""

    def __init__(self, model: Any, data: Any) -> None:
        self._model, self._data = model, data
        self._home = initial_positions(model)
        self._ids: dict[tuple[str, str], int] = {}
        self._forces: dict[tuple[str, ...], list[Array]] = {}  # views of the simulation

    @property
    def time_s(self) -> float:
        """Simulated time since the reset."""
        return float(self._data.time)

    def body_pose(self, body: str) -> Array:
        """X_WB (4, 4): pose of the body in the world."""
        return self._pose(self._data.xpos, self._data.xmat, self._id("body", body))

    def site_pose(self, site: str) -> Array:
        """X_WS (4, 4): pose of the site in the world."""
        return self._pose(self._data.site_xpos, self._data.site_xmat, self._id("site", site))

    def position(self, body: str) -> Array:
        """(3,) origin of the body in the world, m."""
        return np.array(self._data.xpos[self._id("body", body)])

    def joint_position(self, joint: str) -> float:
        """Position of a hinge, rad, or of a slide, m."""
        return float(self._data.qpos[self._model.jnt_qposadr[self._id("joint", joint)]])

    def box_size(self, geom: str) -> Array:
        """(3,) lengths of the edges of a box, m.

        Raises:
            PlantError: the geom is not a box.
        """
        index = self._id("geom", geom)
        if self._model.geom_type[index] != mujoco.mjtGeom.mjGEOM_BOX.value:
            raise PlantError(f"geom '{geom}' is not a box")
        return np.array(2.0 * self._model.geom_size[index])

    def lowest_point(self, geom: str) -> float:
        """Height of the lowest corner of a box, m."""
        index = self._id("geom", geom)
        up = self._data.geom_xmat[index][6:]
        reach = float(np.abs(up) @ self._model.geom_size[index])
        return float(self._data.geom_xpos[index][2]) - reach

    def contact_force(self, *bodies: str) -> float:
        """Magnitude of the net contact force on the bodies together, N, at the last time step.

        Forces that the bodies exert through an object on one another cancel. MuJoCo computes them
        only for models with a force, torque or acceleration sensor.
        """
        forces = self._forces.get(bodies)
        if forces is None:
            ids = [self._id("body", body) for body in bodies]
            forces = self._forces[bodies] = [self._data.cfrc_ext[index, 3:] for index in ids]
        return hypot(*map(sum, zip(*[force.tolist() for force in forces], strict=True)))

    def touching(self, geom: str, body: str) -> bool:
        """Whether the geom touches any geom of the body."""
        one, other = self._id("geom", geom), self._id("body", body)
        owner = self._model.geom_bodyid
        for a, b in self._data.contact.geom[: self._data.ncon]:
            if (a == one and owner[b] == other) or (b == one and owner[a] == other):
                return True
        return False

    def move_body(self, body: str, X_WB: Array) -> None:
        """Put a free body to rest at a pose.

        Raises:
            PlantError: the body hangs on no free joint.
        """
        joint = int(self._model.body_jntadr[self._id("body", body)])
        if joint < 0 or self._model.jnt_type[joint] != _FREE:
            raise PlantError(f"body '{body}' cannot be moved: it is not free")
        start, speed = self._model.jnt_qposadr[joint], self._model.jnt_dofadr[joint]
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(X_WB[:3, :3]).ravel())
        self._data.qpos[start : start + 3] = X_WB[:3, 3]
        self._data.qpos[start + 3 : start + 7] = quaternion
        self._data.qvel[speed : speed + 6] = 0.0
        mujoco.mj_forward(self._model, self._data)

    def place(self, positions: Mapping[str, float], *, relative: bool = False) -> None:
        """Put joints at positions, m or rad, at rest; a free one by `name.x`, `.y`, `.z`, `.yaw`.

        `yaw` is how far it is turned about the vertical from how the model has it. `relative`: so
        far from where they are.

        Raises:
            PlantError: no such joint, or one that has no such coordinate.
        """
        known = names_of(self._model, "joint")
        for name, position in positions.items():
            joint, _, which = name.rpartition(".")
            joint, which = (name, "") if name in known or which not in _FREE_ARE else (joint, which)
            index = self._id("joint", joint)
            start, kind = self._model.jnt_qposadr[index], self._model.jnt_type[index]
            if which == "yaw" and kind == _FREE:
                now, home = (q[start + 3 : start + 7] for q in (self._data.qpos, self._home))
                _turn(now, position if relative else position - _turned(home, now))
            elif (kind == _FREE) == bool(which) and kind != _BALL:
                where = start + (_FREE_ARE.index(which) if which else 0)
                self._data.qpos[where] = position + relative * self._data.qpos[where]
            else:
                raise PlantError(f"joint '{joint}' has no coordinate '{which or 'position'}'")
            moving = self._model.jnt_dofadr[index]
            self._data.qvel[moving : moving + (6 if which else 1)] = 0.0
        mujoco.mj_forward(self._model, self._data)

    def _id(self, kind: str, name: str) -> int:
        key = kind, name
        if key not in self._ids:
            self._ids[key] = find(self._model, kind, name)
        return self._ids[key]

    @staticmethod
    def _pose(positions: Any, rotations: Any, index: int) -> Array:
        X = np.eye(4)
        X[:3, :3] = rotations[index].reshape(3, 3)
        X[:3, 3] = positions[index]
        return X


def _turn(quaternion: Any, angle: float) -> None:
    """Turn what has this orientation about the vertical."""
    turn, turned = np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(turn, np.array((0.0, 0.0, 1.0)), angle)
    mujoco.mju_mulQuat(turned, turn, quaternion)
    quaternion[:] = turned


def _turned(home: Any, now: Any) -> float:
    """How far an orientation is turned about the vertical from another one, rad.

    Any rotation is a tilt about a horizontal axis and then a turn about the vertical; this is the
    turn.
    """
    back, turn = np.zeros(4), np.zeros(4)
    mujoco.mju_negQuat(back, home)
    mujoco.mju_mulQuat(turn, now, back)
    return 2.0 * atan2(turn[3], turn[0])
