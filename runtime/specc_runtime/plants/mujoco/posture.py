"""How the pose of the start is held: gains from masses, and a rehearsal that tries them.

Each actuator gets the control

    u = u0 + K (l_0 - l) - D (l - l') / T

in every period T, with its length l, l' that of the period before, and l_0 that of the start. A
servo for positions has a controller of its own: K = D = 0. A servo for speeds gets K = w m / d.
A motor gets K = w^2 m / g and D = 2 w m / g: a critically damped joint of the natural frequency w,
for the mass m that the actuator feels where all other joints are free, m = 1 / (J M^-1 J^T). With
the masses of M alone (its diagonal), light joints at the end of a chain would swing.

u0 carries the weight. It follows from inverse dynamics, where the robot stands fixed; a rehearsal
with an integral part finds it where that does not hold, as for a robot that stands on its feet.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.driven import Driven, moments
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.model import set_start

HELD_S = 5.0
"""How long a pose must be held in a rehearsal."""
NEAR = {"hinge": 0.05, "slide": 0.005}
"""How far a joint may be from the start: rad, m."""
_KINDS = ("free", "ball", "slide", "hinge")
_FREQUENCIES = (20.0, 10.0, 40.0, 5.0)
"""Natural frequencies to try, rad/s."""
_PERIOD_S = 0.002
_PERIODS = 0.1
"""Of one radian of the natural frequency, the period may be this part at most."""
_GOOD = 0.4
"""Of what is allowed, where the search ends."""
_MOST_STEPS = 120_000
"""Of the simulation: one rehearsal of `HELD_S` must have no more; once all laws that were tried
from one start had as many, no others are tried."""
_NOT_FAR = 0.5
"""From the start, rad and m, is a pose that stands for it."""
_MOVED = 1e-4
_ROUNDED = 1e-5
"""Of a position, what its last digit may be away."""
_SLIDE = mujoco.mjtJoint.mjJNT_SLIDE.value


@dataclass(frozen=True)
class Laws:
    """u0, K and D of actuators, each (n,), in units of their controls and lengths."""

    rest: Array
    gain: Array
    damping: Array


@dataclass(frozen=True)
class HeldPosture:
    """What a rehearsal gave: laws, and the largest distance of each joint from the start."""

    start: Array
    laws: Laws
    frequency: float
    strayed: dict[int, float]
    score: float


def hold_posture(
    model: Any,
    start: Array,
    settable: NDArray[np.bool_],
    actuators: Sequence[Driven],
    wheels: frozenset[int],
) -> HeldPosture:
    """How the pose `start` (nq,) is held, or a pose near it that can be.

    Where bodies overlap at the start, or a robot stands above its floor, no control keeps it there.
    Then the pose is taken in which it settles, as far as a scene can set it (`settable`, (nq,)).

    Raises:
        PlantError: the step of the simulation is too short to rehearse anything.
    """
    _refuse_short_steps(float(model.opt.timestep))
    first = PostureRehearsal(model, start, actuators, wheels)
    found = first.best()
    if found.score < 1.0 or not np.isfinite(found.score):
        return found
    poses = [first.resting_pose(laws) for laws in (first.unloaded(), found.laws)]
    for pose, rest in poses:
        far = np.abs(pose - start)[settable]
        if not np.isfinite(far).all() or far.max(initial=0.0) > _NOT_FAR:
            continue
        rests = confined(model, pose)
        begun = np.where(settable & (np.abs(rests - start) > _MOVED), rests, start)
        again = PostureRehearsal(model, begun, actuators, wheels)
        found = min(found, again.best(rest), key=lambda each: each.score)
    return found


def _refuse_short_steps(timestep_s: float) -> None:
    if HELD_S / timestep_s > _MOST_STEPS:
        raise PlantError(
            f"option: a timestep of {timestep_s:g} s is too short: {HELD_S:g} s would take more "
            f"than {_MOST_STEPS:,} steps; {HELD_S / _MOST_STEPS:.2g} s and more will do"
        )


def confined(model: Any, positions: Array) -> Array:
    """Positions (nq,) as they are written, those of hinges and slides within their ranges."""
    found = written(positions, 6)
    for joint in range(model.njnt):
        where = model.jnt_qposadr[joint]
        if model.jnt_limited[joint] and model.jnt_type[joint] >= _SLIDE:
            least, greatest = model.jnt_range[joint]
            if not least <= found[where] <= greatest:
                inside = min(_ROUNDED * max(1.0, abs(least), abs(greatest)), (greatest - least) / 2)
                clipped = np.clip(positions[where], least + inside, greatest - inside)
                found[where] = float(f"{clipped:.6g}")
    return found


def period_s(model: Any) -> float:
    """Of controllers: about 2 ms, in whole steps of the simulation."""
    timestep_s = float(model.opt.timestep)
    return max(1, round(_PERIOD_S / timestep_s)) * timestep_s


class PostureRehearsal:
    """Simulates a model that is held."""

    def __init__(
        self, model: Any, start: Array, actuators: Sequence[Driven], wheels: frozenset[int]
    ) -> None:
        """`wheels` are joints whose speed is held, and not their position."""
        self._model, self._data = model, mujoco.MjData(model)
        self._start, self._actuators = start, actuators
        self.period_s = period_s(model)
        self._steps = round(self.period_s / float(model.opt.timestep))
        self._place()
        self._controls = np.array([a.index for a in actuators], dtype=np.intp)
        self._turning = np.array([not wheels.isdisjoint(a.joints) for a in actuators])
        self._lengths = np.array([self._row(a) for a in actuators])
        self._joints = sorted({j for a in actuators for j in a.joints})
        self._where = model.jnt_qposadr[self._joints]
        self._allowed = np.array([NEAR[_KINDS[model.jnt_type[j]]] for j in self._joints])
        self._least = _ends(actuators, "least", -np.inf)
        self._greatest = _ends(actuators, "greatest", np.inf)
        self._left = _MOST_STEPS

    def best(self, rest: Array | None = None) -> HeldPosture:
        """The first laws that hold the pose well, or the best of all that were tried.

        `rest` is u0 to be tried as well.
        """
        found: list[HeldPosture] = []
        for frequency in self._frequencies():
            for laws in self._tried(self._gains(frequency), rest):
                strayed = self._simulate(laws)[0]
                score = float(np.max(strayed / self._allowed, initial=0.0))
                far = dict(zip(self._joints, strayed.tolist(), strict=True))
                found.append(HeldPosture(self._start, laws, frequency, far, score))
                if score < _GOOD or self._left <= 0:
                    return min(found, key=lambda posture: posture.score)
        return min(found, key=lambda posture: posture.score)

    def _frequencies(self) -> Iterator[float]:
        has_gains = any(a.kind in ("force", "velocity") for a in self._actuators)
        bound = _PERIODS / self.period_s
        wanted = dict.fromkeys(min(each, bound) for each in _FREQUENCIES)
        yield from wanted if has_gains else list(wanted)[:1]

    def unloaded(self) -> Laws:
        """Laws that carry no weight."""
        laws = self._gains(next(self._frequencies()))
        return replace(laws, rest=written(self._unloaded()))

    def resting_pose(self, laws: Laws) -> tuple[Array, Array]:
        """Positions (nq,) where the robot comes to rest, and the controls (n,) there."""
        self._simulate(laws, times=2)
        return self._data.qpos.copy(), self._data.ctrl[self._controls].copy()

    def _tried(self, laws: Laws, rest: Array | None) -> Iterator[Laws]:
        """With the weight by inverse dynamics, then with that of a rehearsal."""
        if rest is not None:
            yield replace(laws, rest=written(rest))
        weight = replace(laws, rest=written(self._weight()))
        if not self._is_free:
            yield weight
        begin = replace(laws, rest=written(self._unloaded())) if self._is_free else weight
        if self._is_free:
            yield begin
        yield replace(laws, rest=written(self._simulate(begin, learn=True)[1]))

    @property
    def _is_free(self) -> bool:
        return bool((self._model.jnt_type == 0).any())

    def _gains(self, frequency: float) -> Laws:
        kinds = np.array([a.kind for a in self._actuators])
        g = np.array([a.gain for a in self._actuators])
        linear = np.array([a.linear and len(a.joints) == 1 for a in self._actuators])
        masses = self._masses()
        motor, speed = (kinds == "force") & linear, (kinds == "velocity") & linear
        damping = np.where(motor, 2 * frequency * masses / g, 0.0)
        gain = np.where(motor, frequency**2 * masses / g, np.where(speed, frequency / 4, 0.0))
        gain[self._turning] = 0.0
        none = np.zeros(len(self._actuators))
        return Laws(none, written(gain), written(damping))

    def _masses(self) -> Array:
        """(n,) kg or kg m^2 that each actuator feels at the start."""
        rows = np.array([moments(self._model, self._data, a.index) for a in self._actuators])
        moved = np.zeros_like(rows)
        mujoco.mj_solveM(self._model, self._data, moved, rows)
        masses: Array = 1.0 / np.einsum("ij,ij->i", rows, moved)
        return masses

    def _weight(self) -> Array:
        """(n,) controls by which the actuators give the forces that keep all joints at rest."""
        model, data = self._model, self._data
        self._place()
        mujoco.mj_inverse(model, data)
        rows = np.array([moments(model, data, a.index) for a in self._actuators])
        moved = np.flatnonzero(np.abs(rows).max(axis=0) > 0)
        needed = data.qfrc_inverse[moved]
        forces = np.linalg.lstsq(rows[:, moved].T, needed, rcond=None)[0]
        return self._controls_for(forces)

    def _unloaded(self) -> Array:
        return self._controls_for(np.zeros(len(self._actuators)))

    def _controls_for(self, forces: Array) -> Array:
        self._place()
        lengths = self._data.actuator_length[self._controls]
        rows = zip(self._actuators, forces, lengths, strict=True)
        found = [(f - a.offset + a.stiffness * at) / a.gain for a, f, at in rows]
        controls: Array = np.clip(found, self._least, self._greatest)
        return controls

    def _place(self) -> None:
        mujoco.mj_resetData(self._model, self._data)
        set_start(self._model, self._data)
        self._data.qpos[:] = self._start
        mujoco.mj_forward(self._model, self._data)

    def _row(self, actuator: Driven) -> Array:
        """(nq,) length by positions."""
        row = np.zeros(self._model.nq)
        for joint, change in actuator.joints.items():
            row[self._model.jnt_qposadr[joint]] = change
        return row

    def _simulate(self, laws: Laws, *, learn: bool = False, times: int = 1) -> tuple[Array, Array]:
        """Largest distance of each joint from the start, and u0, learnt if asked.

        What is computed in a period acts from the next one on, as in runs.
        """
        model, data = self._model, self._data
        self._place()
        start = before = self._lengths @ data.qpos
        first, farthest = data.qpos[self._where].copy(), np.zeros(len(self._joints))
        rest, rates = laws.rest.copy(), self._learning(laws) if learn else None
        pending: Array | None = None
        for _ in range(round(HELD_S * max(times, 1 + learn) / self.period_s)):
            if pending is not None:
                data.ctrl[self._controls] = pending
            lengths = self._lengths @ data.qpos
            error = start - lengths
            commands = rest + laws.gain * error - laws.damping * (lengths - before) / self.period_s
            pending, before = np.clip(commands, self._least, self._greatest), lengths
            if rates is not None:
                rest = np.clip(rest + rates * error, self._least, self._greatest)
            mujoco.mj_step(model, data, self._steps)
            self._left -= self._steps
            np.maximum(farthest, np.abs(data.qpos[self._where] - first), out=farthest)
            if not np.isfinite(farthest).all():
                return np.full(len(self._joints), np.inf), laws.rest
        return farthest, rest

    def _learning(self, laws: Laws) -> Array:
        """(n,) change of u0 in a period by the distance from the start."""
        own = np.array([a.stiffness / a.gain * a.linear for a in self._actuators])
        rates: Array = np.where(laws.gain > 0, laws.gain, own) * self.period_s
        return rates


def written(numbers: Array, digits: int = 4) -> Array:
    """Numbers with as many digits as they get in a specification."""
    return np.array([0.0 if abs(n) < 1e-9 else float(f"{n:.{digits}g}") for n in numbers])


def _ends(actuators: Sequence[Driven], which: str, without: float) -> NDArray[np.float64]:
    ends = (getattr(each, which) for each in actuators)
    return np.array([without if end is None else end for end in ends])
