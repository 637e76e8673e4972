"""Where a simulation became infinite or NaN: the joint or actuator, and who drives it."""

from operator import itemgetter
from typing import Any

import numpy as np

from specc_runtime.plants.mujoco.library import mujoco

_WARNINGS = mujoco.mjtWarning
_CONTROL = _WARNINGS.mjWARN_BADCTRL.value
_POSITION = _WARNINGS.mjWARN_BADQPOS.value
_MOTION = (_WARNINGS.mjWARN_BADQVEL.value, _WARNINGS.mjWARN_BADQACC.value)
_KINDS = (_CONTROL, _POSITION, *_MOTION)
_counts = itemgetter(*_KINDS)
_TO_JOINT = mujoco.mjtTrn.mjTRN_JOINT.value


class Divergence:
    """Looks for the warnings by which MuJoCo tells that numbers are no longer usable."""

    def __init__(self, model: Any, data: Any) -> None:
        self._model, self._data = model, data
        self._warned = data.warning.number

    def __bool__(self) -> bool:
        return any(_counts(self._warned.tolist()))

    def culprit(self) -> tuple[str, frozenset[int]]:
        """`joint 'q3'` or `actuator 'a'`, and the indices of the actuators that drive it."""
        warnings, model = self._data.warning, self._model
        kind = next(kind for kind in _KINDS if warnings[kind].number)
        if kind == _CONTROL:
            index = int(warnings[kind].lastinfo)
            return f"actuator '{model.actuator(index).name}'", frozenset((index,))
        joint = self._joint(kind)
        driving = (model.actuator_trntype == _TO_JOINT) & (model.actuator_trnid[:, 0] == joint)
        return f"joint '{model.joint(joint).name}'", frozenset(np.flatnonzero(driving).tolist())

    def _joint(self, kind: int) -> int:
        """The joint whose acceleration is largest: the masses of a chain pass trouble on."""
        accelerations = np.abs(self._data.qacc)
        if kind != _POSITION and np.isfinite(accelerations).all():
            return int(self._model.dof_jntid[int(np.argmax(accelerations))])
        index = int(self._data.warning[kind].lastinfo)
        if kind == _POSITION:
            return int(np.searchsorted(self._model.jnt_qposadr, index, side="right")) - 1
        return int(self._model.dof_jntid[index])
