"""Sensors: from a binding to its value at the present time."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import islice
from math import floor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.distortion import Distortion
from specc_runtime.faults import DeviceFailed
from specc_runtime.operators.arrays import Array
from specc_runtime.plant import Deferred
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import noise
from specc_runtime.plants.mujoco.cameras import Cameras
from specc_runtime.plants.mujoco.model import find, position_indices
from specc_runtime.plants.mujoco.posing import check_pose, measured_pose
from specc_runtime.plants.mujoco.ranging import Ranges, reach_m
from specc_runtime.plants.mujoco.view import Camera
from specc_runtime.random_streams import stream

_TICK_TOLERANCE = 1e-6  # of a period; times are sums of floating-point time steps


class ModelSensor:
    """One bound sensor, with its noise and the value it holds."""

    def __init__(self, model: Any, data: Any, cameras: Cameras, binding: SensorBinding) -> None:
        self._binding = binding
        self._rate_hz = binding.rate_hz
        self._data = data
        self._take: Callable[[], Any]
        if binding.camera:
            self._cameras = cameras
            self._camera = _camera(cameras, binding)
            self._take = self._take_image
        else:
            self._read = _number_reader(model, data, binding)
            self._ranges = Ranges(binding, _reach(model, binding), _names(model, binding))
            self._take = self._take_numbers
            if binding.is_pose:
                check_pose(model, binding)
                self._take = self._take_pose
        self._sigma = _sigma(model, binding)
        self.reset(0)

    def reset(self, seed: int) -> None:
        """Restart the noise of this sensor for a run with that seed and forget the held value."""
        self._seed = seed
        rng = stream(seed, self._binding.name)
        self._noise = None if self._sigma is None else noise.gaussian(rng, self._sigma)
        self.samples = 0
        """How many were taken; the noise of the next one follows from it."""
        self.distortion: Distortion | None = None
        self._period: float | None = None
        self._value: Any = None

    def sample(self) -> Any:
        """Value at this time; arrays are read-only. Asking twice at one time changes nothing.

        An image is `Deferred`: it is drawn, and its noise made, when it is read.
        """
        period = self._data.time
        if self._rate_hz is not None:
            period = floor(period * self._rate_hz + _TICK_TOLERANCE)
        if period != self._period:
            self._period, self._value = period, self._take()
            self.samples += 1
        return self._value

    def skip(self, samples: int) -> None:
        """Be as after so many samples since the reset."""
        if self._noise is not None:
            next(islice(self._noise, samples, samples), None)
        self.samples = samples

    def _take_numbers(self) -> Any:
        raw = self._read()
        noisy = raw if self._noise is None else raw + next(self._noise)
        if self.distortion is not None:
            noisy = self.distortion.numbers(noisy)
        return self._value_of(self._ranges.read(raw, noisy) if self._ranges else noisy)

    def _take_pose(self) -> Any:
        noise = np.zeros(6) if self._noise is None else next(self._noise)
        return self._value_of(measured_pose(self._read(), noise, self.distortion))

    def _take_image(self) -> Deferred:
        camera, cameras, shot = self._camera, self._cameras, self._cameras.shot()
        noisy = self._binding.depth_noise == "kinect"
        grain: Callable[[], Any] = partial(self._grain, self._seed, self.samples)
        grains = []

        def begin() -> None:
            cameras.frame(camera, shot)
            if noisy:  # while the frame is drawn
                grains.append(grain())

        def develop() -> Any:
            frame = cameras.frame(camera, shot).result()
            if self._binding.image == "rgb":
                return self._value_of(frame.rgb)
            depth = noise.kinect_depth(frame.depth, grains.pop()) if noisy else frame.depth
            return self._value_of(depth)

        return Deferred(develop, begin)

    def _grain(self, seed: int, number: int) -> NDArray[np.float32]:
        size = self._camera.height, self._camera.width
        return noise.grain(stream(seed, self._binding.name, number), size)

    def _value_of(self, raw: Any) -> Any:
        through = self._binding.through
        if through is not None:
            try:
                value = through(raw)
            except BaseException as error:  # whatever the user's function raises
                raise DeviceFailed(self._binding.name, error, {"raw": raw}, through) from error
        else:
            one = raw.shape == (1,) and not self._binding.is_vector
            value = float(raw[0]) if one else raw
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        return value


def _camera(cameras: Cameras, binding: SensorBinding) -> Camera:
    if binding.joints or binding.sensors or binding.actuators or binding.noise:
        raise PlantError(
            f"sensor '{binding.name}': a camera cannot be combined with joints or noise"
        )
    if binding.depth_noise != "none" and binding.image != "depth":
        raise PlantError(f"sensor '{binding.name}': depth noise on an image without depth")
    return cameras.camera(binding.camera)


def _number_reader(model: Any, data: Any, binding: SensorBinding) -> Callable[[], Array]:
    joints = position_indices(model, binding.joints)
    sensors = _sensor_indices(model, binding.sensors)
    actuators = np.array([find(model, "actuator", a) for a in binding.actuators], dtype=np.intp)
    sources = (data.qpos, joints), (data.sensordata, sensors), (data.actuator_force, actuators)
    parts = [(numbers, where) for numbers, where in sources if where.size]
    if not parts:
        raise PlantError(f"sensor '{binding.name}' measures nothing")
    if binding.depth_noise != "none":
        raise PlantError(f"sensor '{binding.name}': depth noise without a camera")

    if len(parts) == 1:
        ((numbers, where),) = parts
        return partial(numbers.take, where)
    return lambda: np.concatenate([numbers[where] for numbers, where in parts])


def _sensor_indices(model: Any, names: tuple[str, ...]) -> Any:
    ids = [find(model, "sensor", name) for name in names]
    parts = [np.arange(model.sensor_dim[i]) + model.sensor_adr[i] for i in ids]
    return np.concatenate(parts) if parts else np.array([], dtype=np.intp)


def _sigma(model: Any, binding: SensorBinding) -> Array | None:
    """One standard deviation per raw number; only data of sensors is noisy.

    The turns of a pose about three axes are as noisy as its orientation.
    """
    if not binding.noise:
        return None
    if len(binding.noise) != len(binding.sensors):
        raise PlantError(
            f"sensor '{binding.name}': {len(binding.noise)} noise values for "
            f"{len(binding.sensors)} sensors"
        )
    if binding.is_pose:
        return np.repeat(np.asarray(binding.noise, dtype=float), 3)
    return _spread(model, binding, binding.noise)


def _reach(model: Any, binding: SensorBinding) -> Array:
    """How far each raw number can reach, m; 0 of all that are not from range finders."""
    sensors = [find(model, "sensor", name) for name in binding.sensors]
    return _spread(model, binding, [reach_m(model, sensor) for sensor in sensors])


def _names(model: Any, binding: SensorBinding) -> list[str]:
    """The sensor that gives each raw number; empty for those of joints and actuators."""
    places = _spread(model, binding, range(1, len(binding.sensors) + 1))
    return [("", *binding.sensors)[int(place)] for place in places]


def _spread(model: Any, binding: SensorBinding, of_sensors: Sequence[float]) -> Array:
    """One for each raw number: that of its sensor, 0 for those of joints and actuators."""
    sizes = [int(model.sensor_dim[find(model, "sensor", name)]) for name in binding.sensors]
    before = position_indices(model, binding.joints).size
    sensors = np.repeat(np.asarray(of_sensors, dtype=float), sizes)
    return np.concatenate((np.zeros(before), sensors, np.zeros(len(binding.actuators))))
