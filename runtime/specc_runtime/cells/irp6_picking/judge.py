"""What a run made of the picking task, measured on the ground truth that agents never see."""

from dataclasses import asdict, dataclass, field
from math import acos, degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from specc_runtime.cells.irp6_picking.scene import OBJECTS, TABLE_HEIGHT_M
from specc_runtime.operators.arrays import Array

if TYPE_CHECKING:
    from specc_runtime.plants.mujoco import GroundTruth, MujocoPlant

PICKED_LIFT_M = 0.15
HAND = ("hand", "finger_l", "finger_r")
FINGERTIPS = ("finger_l_tip", "finger_r_tip")
FINGER_JOINTS = ("finger_l", "finger_r")
CLOSING_M = 0.002  # fingers this much nearer than they were in the cycle are closing
_LOOK_EVERY_S = 0.02


@dataclass(slots=True)
class _Cycle:
    """What has been seen since the cycle began."""

    started_s: float
    widest_m: float = 0.0
    closing: bool = False
    chosen: str | None = None
    position_error_mm: float | None = None
    rotation_error_deg: float | None = None
    max_force_N: float = 0.0
    clearance_m: float = float("inf")
    grasped_at: dict[str, float] = field(default_factory=dict)  # height of the centre, m
    lift_m: dict[str, float] = field(default_factory=dict)


class PickJudge:
    """Judges cycles of the picking task on one plant (`specc_runtime.task.Judge`).

    The agent's own estimate reaches the judge from its records: by `watch` with the memory that the
    task names. The phases of a cycle are told by the fingers alone: until they begin to close, the
    hand approaches; an object that both fingertips touch after that is being lifted.
    """

    criterion = "picked"

    def __init__(self, plant: "MujocoPlant", objects: tuple[str, ...] = OBJECTS) -> None:
        self._truth: GroundTruth = plant.truth
        self._objects = objects
        self._watched: dict[str, Any] = {}  # labels and poses of what was seen last
        self.begin_cycle()

    def begin_cycle(self) -> None:
        """Forget the cycle so far; a new one begins now."""
        self._cycle = _Cycle(self._truth.time_s)
        self._next_look_s = self._truth.time_s

    def observe(self) -> None:
        """Take notice of the state of the plant now."""
        cycle = self._cycle
        if not cycle.closing:
            cycle.max_force_N = max(cycle.max_force_N, self._truth.contact_force(*HAND))
        if self._truth.time_s >= self._next_look_s:
            self._next_look_s = self._truth.time_s + _LOOK_EVERY_S
            self._look()

    def watch(self, name: str, value: Any) -> None:
        """Take notice of memory of the agent: an object with `label` and `X`, or a tuple of them.

        Of a tuple the last one counts; a value that was seen before says nothing new.
        """
        chosen = value[-1:] if isinstance(value, tuple) else (value,)
        seen = [[each.label, each.X.ravel().tolist()] for each in chosen]
        if self._watched.get(name) == seen:
            return
        self._watched[name] = seen
        for each in chosen:
            self.recognised(each.label, each.X)

    def saved(self) -> dict[str, Any]:
        """See `specc_runtime.savable.Savable`."""
        next_s = self._next_look_s
        return {"cycle": asdict(self._cycle), "watched": self._watched, "next_look_s": next_s}

    def restore(self, saved: Any) -> None:
        """See `specc_runtime.savable.Savable`."""
        self._cycle = _Cycle(**saved["cycle"])
        self._watched = dict(saved["watched"])
        self._next_look_s = saved["next_look_s"]

    def recognised(self, label: str, X_BO: Array) -> None:
        """The agent is going for the object of that label and believes it at X_BO (4, 4).

        The label is an object's name, possibly with a suffix "_number". Ignored while the fingers
        close and after: then the object moves with the hand.
        """
        if self._cycle.closing:
            return
        name = next((n for n in self._objects if label == n or label.startswith(f"{n}_")), None)
        self._cycle.chosen = name
        self._cycle.position_error_mm = self._cycle.rotation_error_deg = None
        if name is not None:
            X_true = self._truth.body_pose(name)
            self._cycle.position_error_mm = 1e3 * distance(X_BO, X_true)
            self._cycle.rotation_error_deg = degrees(rotation_between(X_BO, X_true))

    def end_cycle(self) -> dict[str, Any]:
        """The report of the cycle that ends now; the next one begins.

        Keys: object (the chosen one; if none was announced, the one lifted highest), picked,
        lift_height_m (of its centre, while both fingertips held it), position_error_mm and
        rotation_error_deg (of the estimate, None without one), max_force_N (net contact force on
        the hand until the fingers began to close), finger_clearance_m (least height of a fingertip
        above the table), simulated_s.
        """
        self._look()
        cycle = self._cycle
        lifted = max(cycle.lift_m, key=cycle.lift_m.__getitem__, default=None)
        name = cycle.chosen or lifted
        lift = cycle.lift_m.get(name, 0.0) if name is not None else 0.0
        report = {
            "object": name,
            "picked": lift >= PICKED_LIFT_M,
            "lift_height_m": lift,
            "position_error_mm": cycle.position_error_mm,
            "rotation_error_deg": cycle.rotation_error_deg,
            "max_force_N": cycle.max_force_N,
            "finger_clearance_m": cycle.clearance_m,
            "simulated_s": self._truth.time_s - cycle.started_s,
        }
        self.begin_cycle()
        return report

    def _look(self) -> None:
        """What need not be seen at every tick."""
        truth, cycle = self._truth, self._cycle
        wide = sum(truth.joint_position(joint) for joint in FINGER_JOINTS)
        cycle.widest_m = max(cycle.widest_m, wide)
        cycle.closing = cycle.closing or wide < cycle.widest_m - CLOSING_M
        lowest = min(truth.lowest_point(tip) for tip in FINGERTIPS)
        cycle.clearance_m = min(cycle.clearance_m, lowest - TABLE_HEIGHT_M)
        if cycle.closing:
            for name in self._objects:
                self._follow(name)

    def _follow(self, name: str) -> None:
        if all(self._truth.touching(tip, name) for tip in FINGERTIPS):
            height = float(self._truth.position(name)[2])
            start = self._cycle.grasped_at.setdefault(name, height)
            self._cycle.lift_m[name] = max(self._cycle.lift_m.get(name, 0.0), height - start)


def distance(X_1: Array, X_2: Array) -> float:
    """Distance between the origins of two poses (4, 4), m."""
    return float(np.linalg.norm(X_1[:3, 3] - X_2[:3, 3]))


def rotation_between(X_1: Array, X_2: Array) -> float:
    """Angle of the rotation from one pose (4, 4) to another, rad."""
    cosine = (float(np.trace(X_1[:3, :3].T @ X_2[:3, :3])) - 1.0) / 2.0
    return acos(min(1.0, max(-1.0, cosine)))
