"""Facts about a model from the simulator, which runs in a process of the runtime."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from specc.atomic_files import temporary_folder
from specc.refusal import Refused

_SECONDS = 300
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_LONGEST = 500


class NoFacts(Refused):
    """The model cannot be used, or MuJoCo is missing; the message says why."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint; `wheel` says whether it turns without end beside another like it."""

    name: str
    kind: str
    body: int
    body_name: str
    start: float
    range: tuple[float, float] | None
    wheel: bool

    @property
    def unit(self) -> str:
        """The unit of its position."""
        return "rad" if self.kind == "hinge" else "m"


@dataclass(frozen=True, slots=True)
class Actuator:
    """An actuator and how it is held, `specc_runtime.plants.mujoco.posture`.

    Its control is `rest` at the start, plus `gain` times the distance of its length from the start,
    less `damping` times its speed; the length is the sum of `joints`, each by its factor.
    """

    name: str
    kind: Literal["position", "servo", "velocity", "speed", "force"]
    joints: tuple[tuple[int, float], ...]
    linear: bool
    factor: float
    least: float | None
    greatest: float | None
    rest: float
    gain: float
    damping: float


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor and what it is attached to."""

    name: str
    of: str
    object: str
    size: int
    cutoff: float


@dataclass(frozen=True, slots=True)
class ModelFacts:
    """See `specc_runtime.plants.mujoco.describing`."""

    keyframe: str | None
    scene: Mapping[str, float]
    settles_elsewhere: bool
    timestep_s: float
    period_s: float
    joints: tuple[Joint, ...]
    parents: tuple[int, ...]
    actuators: tuple[Actuator, ...]
    refused: Mapping[str, str]
    thrusters: tuple[str, ...]
    """Refused actuators that push at sites."""
    mocap: Mapping[str, tuple[str, ...]]
    """Bodies that mocap places -> the bodies that constraints tie to each."""
    frequency: float
    drift: Mapping[str, float]
    sensors: tuple[Sensor, ...]
    cameras: tuple[str, ...]
    files: tuple[str, ...]
    """Paths of the files beside the texts; the simulator only names some of them."""


def read_facts(path: str) -> ModelFacts:
    """Facts about the MJCF file at `path`. Raises NoFacts."""
    answer = _describe(os.path.abspath(path))
    for reason in ("missing", "error"):
        if reason in answer:
            raise NoFacts(str(answer[reason])[:_LONGEST])
    joints = [Joint(**{**j, "range": j["range"] and tuple(j["range"])}) for j in answer["joints"]]
    actuators = [
        Actuator(**{**a, "joints": tuple(map(tuple, a["joints"]))}) for a in answer["actuators"]
    ]
    braced = {
        a.name: BRACED
        for a in actuators
        if set("{}") & set("".join((a.name, *(joints[index].name for index, _ in a.joints))))
    }
    many = {
        "joints": tuple(joints),
        "parents": tuple(answer["parents"]),
        "actuators": tuple(each for each in actuators if each.name not in braced),
        "refused": {**answer["refused"], **braced},
        "thrusters": tuple(answer["thrusters"]),
        "mocap": {body: tuple(tied) for body, tied in answer["mocap"].items()},
        "sensors": tuple(Sensor(**each) for each in answer["sensors"]),
        "cameras": tuple(answer["cameras"]),
        "files": tuple(answer["files"]),
    }
    return ModelFacts(**{**answer, **many})


BRACED = "braces in names stand for indices: give it or its joint another name"


def _describe(path: str) -> dict[str, Any]:
    """The answer of the process, in a temporary folder, since MuJoCo writes a log."""
    # As in this process, but nothing from the working directory.
    found = os.pathsep.join(filter(None, sys.path))
    environment = {**os.environ, "PYTHONPATH": found, **dict.fromkeys(_THREADS, "1")}
    with temporary_folder() as scratch:
        try:
            process = subprocess.run(
                [sys.executable, "-m", "specc_runtime.describing", path, str(os.getpid())],
                capture_output=True,
                check=False,
                timeout=_SECONDS,
                cwd=scratch,
                env=environment,
                # Ctrl-C is for this process, which ends that one.
                start_new_session=True,
            )
        except subprocess.TimeoutExpired:
            raise NoFacts(f"MuJoCo was not done with the model after {_SECONDS} s") from None
    if -process.returncode == getattr(signal, "SIGXCPU", None):
        raise NoFacts(f"MuJoCo was not done with the model after {_SECONDS} s")
    if process.returncode or not process.stdout:
        if b"No module named" in process.stderr and b"specc_runtime" in process.stderr:
            raise NoFacts("the runtime (package specc_runtime) is not installed")
        last = process.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise NoFacts(f"MuJoCo failed on the model: {last[:_LONGEST] or 'it ended at once'}")
    answer: dict[str, Any] = json.loads(process.stdout)
    return answer
