"""Loading an MJCF model and finding things in it by name."""

from pathlib import Path
from typing import Any

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.library import mujoco

HOME = "home"

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
    """MjModel of the MJCF file at path.

    The simulation is told not to reset itself when it diverges, so that divergence can be reported.

    Raises:
        PlantError: no such file, or MuJoCo rejects it.
    """
    if not Path(path).is_file():
        raise PlantError(f"no model file {path}")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise PlantError(f"{path}: {error}") from error
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    return model


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


def position_indices(model: Any, joints: tuple[str, ...]) -> Array:
    """Indices into qpos of the coordinates of the named joints, in order."""
    return _joint_indices(model, joints, model.jnt_qposadr, (7, 4, 1, 1))


def velocity_indices(model: Any, joints: tuple[str, ...]) -> Array:
    """Indices into qvel of the velocities of the named joints, in order."""
    return _joint_indices(model, joints, model.jnt_dofadr, (6, 3, 1, 1))


def _joint_indices(model: Any, joints: tuple[str, ...], starts: Any, sizes: Any) -> Any:
    found: list[int] = []
    for name in joints:
        joint = find(model, "joint", name)
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
