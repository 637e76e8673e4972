"""Beyond which numbers a control is cut, or its servo gets nowhere; how often that happened."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from specc_runtime.plants.mujoco.library import mujoco

_ROUNDING = 1e-5  # of a range: numbers are written with six digits
_ALIKE = 1e-6  # of the gain of a servo
_TRN, _DYN = mujoco.mjtTrn, mujoco.mjtDyn
_GAIN, _BIAS = mujoco.mjtGain, mujoco.mjtBias
_PASSED_ON = {_DYN.mjDYN_NONE.value, _DYN.mjDYN_FILTER.value, _DYN.mjDYN_FILTEREXACT.value}
_SINGLE = {mujoco.mjtJoint.mjJNT_HINGE.value, mujoco.mjtJoint.mjJNT_SLIDE.value}
_UNCLAMPED = mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL.value


class ControlLimit(NamedTuple):
    """What limits a control, as a model calls it, and from where to where."""

    of: str
    least: float
    greatest: float

    def exceeded(self, control: float) -> bool:
        """Whether a control is beyond it."""
        near = _ROUNDING * (self.greatest - self.least)
        return not self.least - near <= control <= self.greatest + near


def limits(model: Any, actuator: int) -> Iterator[ControlLimit]:
    """Those of the control of an actuator, by its index."""
    if model.actuator_ctrllimited[actuator] and not model.opt.disableflags & _UNCLAMPED:
        yield ControlLimit("ctrlrange", *_pair(model.actuator_ctrlrange[actuator]))
    gain = float(model.actuator_gainprm[actuator, 0])
    is_fixed = model.actuator_gaintype[actuator] == _GAIN.mjGAIN_FIXED.value
    if not is_fixed or not gain or int(model.actuator_dyntype[actuator]) not in _PASSED_ON:
        return
    bias = int(model.actuator_biastype[actuator])
    if bias == _BIAS.mjBIAS_NONE.value and model.actuator_forcelimited[actuator]:
        ends = sorted(force / gain for force in _pair(model.actuator_forcerange[actuator]))
        yield ControlLimit("forcerange", *ends)
    joint = int(model.actuator_trnid[actuator, 0])
    is_direct = (
        model.actuator_trntype[actuator] == _TRN.mjTRN_JOINT.value
        and model.actuator_gear[actuator, 0] == 1.0
    )
    offset, back = (float(number) for number in model.actuator_biasprm[actuator, :2])
    is_servo = bias == _BIAS.mjBIAS_AFFINE.value and offset == 0 < gain
    is_servo &= abs(back + gain) <= _ALIKE * gain
    if (
        is_direct
        and is_servo
        and int(model.jnt_type[joint]) in _SINGLE
        and model.jnt_limited[joint]
    ):
        of = f"range of joint {model.joint(joint).name}"
        yield ControlLimit(of, *_pair(model.jnt_range[joint]))


def _pair(numbers: Any) -> tuple[float, float]:
    least, greatest = (float(number) for number in numbers)
    return least, greatest


@dataclass(slots=True)
class Clipped:
    """The ticks in which a control of an element was beyond a limit, and the first of them."""

    ticks: int
    first_s: float
    actuator: str
    value: float
    of: str
    range: tuple[float, float]


class ClipCount:
    """Counts for one element, of which each control has an actuator."""

    def __init__(self, model: Any, actuators: Sequence[int]) -> None:
        self._names = [model.actuator(index).name for index in actuators]
        self._limits = [tuple(limits(model, index)) for index in actuators]
        self._is_limited = any(self._limits)
        self.found: Clipped | None = None

    def watch(self, controls: Sequence[float], time_s: float) -> None:
        """Controls of the tick that begins."""
        if not self._is_limited:
            return
        for name, control, of in zip(self._names, controls, self._limits, strict=True):
            for limit in of:
                if limit.exceeded(control):
                    self._count(name, control, limit, time_s)
                    return

    def _count(self, name: str, control: float, limit: ControlLimit, time_s: float) -> None:
        if self.found is None:
            ends = limit.least, limit.greatest
            self.found = Clipped(0, time_s, name, float(control), limit.of, ends)
        self.found.ticks += 1
