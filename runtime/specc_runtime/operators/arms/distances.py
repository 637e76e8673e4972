"""Distances of an arm at given joint positions: between two things, and to all that it may hit.

They are those of the shapes that collide in MuJoCo, by its own algorithms, and negative where two
overlap. What other joints than those of the arm move is where it was at the start of the model, so
the places of loose things have to be told by other means.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from specc_runtime.operators.arms.library import mujoco
from specc_runtime.operators.arms.model import Arm
from specc_runtime.operators.arrays import Array

Pairs = tuple[tuple[int, int], ...]


def distance(arm: Arm, q: Array, one: str, other: str, most_m: float) -> float:
    """The distance in m between two things with the arm at q (n,), and most_m if it is larger.

    Args:
        arm: of n joints.
        q: (n,), rad or m.
        one, other: names of a geom, or of a body whose geoms that collide are meant.
        most_m: the largest distance that is looked for.

    Raises:
        ValueError: the model has no such thing, or it has no geoms.
    """
    return _smallest(arm, q, tuple(product(_geoms(arm, one), _geoms(arm, other))), most_m)


def clearance(arm: Arm, q: Array, most_m: float) -> float:
    """The distance in m of what the arm moves to the rest and to itself; most_m if it is larger.

    The rest is what does not move against the base. Left out are pairs that MuJoCo never lets
    collide: neighbours, pairs that the model excludes, and geoms whose masks (contype, conaffinity)
    do not meet, even where the model names them as a pair of contacts.
    """
    return _smallest(arm, q, _pairs(arm), most_m)


def _smallest(arm: Arm, q: Array, pairs: Pairs, most_m: float) -> float:
    data = arm.at(q)
    mujoco.mj_kinematics(arm.model, data)
    least = most_m
    for one, other in pairs:
        # No bound below zero: MuJoCo would not look for deeper overlaps.
        bound = max(least, 0.0)
        least = min(least, mujoco.mj_geomDistance(arm.model, data, one, other, bound, None))
    return float(least)


def _geoms(arm: Arm, name: str) -> tuple[int, ...]:
    """Where a geom and a body have one name, the geom."""
    model = arm.model
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM.value, name)
    if geom >= 0:
        return (geom,)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY.value, name)
    if body < 0:
        raise ValueError(f"the model has neither a geom nor a body '{name}'")
    of_body = (int(each) for each in np.flatnonzero(model.geom_bodyid == body))
    found = tuple(each for each in of_body if _collides(model, each))
    if not found:
        raise ValueError(f"body '{name}' has no geoms that collide")
    return found


def _collides(model: Any, geom: int) -> bool:
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom])


@lru_cache(maxsize=16)
def _pairs(arm: Arm) -> Pairs:
    """Geoms of the arm that may hit others, by the rules of MuJoCo for contacts."""
    model = arm.model
    moved = _moved(arm)
    fixed = model.body_weldid == model.body_weldid[arm.base.body]
    geoms = [geom for geom in range(model.ngeom) if _collides(model, geom)]
    return tuple(
        (one, other)
        for one in geoms
        for other in geoms
        if moved[model.geom_bodyid[one]]
        and (fixed[model.geom_bodyid[other]] or (moved[model.geom_bodyid[other]] and one < other))
        and _may_touch(model, one, other)
    )


def _moved(arm: Arm) -> list[bool]:
    """Of each body, whether the first joint of the arm moves it."""
    first = int(arm.model.jnt_bodyid[arm.joints[0]])
    moved: list[bool] = []
    for body in range(arm.model.nbody):
        parent = int(arm.model.body_parentid[body])
        moved.append(body == first or (body > 0 and moved[parent]))
    return moved


def _may_touch(model: Any, one: int, other: int) -> bool:
    a, b = (int(model.body_weldid[model.geom_bodyid[geom]]) for geom in (one, other))
    above = [int(model.body_weldid[model.body_parentid[body]]) for body in (a, b)]
    if a == b or (a and b and (a == above[1] or b == above[0])):
        return False
    bodies = sorted(int(model.geom_bodyid[geom]) for geom in (one, other))
    if (bodies[0] << 16) + bodies[1] in model.exclude_signature:
        return False
    masks = model.geom_contype, model.geom_conaffinity
    return bool(masks[0][one] & masks[1][other] or masks[0][other] & masks[1][one])
