"""A simulated plant that agents sense and drive by the names of bindings."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.distortion import Distortion
from specc_runtime.plant import Mesh, Shape, Viewpoint
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.bodies import Bodies
from specc_runtime.plants.mujoco.cameras import Cameras, RendererName
from specc_runtime.plants.mujoco.divergence import Divergence
from specc_runtime.plants.mujoco.driving import Actuator
from specc_runtime.plants.mujoco.holding import Brakes, HeldJoints
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.limits import Clipped
from specc_runtime.plants.mujoco.model import (
    find,
    load_model,
    set_start,
)
from specc_runtime.plants.mujoco.sensing import ModelSensor
from specc_runtime.plants.mujoco.truth import GroundTruth
from specc_runtime.plants.mujoco.viewer import Viewer

_WHOLE = 1e-6  # tolerance, in time steps, on durations
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION.value
_MOST_SAMPLES = 10**8  # passed over in seconds
_DERIVED = ("sensordata", "actuator_force", "qacc", "cfrc_ext")
"""What is of the last step, and is read before the next one."""


class MujocoPlant:
    """A MuJoCo simulation behind sensor and actuator bindings. It knows nothing of the robot.

    Attributes:
        truth: what is really so; for scenes and reports, never for agents.
    """

    def __init__(
        self,
        model_path: str,
        sensors: Sequence[SensorBinding] = (),
        actuators: Sequence[ActuatorBinding] = (),
        *,
        renderer: RendererName = "auto",
    ) -> None:
        """Load the model, resolve all bindings, reset with seed 0.

        Raises:
            PlantError: unreadable model, name that the model lacks, contradictory binding.
        """
        self._model = load_model(model_path)
        self._name = os.path.basename(model_path)
        self._data = mujoco.MjData(self._model)
        self._timestep_s = float(self._model.opt.timestep)
        self._cameras = Cameras(self._model, self._data, renderer)
        _check_unique([b.name for b in sensors] + [b.name for b in actuators])
        self._sensors = {
            b.name: ModelSensor(self._model, self._data, self._cameras, b) for b in sensors
        }
        if any(binding.camera for binding in sensors):
            self._cameras.open()
        self._actuators = {b.name: Actuator(self._model, self._data, b) for b in actuators}
        self._divergence = Divergence(self._model, self._data)
        self._brakes = Brakes(self._model, self._data)
        self._bodies = Bodies(self._model, self._data)
        self._shown: tuple[int, ...] | None = None
        self.truth = GroundTruth(self._model, self._data)
        self.reset(0)

    @property
    def time_s(self) -> float:
        """Simulated time since the reset."""
        return float(self._data.time)

    def reset(self, seed: int) -> None:
        """Back to time 0 at rest in the home configuration, with no command but its own.

        The noise of a sample depends on the seed, the sensor's name and the number of the sample.
        """
        mujoco.mj_resetData(self._model, self._data)
        self._brakes.release()
        set_start(self._model, self._data)
        mujoco.mj_forward(self._model, self._data)
        self._cameras.forget()
        for sensor in self._sensors.values():
            sensor.reset(seed)
        for actuator in self._actuators.values():
            actuator.reset()

    def sample(self, name: str) -> Any:
        """Value of a bound sensor now; images are `Deferred`.

        Raises:
            PlantError: unknown name.
        """
        sensor = self._sensors.get(name)
        if sensor is None:
            raise PlantError(f"no sensor is bound as '{name}'", known=tuple(self._sensors))
        return sensor.sample()

    def actuate(self, name: str, value: Any) -> None:
        """Give a bound actuator its command, held until the next one.

        Raises:
            PlantError: unknown name.
        """
        if name not in self._actuators:
            raise PlantError(f"no actuator is bound as '{name}'", known=tuple(self._actuators))
        self._actuators[name].command = value

    def advance(self, duration_s: float) -> None:
        """Simulate a whole number of time steps with constant controls.

        The controls are computed once, at the beginning, from the held commands and the state.

        Raises:
            PlantError: not a whole number of steps, bad command, or the simulation diverged.
        """
        steps = duration_s / self._timestep_s
        if steps < 1 - _WHOLE or abs(steps - round(steps)) > _WHOLE:
            raise PlantError(
                f"a base tick of {duration_s:g} s is not a whole number of time steps of the model "
                f"{self._name}, {self._timestep_s:g} s each"
            )
        for actuator in self._actuators.values():
            actuator.drive()
        for _ in range(round(steps)):
            # In this order positions and velocities, and what derives from them, are of the end of
            # the step; forces are always those during the step.
            mujoco.mj_step2(self._model, self._data)
            if self._brakes.joints is not None:
                self._brakes.joints.put_back()
            mujoco.mj_step1(self._model, self._data)
        if self._divergence:
            raise self._diverged()

    def _diverged(self) -> PlantError:
        part, driving = self._divergence.culprit()
        driven = (name for name, actuator in self._actuators.items() if actuator.moves(driving))
        return PlantError(
            f"the simulation diverged at {self.time_s:.3f} s: {part}",
            part=part,
            device=next(driven, ""),
        )

    def clipped(self) -> dict[str, Any]:
        """See `specc_runtime.clipping.Clipping`."""
        found = {name: actuator.clips.found for name, actuator in self._actuators.items()}
        return {name: asdict(clipped) for name, clipped in found.items() if clipped}

    def settle(self, duration_s: float) -> None:
        """Let free bodies come to rest while all joints stay where they are, then be at time 0.

        For scenes, after a reset; contact friction, gravity and everything else act as usual.
        """
        joints = np.flatnonzero(self._model.jnt_type != mujoco.mjtJoint.mjJNT_FREE.value)
        brakes = HeldJoints(self._model, self._data, joints.tolist())
        for _ in range(round(duration_s / self._timestep_s)):
            mujoco.mj_step(self._model, self._data)
            brakes.put_back()
        self._data.qvel[:] = 0.0
        self._data.time = 0.0
        mujoco.mj_forward(self._model, self._data)
        self._cameras.forget()

    def put(self, positions: Mapping[str, float]) -> None:
        """Put joints somewhere, at rest (`specc_runtime.disturbances.Disturbable`)."""
        self.truth.place(positions)
        self._brakes.hold()

    def shift(self, distances: Mapping[str, float]) -> None:
        """Move joints from where they are, at rest."""
        self.truth.place(distances, relative=True)
        self._brakes.hold()

    def push(self, body: str, force: Sequence[float]) -> None:
        """Let a force (3,) N, in the axes of the world, act on a body from now on."""
        self._data.xfrc_applied[find(self._model, "body", body), :3] = force

    def block(self, joint: str, blocked: bool) -> None:
        """Let a joint be stuck from now on, or not any more."""
        self._brakes.set(joint, blocked)

    def distort(self, element: str, distortion: Distortion | None) -> None:
        """Distort what is measured, before `through` (`specc_runtime.distortion.Distortable`)."""
        self._sensors[element].distortion = distortion

    def saved(self) -> dict[str, Any]:
        """See `specc_runtime.savable.Savable`; without commands, and what is blocked or pushed."""
        state = np.empty(mujoco.mj_stateSize(self._model, _STATE))
        mujoco.mj_getState(self._model, self._data, state, _STATE)
        derived = {name: np.array(getattr(self._data, name)).ravel() for name in _DERIVED}
        samples = {name: sensor.samples for name, sensor in self._sensors.items()}
        return {"state": state, **derived, "samples": samples, "clipped": self.clipped()}

    def restore(self, saved: Any) -> None:
        """See `specc_runtime.savable.Savable`. Raises PlantError for the state of another model."""
        size = mujoco.mj_stateSize(self._model, _STATE)
        state = np.array(saved["state"], dtype=np.float64)
        if state.shape != (size,):
            raise PlantError(f"the state of a model with {state.size} numbers, not {size}")
        mujoco.mj_setState(self._model, self._data, state, _STATE)
        self._data.xfrc_applied[:] = 0.0  # what pushes now pushes again
        self._brakes.hold()
        for name in _DERIVED:
            array = getattr(self._data, name)
            array[:] = np.array(saved[name], dtype=np.float64).reshape(array.shape)
        for name, count in saved["samples"].items():
            if name in self._sensors:
                self._sensors[name].skip(min(int(count), _MOST_SAMPLES))
        for name, clipped in saved.get("clipped", {}).items():  # older recordings have none
            if name in self._actuators:
                ends = tuple(map(float, clipped["range"]))
                self._actuators[name].clips.found = Clipped(**{**clipped, "range": ends})
        self._cameras.forget()

    def picture(self, camera: str, width: int, height: int) -> NDArray[np.uint8]:
        """(height, width, 3) RGB picture for people; cameras of agents are sensors."""
        return self._cameras.picture(self._cameras.camera(camera, width, height), self._shown)

    def picture_of_now(self, camera: str, width: int, height: int) -> Future[NDArray[np.uint8]]:
        """See `specc_runtime.plant.Photographed`."""
        return self._cameras.picture_of_now(self._cameras.camera(camera, width, height))

    def viewpoints(self) -> list[Viewpoint]:
        """The cameras that have names (`specc_runtime.plant.Filmable`)."""
        return self._bodies.viewpoints()

    def show_geom_groups(self, groups: Sequence[int]) -> None:
        """See `specc_runtime.plant.Grouped`."""
        self._shown = tuple(groups)

    def body_names(self) -> tuple[str, ...]:
        """Names of all bodies but the world."""
        return self._bodies.names

    def body_poses(self) -> NDArray[np.float64]:
        """(n, 7) where they are: x, y, z in m, quaternion w, x, y, z."""
        return self._bodies.poses()

    def shapes(self) -> list[Shape | Mesh]:
        """What they look like."""
        return list(self._bodies.shapes())

    def open_viewer(self) -> Viewer:
        """A window on the plant for people. Raises PlantError where there is no display."""
        return Viewer(self._model, self._data)

    def close(self) -> None:
        """Free the graphics system; the plant cannot be used afterwards."""
        self._cameras.close()


def _check_unique(names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise PlantError(f"two bindings are called '{name}'")
