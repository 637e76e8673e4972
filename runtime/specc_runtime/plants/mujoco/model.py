"""Loading an MJCF model and finding things in it by name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.library import mujoco

HOME = "home"
OVERVIEW = "overview"
"""The camera of films, unless another is asked for."""
Indices: TypeAlias = NDArray[np.intp]

# Coordinates of a free, ball, slide and hinge joint.
_POSITIONS = (7, 4, 1, 1)
_VELOCITIES = (6, 3, 1, 1)

_KINDS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "camera": mujoco.mjtObj.mjOBJ_CAMERA,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
    "sensor": mujoco.mjtObj.mjOBJ_SENSOR,
}
_COUNTS = {
    "body": "nbody",
    "joint": "njnt",
    "geom": "ngeom",
    "site": "nsite",
    "camera": "ncam",
    "actuator": "nu",
    "sensor": "nsensor",
}


def load_model(path: str) -> Any:
    """MjModel of the MJCF file at path; a model without a camera `overview` gets one.

    An actuator without a name is called after the joint, tendon, site or body that it acts on.
    Where an actuator has that name, `_2`, `_3` and so on follows. The compiler does the same.

    The simulation is told not to reset itself when it diverges, so that divergence can be reported.

    Raises:
        PlantError: no such file, or MuJoCo rejects it.
    """
    if not Path(path).is_file():
        raise PlantError(f"no model file {path}")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
        has_view = OVERVIEW in names_of(model, "camera")
        if not has_view or len(names_of(model, "actuator")) < model.nu:
            spec = mujoco.MjSpec.from_file(str(path))
            _name_actuators(spec)
            if not has_view:
                _add_overview(spec, model)
            model = spec.compile()
    except ValueError as error:
        raise PlantError(f"{path}: {error}") from error
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    return model


def _name_actuators(spec: Any) -> None:
    names = {actuator.name for actuator in spec.actuators}
    last: dict[str, int] = {}
    for actuator in spec.actuators:
        if not actuator.name:
            part = actuator.target
            number = last.get(part, 0) + 1
            while (name := part if number == 1 else f"{part}_{number}") in names:
                number += 1
            last[part] = number
            names.add(name)
            actuator.name = name


def _add_overview(spec: Any, model: Any) -> None:
    """Add a camera for people, where MuJoCo's own viewer would begin."""
    view = model.vis.global_
    azimuth, elevation = np.radians((view.azimuth, view.elevation))
    forward = np.array(
        (
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        )
    )
    right = np.array((np.sin(azimuth), -np.cos(azimuth), 0.0))
    turn = np.stack((right, np.cross(right, forward), -forward), axis=1)
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    place = model.stat.center - 1.5 * model.stat.extent * forward
    spec.worldbody.add_camera(name=OVERVIEW, pos=place, quat=quaternion)


def names_of(model: Any, kind: str) -> tuple[str, ...]:
    """Names of all named things of a kind: body, joint, geom, site, camera, actuator, sensor."""
    ids = range(getattr(model, _COUNTS[kind]))
    names = (mujoco.mj_id2name(model, _KINDS[kind].value, i) for i in ids)
    return tuple(name for name in names if name)


def find(model: Any, kind: str, name: str) -> int:
    """Index of the thing of that kind and name.

    Raises:
        PlantError: there is none; carries the known names.
    """
    index: int = mujoco.mj_name2id(model, _KINDS[kind].value, name)
    if index < 0:
        raise PlantError(f"the model has no {kind} '{name}'", known=names_of(model, kind))
    return index


def position_indices(model: Any, joints: tuple[str, ...]) -> Indices:
    """Indices into qpos of the coordinates of the named joints, in order."""
    return positions_of(model, [find(model, "joint", name) for name in joints])


def velocity_indices(model: Any, joints: tuple[str, ...]) -> Indices:
    """Indices into qvel of the velocities of the named joints, in order."""
    return velocities_of(model, [find(model, "joint", name) for name in joints])


def positions_of(model: Any, joints: Sequence[int]) -> Indices:
    """Indices into qpos of the coordinates of joints, in order."""
    return _coordinates(model, joints, model.jnt_qposadr, _POSITIONS)


def velocities_of(model: Any, joints: Sequence[int]) -> Indices:
    """Indices into qvel of the velocities of joints, in order."""
    return _coordinates(model, joints, model.jnt_dofadr, _VELOCITIES)


def _coordinates(model: Any, joints: Sequence[int], starts: Any, sizes: tuple[int, ...]) -> Indices:
    found: list[int] = []
    for joint in joints:
        start = int(starts[joint])
        found.extend(range(start, start + sizes[model.jnt_type[joint]]))
    return np.array(found, dtype=np.intp)


def initial_positions(model: Any) -> Array:
    """qpos at time 0: keyframe `home`; else custom numeric `home` for the first coordinates."""
    for key in range(model.nkey):
        if model.key(key).name == HOME:
            return np.array(model.key_qpos[key])
    start = np.array(model.qpos0)
    for numeric in range(model.nnumeric):
        if model.numeric(numeric).name == HOME:
            leading = model.numeric(numeric).data
            start[: len(leading)] = leading
    return start


def set_start(model: Any, data: Any) -> None:
    """Positions of time 0 into data; with keyframe `home` its controls and activations, too.

    So an arm with servos is held from the first step on, and not only once a command comes.
    """
    for key in range(model.nkey):
        if model.key(key).name == HOME:
            data.ctrl[:], data.act[:] = model.key_ctrl[key], model.key_act[key]
    data.qpos[:] = initial_positions(model)
