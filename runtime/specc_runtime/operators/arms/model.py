"""An arm in a MuJoCo model: the joints between a base and a tip, which every operator here takes.

MuJoCo itself computes positions and derivatives, so that an operator and the simulated robot agree
in what a model says by classes of defaults, included and attached files. All that is not a joint of
the arm stays as keyframe `home` has it, or as the model defines it.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from difflib import get_close_matches
from os.path import isfile
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arms.library import mujoco
from specc_runtime.operators.arrays import Array

HOME = "home"
WORLD = "world"
_KINDS = (("site", mujoco.mjtObj.mjOBJ_SITE), ("body", mujoco.mjtObj.mjOBJ_BODY))
_HINGE, _SLIDE = mujoco.mjtJoint.mjJNT_HINGE.value, mujoco.mjtJoint.mjJNT_SLIDE.value

Indices: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class BodyOrSite:
    """A site or a body of a model, by kind and number, and the body that it belongs to."""

    kind: str
    number: int
    body: int


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """n hinges or slides of a model in a chain from a base to a tip; made by `load_arm`.

    Nothing of it changes. What MuJoCo computes with belongs to the thread that asks.

    Attributes:
        model: the MjModel.
        base, tip: whose frames are B and E.
        joints: (n,) numbers of the joints, from the base to the tip.
        positions, velocities: (n,) indices of their coordinates in qpos and qvel.
        lower, upper: (n,) ends of their ranges, rad or m, infinite where there are none.
        turns: (n,) whether a joint is a hinge.
        start: qpos of all joints of the model.
    """

    model: Any
    base: BodyOrSite
    tip: BodyOrSite
    joints: Indices
    positions: Indices
    velocities: Indices
    lower: Array
    upper: Array
    turns: NDArray[np.bool_]
    start: Array
    _of_thread: threading.local = field(default_factory=threading.local, repr=False)

    def at(self, q: Array) -> Any:
        """The MjData of this thread with the arm at q (n,); only qpos is up to date.

        Raises:
            ValueError: q has another number of joints.
        """
        if q.shape != self.lower.shape:
            raise ValueError(f"{q.size} joint positions for an arm with {self.lower.size} joints")
        data = getattr(self._of_thread, "data", None)
        if data is None:
            data = self._of_thread.data = mujoco.MjData(self.model)
            data.qpos[:] = self.start
        data.qpos[self.positions] = q
        return data

    def __deepcopy__(self, memo: object) -> Arm:
        """Itself, since nothing of it changes."""
        return self


def load_arm(model: str, base: str, tip: str, n: int) -> Arm:
    """The arm of the n joints between a base and a tip in the MJCF file at path `model`.

    The joints are those of the bodies below the base on the way to the tip, in this order. A joint
    that moves the base is none of them, so the base may be that of an arm on a vehicle.

    Args:
        model: path of the file; it may include and attach others.
        base: name of the site or body whose frame is B, or `world`.
        tip: name of the site or body whose frame is E.
        n: how many joints there have to be.

    Raises:
        FileNotFoundError: no such file.
        ValueError: MuJoCo rejects the file; base or tip is not in it; there are not n joints
            between them, or none, or one of them is neither a hinge nor a slide.
    """
    if not isfile(model):
        raise FileNotFoundError(f"no MJCF file {model}")
    try:
        compiled = mujoco.MjModel.from_xml_path(model)
    except ValueError as error:
        raise ValueError(f"{model}: {error}") from error
    ends = _place(compiled, base), _place(compiled, tip)
    compiled.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT.value  # slow, not asked
    compiled.opt.enableflags &= ~mujoco.mjtEnableBit.mjENBL_INVDISCRETE.value
    joints = _between(compiled, *ends)
    _check(compiled, joints, f"between '{base}' and '{tip}'", n)
    bounds = np.where(
        compiled.jnt_limited[joints, None], compiled.jnt_range[joints], (-np.inf, np.inf)
    )
    return Arm(
        compiled,
        *ends,
        _constant(joints),
        _constant(np.array(compiled.jnt_qposadr[joints], np.intp)),
        _constant(np.array(compiled.jnt_dofadr[joints], np.intp)),
        _constant(bounds[:, 0].copy()),
        _constant(bounds[:, 1].copy()),
        _constant(compiled.jnt_type[joints] == _HINGE),
        _constant(_start(compiled)),
    )


def _constant(values: Any) -> Any:
    values.flags.writeable = False
    return values


def _place(model: Any, name: str) -> BodyOrSite:
    """Where two have one name, the site."""
    for kind, of in _KINDS:
        number = mujoco.mj_name2id(model, of.value, name)
        if number >= 0:
            body = int(model.site_bodyid[number]) if kind == "site" else number
            return BodyOrSite(kind, number, body)
    names = [model.site(i).name for i in range(model.nsite)]
    names += [model.body(i).name for i in range(model.nbody)]
    close = " or ".join(get_close_matches(name, names))
    hint = f"; did you mean {close}?" if close else ""
    raise ValueError(f"the model has neither a site nor a body '{name}'{hint}")


def _between(model: Any, base: BodyOrSite, tip: BodyOrSite) -> Indices:
    """Numbers of the joints of the bodies below that of base, down to that of tip."""
    found: list[int] = []
    body = tip.body
    while body != base.body:
        if body == 0:
            raise ValueError("the tip of an arm has to hang from its base in the tree of bodies")
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        found[:0] = range(first, first + count)
        body = int(model.body_parentid[body])
    return np.array(found, np.intp)


def _check(model: Any, joints: Indices, where: str, n: int) -> None:
    names = [model.joint(joint).name or f"number {joint}" for joint in joints]
    if not names:
        raise ValueError(f"there are no joints {where}")
    if len(names) != n:
        raise ValueError(f"expected {n} joints {where}, found {len(names)}: {', '.join(names)}")
    for joint, name in zip(joints, names, strict=True):
        if model.jnt_type[joint] not in (_HINGE, _SLIDE):
            raise ValueError(f"joint {name} {where} is neither a hinge nor a slide")


def _start(model: Any) -> Array:
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY.value, HOME)
    return np.array(model.key_qpos[key] if key >= 0 else model.qpos0)
