"""TO, US and GO: objects in another frame, the scene remembered, what can be picked (4.8).

What is remembered and not seen again loses confidence and never outranks what is seen, so that an
object that was picked and dropped elsewhere is not looked for where it lay.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.clearance import hand_has_room
from specc_runtime.operators.grasping import grasp_pose, graspable, left_right_grasp
from specc_runtime.operators.vision.values import Object, label_of, model_label_of

SAME_POSITION_M = 0.03
SAME_ROTATION_RAD = 0.35
# About the confidence of the weakest cluster that vision accepts.
FORGOTTEN_BELOW = 0.004

Objects = tuple[Object, ...]


def transform_objects(X_BK: Array, objects: Objects) -> Objects:
    """TO (text before eq. 64): objects known in K, in B: pose and all points of both clouds."""
    return tuple(
        replace(
            each,
            X=X_BK @ each.X,
            C_rgb=each.C_rgb.moved(X_BK),
            C_sift=each.C_sift.moved(X_BK),
        )
        for each in objects
    )


def update_scene(O_p: Objects, O_c: Objects) -> Objects:
    """US (eq. 64): the scene remembered (O_p) brought up to date with what is seen (O_c), in B.

    - Seen where an object of the same model is remembered: its label stays, pose and clouds are
      the new ones, the confidence is c_p / 2 + c_c.
    - Seen elsewhere: new, with c_c. If a remembered object of the same model is not seen where it
      was, it is the one that has come to lie here, and its old place is forgotten.
    - Not seen: c_p / 2, at most half of the least confidence of what is seen; forgotten below
      FORGOTTEN_BELOW.

    The paper says how confidences grow but not how they fade; the third rule is ours.
    """
    unseen = list(O_p)
    merged: list[Object] = []
    arrived: list[Object] = []
    for seen in O_c:
        known = _same_place(seen, unseen)
        if known is None:
            arrived.append(seen)
        else:
            unseen.remove(known)
            confidence = known.confidence / 2 + seen.confidence
            merged.append(replace(seen, label=known.label, confidence=confidence))
    for seen in arrived:
        moved = next((old for old in unseen if _same_model(old, seen)), None)
        if moved is not None:
            unseen.remove(moved)
        labels = {each.label for each in (*merged, *unseen)}
        merged.append(replace(seen, label=moved.label if moved else _free_label(seen, labels)))
    ceiling = min((each.confidence for each in merged), default=np.inf)
    faded = (replace(old, confidence=min(old.confidence, ceiling) / 2) for old in unseen)
    return (*merged, *(old for old in faded if old.confidence >= FORGOTTEN_BELOW))


def graspable_objects(objects: Objects, X_EF: Array, X_PG: Array, q_p: Array) -> Objects:
    """GO: the objects in B that the arm can take, in their order (not in the paper).

    Those beside which the open hand has room; if there are none, all that are in reach.

    Args:
        objects: the scene, in B.
        X_EF, X_PG, q_p: as of `grasping.graspable`.
    """
    in_reach = tuple(each for each in objects if graspable(each, X_EF, X_PG, q_p))
    return tuple(each for each in in_reach if _has_room(each, objects)) or in_reach


def _has_room(candidate: Object, objects: Objects) -> bool:
    X_BF = grasp_pose(left_right_grasp(candidate), np.eye(4))
    return hand_has_room(X_BF, tuple(each for each in objects if each is not candidate))


def _same_model(one: Object, other: Object) -> bool:
    return model_label_of(one.label) == model_label_of(other.label)


def _same_place(seen: Object, remembered: list[Object]) -> Object | None:
    """The nearest remembered object of the same model whose pose is the same within tolerances."""
    near = [
        (float(np.linalg.norm(old.X[:3, 3] - seen.X[:3, 3])), number)
        for number, old in enumerate(remembered)
        if _same_model(old, seen) and _turn(old.X, seen.X) <= SAME_ROTATION_RAD
    ]
    distance, number = min(near, default=(np.inf, -1))
    return remembered[number] if distance <= SAME_POSITION_M else None


def _turn(X_a: Array, X_b: Array) -> float:
    """Angle in rad between the orientations of two poses."""
    cosine = (np.sum(X_a[:3, :3] * X_b[:3, :3]) - 1) / 2
    return float(np.arccos(np.clip(cosine, -1, 1)))


def _free_label(seen: Object, labels: set[str]) -> str:
    model_label = model_label_of(seen.label)
    numbers = (label_of(model_label, number) for number in range(len(labels) + 1))
    return next(label for label in numbers if label not in labels)
