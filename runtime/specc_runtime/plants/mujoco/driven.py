"""Actuators of a model: what their control means, and what they drive.

An actuator exerts the force f = g u + b - k l - d v along its length l, with v = dl/dt: a servo for
positions has k > 0, one for speeds only d > 0, a motor neither. The length is linear in the joints
that it drives, l = sum c_j q_j, but for tendons over sites.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.limits import limits

Kind = Literal["position", "servo", "velocity", "speed", "force"]
"""Of a control: the position of a joint; the position of something else, in a scale of the model's
own; the speed of a joint; that of something else; a force or a torque, up to a factor."""

JOINT_KINDS = ("free", "ball", "slide", "hinge")
_TRN, _DYN, _GAIN, _BIAS = mujoco.mjtTrn, mujoco.mjtDyn, mujoco.mjtGain, mujoco.mjtBias
_FEEDBACK = 1e-9
AT_SITE = "it pushes at a site, as a rotor does, and moves no joint by itself"


@dataclass(frozen=True, slots=True)
class Driven:
    """An actuator that can be held.

    Attributes:
        index: in the model.
        joints: joint -> c_j, the change of the length by a change of its position.
        gain, offset, stiffness, damping: g, b, k and d above.
        least, greatest: of the control; None where the model does not limit it.
    """

    index: int
    name: str
    kind: Kind
    joints: dict[int, float]
    linear: bool
    gain: float
    offset: float
    stiffness: float
    damping: float
    least: float | None
    greatest: float | None


def driven(model: Any, data: Any) -> tuple[list[Driven], dict[str, str]]:
    """The actuators that can be held, and name -> why not of all others.

    `data` is at the pose of the start, its derived quantities computed.
    """
    found, refused = [], {}
    for index in range(model.nu):
        name = model.actuator(index).name or f"number {index + 1}"
        joints = dict(_joints(model, data, index))
        if why := _refusal(model, index, joints):
            refused[name] = why
        else:
            found.append(_driven(model, index, joints))
    return found, refused


def moments(model: Any, data: Any, index: int) -> Array:
    """(nv,) change of the length of an actuator by the velocities of the model."""
    row = np.zeros(model.nv)
    start, count = data.moment_rowadr[index], data.moment_rownnz[index]
    where = slice(start, start + count)
    row[data.moment_colind[where]] = data.actuator_moment[where]
    return row


def _joints(model: Any, data: Any, index: int) -> Iterator[tuple[int, float]]:
    row = moments(model, data, index)
    for dof in np.flatnonzero(np.abs(row) > _FEEDBACK):
        yield int(model.dof_jntid[dof]), float(row[dof])


def _refusal(model: Any, index: int, joints: dict[int, float]) -> str:
    """Why an actuator cannot be held; empty if it can."""
    transmission = _TRN(int(model.actuator_trntype[index]))
    if transmission not in (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT, _TRN.mjTRN_TENDON):
        return AT_SITE if transmission == _TRN.mjTRN_SITE else "it acts on no joint or tendon"
    if not joints:
        return "it moves no joint at the start"
    for joint in joints:
        if JOINT_KINDS[model.jnt_type[joint]] not in ("slide", "hinge"):
            return "it acts on a ball or a free joint, which has no position of one number"
        if not model.joint(joint).name:
            return "it moves a joint without a name: give it one in the model, `name=...`"
    return _unusual(model, index)


def _unusual(model: Any, index: int) -> str:
    dynamics = _DYN(int(model.actuator_dyntype[index]))
    gain, bias = (
        _GAIN(int(model.actuator_gaintype[index])),
        _BIAS(int(model.actuator_biastype[index])),
    )
    names = {part.name.rpartition("_")[2].lower() for part in (dynamics, gain, bias)}
    if "muscle" in names:
        return "it is a muscle: its force depends on its length and speed"
    if "integrator" in names:
        return "its control is integrated, so that it begins elsewhere than the joint"
    if gain != _GAIN.mjGAIN_FIXED or not names <= _USUAL:
        return f"specc knows no law for it ({', '.join(sorted(names - {'none', 'fixed'}))})"
    if model.actuator_gainprm[index, 0] == 0:
        return "its control has no effect"
    return ""


_USUAL = {"none", "filter", "filterexact", "fixed", "affine"}


def _driven(model: Any, index: int, joints: dict[int, float]) -> Driven:
    gain = float(model.actuator_gainprm[index, 0])
    affine = int(model.actuator_biastype[index]) == _BIAS.mjBIAS_AFFINE.value
    offset, back, brake = (float(p) * affine for p in model.actuator_biasprm[index, :3])
    is_tendon = int(model.actuator_trntype[index]) == _TRN.mjTRN_TENDON.value
    direct = not is_tendon and next(iter(joints.values())) == 1.0
    kind = _kind(gain, offset, -back, -brake, direct=direct)
    first = next(limits(model, index), None)
    least, greatest = (first.least, first.greatest) if first else (None, None)
    linear = not is_tendon or _is_fixed(model, int(model.actuator_trnid[index, 0]))
    name = model.actuator(index).name
    return Driven(index, name, kind, joints, linear, gain, offset, -back, -brake, least, greatest)


def _kind(gain: float, offset: float, k: float, d: float, *, direct: bool) -> Kind:
    if k > 0:
        return "position" if direct and offset == 0 and abs(gain - k) <= 1e-6 * k else "servo"
    if d > 0:
        return "velocity" if direct and offset == 0 and abs(gain - d) <= 1e-6 * d else "speed"
    return "force"


def _is_fixed(model: Any, tendon: int) -> bool:
    first = int(model.tendon_adr[tendon])
    return bool(model.wrap_type[first] == mujoco.mjtWrap.mjWRAP_JOINT.value)
