"""Poses: the position and the quaternion of a model, w first, to a measured pose (4, 4)."""

from typing import Any

import numpy as np

from specc_runtime.builtins import pose
from specc_runtime.distortion import Distortion
from specc_runtime.operators.arrays import Array
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.model import find

_SENSORS = [mujoco.mjtSensor.mjSENS_FRAMEPOS.value, mujoco.mjtSensor.mjSENS_FRAMEQUAT.value]
_FREE = mujoco.mjtJoint.mjJNT_FREE.value


def check_pose(model: Any, binding: SensorBinding) -> None:
    """Raises PlantError unless the binding names one position and one orientation."""
    sensors = [int(model.sensor_type[find(model, "sensor", name)]) for name in binding.sensors]
    joints = [int(model.jnt_type[find(model, "joint", name)]) for name in binding.joints]
    named = joints, sensors
    if named not in (([], _SENSORS), ([_FREE], [])) or binding.actuators:
        raise PlantError(
            f"sensor '{binding.name}': a pose is measured by a `framepos` and a `framequat`, in "
            "this order, or by a free joint"
        )


def measured_pose(raw: Array, noise: Array, distortion: Distortion | None) -> Array:
    """(4, 4) the pose of raw numbers (7,): x, y, z, then the quaternion w, x, y, z.

    It has six numbers: x, y, z in m, and the rotation vector in rad. `noise` (6,) and a bias shift
    it along the axes of the parent and turn it about its own; a scale multiplies all six.
    """
    position, quaternion = raw[:3] + noise[:3], _turned(raw[3:], noise[3:])
    if distortion is not None:
        scale, bias = (np.broadcast_to(each, 6) for each in (distortion.scale, distortion.bias))
        position = scale[:3] * position + bias[:3]
        scaled = _quaternion(scale[3:] * _rotation_vector(quaternion))
        quaternion = _turned(scaled, bias[3:])
    w, *axis = quaternion
    return pose(position, np.array((*axis, w)))


def _turned(quaternion: Array, by: Array) -> Array:
    """A quaternion turned about its own axes by a rotation vector (3,)."""
    if not by.any():
        return quaternion
    turned = np.empty(4)
    mujoco.mju_mulQuat(turned, quaternion, _quaternion(by))
    return turned


def _quaternion(rotation_vector: Array) -> Array:
    angle = float(np.linalg.norm(rotation_vector))
    found = np.array((1.0, 0.0, 0.0, 0.0))
    if angle > 0.0:
        mujoco.mju_axisAngle2Quat(found, rotation_vector / angle, angle)
    return found


def _rotation_vector(quaternion: Array) -> Array:
    found, unit = np.empty(3), np.array(quaternion)
    mujoco.mju_normalize4(unit)
    mujoco.mju_quat2Vel(found, unit, 1.0)
    return found
