"""What a model says of itself, as plain data: joints, actuators, sensors, and how its pose is held.

The keys are those of `specc.tools.starting.facts`, which reads them.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.driven import AT_SITE, JOINT_KINDS, Driven, driven
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.model import HOME, initial_positions, load_model
from specc_runtime.plants.mujoco.posture import HeldPosture, confined, hold_posture, period_s

_LEVEL = 1e-6


def described(path: str) -> dict[str, Any]:
    """Facts about the MJCF file at `path`.

    Raises:
        PlantError: no such file, MuJoCo rejects it, or something of it is infinite or no number.
    """
    model = load_model(path)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    own = {j for a in driven(model, data)[0] for j in a.joints}
    keyframe, wanted = _wanted(model, own)
    trees = {int(model.body_rootid[model.jnt_bodyid[j]]) for j in own}
    robot = (j for j in range(model.njnt) if model.body_rootid[model.jnt_bodyid[j]] in trees)
    places = dict(pair for joint in robot for pair in _coordinates(model, joint))
    settable = np.isin(np.arange(model.nq), list(places))
    begun = initial_positions(model)
    start = np.where(settable, confined(model, wanted), begun)
    data.qpos[:] = start
    mujoco.mj_forward(model, data)
    actuators, refused = driven(model, data)
    wheels = frozenset(j for a in actuators for j in a.joints if _is_wheel(model, j))
    how = hold_posture(model, start, settable, actuators, wheels) if actuators else None
    final = start if how is None else how.start
    moved = {places[i]: float(final[i]) for i in places if abs(final[i] - begun[i]) > _LEVEL}
    facts: dict[str, Any] = {
        "keyframe": keyframe,
        "scene": moved,
        "settles_elsewhere": bool(np.abs(final - start).max(initial=0.0) > _LEVEL),
        "timestep_s": float(model.opt.timestep),
        "period_s": period_s(model),
        "joints": [_joint(model, final, wheels, j) for j in range(model.njnt)],
        "parents": [int(parent) for parent in model.body_parentid],
        "actuators": _actuators(model, actuators, how),
        "refused": refused,
        "thrusters": [name for name, why in refused.items() if why == AT_SITE],
        "mocap": dict(_mocap(model)),
        "frequency": how.frequency if how else 0.0,
        "drift": _named(model, how.strayed) if how else {},
        "sensors": [_sensor(model, i) for i in range(model.nsensor)],
        "cameras": [model.camera(i).name for i in range(model.ncam)],
        # Those of textures that MuJoCo draws are named here, too.
        "files": [os.fsdecode(each) for each in model.paths.split(b"\0") if each],
    }
    for kind in ("joint", "actuator", "sensor"):
        for part in facts[f"{kind}s"]:
            _refuse_infinite(kind, part)
    return facts


def _refuse_infinite(kind: str, part: Mapping[str, Any]) -> None:
    for key, value in part.items():
        numbers = value if isinstance(value, list) else [value]
        if not all(np.isfinite(number).all() for number in numbers if _is_number(number)):
            shown = ascii(part["name"])[1:-1]
            raise PlantError(f"{kind} {shown}: {_WORDS.get(key, key)} is infinite or no number")


def _is_number(value: Any) -> bool:
    return isinstance(value, float | list)


_WORDS = {"least": "the least control", "greatest": "the greatest control", "start": "its start"}


def _wanted(model: Any, driven: Iterable[int]) -> tuple[str | None, Array]:
    """The keyframe of the start, and its positions, driven joints within their ranges.

    A run begins in the keyframe `home`; a scene leads to another one.
    """
    keyframe, wanted = None, initial_positions(model)
    names = [model.key(key).name for key in range(model.nkey)]
    if HOME in names:
        keyframe = HOME
    elif names:
        keyframe, wanted = names[0] or "number 1", np.array(model.key_qpos[0])
    if not np.isfinite(wanted).all():
        raise PlantError(f"keyframe {keyframe}: a position is infinite or no number")
    for joint in driven:
        _confine(model, wanted, joint)
    return keyframe, wanted


def _coordinates(model: Any, joint: int) -> Iterator[tuple[int, str]]:
    """What a scene can set of a joint: place in the positions, and name."""
    name, kind = model.joint(joint).name, JOINT_KINDS[model.jnt_type[joint]]
    where = int(model.jnt_qposadr[joint])
    if name and kind == "free":
        yield from ((where + axis, f"{name}.{letter}") for axis, letter in enumerate("xyz"))
    elif name and kind != "ball":
        yield where, name


def _confine(model: Any, positions: Array, joint: int) -> None:
    """Put a joint beyond its range inside: by a twentieth of the range, by 0.05 at most."""
    where = int(model.jnt_qposadr[joint])
    least, greatest = (float(end) for end in model.jnt_range[joint])
    inside = min((greatest - least) / 20.0, 0.05)
    is_beyond = not least - _LEVEL <= positions[where] <= greatest + _LEVEL
    if model.jnt_limited[joint] and is_beyond:
        positions[where] = min(max(positions[where], least + inside), greatest - inside)


def _is_wheel(model: Any, joint: int) -> bool:
    """Whether a hinge turns without end and carries no other joint, beside another like it."""
    if JOINT_KINDS[model.jnt_type[joint]] != "hinge" or model.jnt_limited[joint]:
        return False
    body = int(model.jnt_bodyid[joint])
    if "wheel" in model.joint(joint).name.lower():
        return True
    siblings = [
        other
        for other in range(model.njnt)
        if other != joint
        and JOINT_KINDS[model.jnt_type[other]] == "hinge"
        and not model.jnt_limited[other]
        and model.body_parentid[model.jnt_bodyid[other]] == model.body_parentid[body]
        and model.body_parentid[body] != 0
    ]
    carries = any(model.body_parentid[b] == body for b in model.jnt_bodyid)
    return bool(siblings) and not carries


def _joint(model: Any, start: Array, wheels: frozenset[int], joint: int) -> dict[str, Any]:
    limits = [float(v) for v in model.jnt_range[joint]]
    return {
        "name": model.joint(joint).name,
        "kind": JOINT_KINDS[model.jnt_type[joint]],
        "body": int(model.jnt_bodyid[joint]),
        "body_name": model.body(int(model.jnt_bodyid[joint])).name,
        "start": float(start[model.jnt_qposadr[joint]]),
        "range": limits if model.jnt_limited[joint] else None,
        "wheel": joint in wheels,
    }


def _mocap(model: Any) -> Iterator[tuple[str, list[str]]]:
    """The bodies that mocap places, each with the bodies that constraints tie to it."""
    ties = [
        {int(model.eq_obj1id[i]), int(model.eq_obj2id[i])}
        for i in range(model.neq)
        if model.eq_objtype[i] == mujoco.mjtObj.mjOBJ_BODY
    ]
    for body in np.flatnonzero(model.body_mocapid >= 0):
        tied = {other for tie in ties if body in tie for other in tie - {int(body), 0}}
        names = (_body_name(model, other) for other in sorted(tied))
        yield _body_name(model, int(body)), list(names)


def _body_name(model: Any, body: int) -> str:
    return model.body(body).name or f"body {body}"


def _actuators(
    model: Any, actuators: list[Driven], how: HeldPosture | None
) -> list[dict[str, Any]]:
    if how is None:
        return []
    laws = how.laws
    rows = zip(actuators, laws.rest, laws.gain, laws.damping, strict=True)
    return [
        {
            "name": each.name,
            "kind": each.kind,
            "joints": [[joint, change] for joint, change in each.joints.items()],
            "linear": each.linear,
            "factor": each.gain,
            "least": each.least,
            "greatest": each.greatest,
            "rest": float(rest),
            "gain": float(gain),
            "damping": float(damping),
        }
        for each, rest, gain, damping in rows
    ]


def _named(model: Any, strayed: dict[int, float]) -> dict[str, float]:
    far = {model.joint(joint).name: value for joint, value in strayed.items()}
    return {name: value if np.isfinite(value) else 1e9 for name, value in far.items()}


def _sensor(model: Any, index: int) -> dict[str, Any]:
    kind = mujoco.mjtObj(int(model.sensor_objtype[index]))
    name = mujoco.mj_id2name(model, kind.value, int(model.sensor_objid[index])) or ""
    return {
        "name": model.sensor(index).name,
        "of": kind.name.removeprefix("mjOBJ_").lower(),
        "object": name,
        "size": int(model.sensor_dim[index]),
        "cutoff": float(model.sensor_cutoff[index]),
    }
