"""Which joints, sensors, actuators and cameras of a model stand behind one element of a buffer."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from specc_runtime.contracts import Contract, as_any
from specc_runtime.panel import PanelElement

Image = Literal["rgb", "depth"]
DepthNoise = Literal["none", "kinect"]


@dataclass(frozen=True, slots=True)
class SensorBinding:
    """One element that the plant writes.

    A plant that is no MuJoCo model knows it by its name; of the rest, only `rate_hz`, `sporadic`
    and `max_gap_s` are about it.
    The raw measurement is either an image of `camera` or the concatenation, in this order, of the
    positions of `joints`, the data of `sensors` and the forces of `actuators`.

    Attributes:
        name: of the binding, e.g. "irp.E.m.m_m"; unique among the sensors of a plant.
        joints: names of joints; hinges and slides give one number each, in rad and m.
        sensors: names of sensors of the model; what range finders give is in `mujoco.ranging`.
        actuators: names of actuators; each gives the force it exerts now, N or Nm.
        camera: name of a camera, exclusive with the three above.
        image: "rgb" (h, w, 3) uint8, or "depth" (h, w) float32 in metres along the optical axis,
            0 where there is no reading.
        through: value = through(raw); none means value = raw, a float if raw has one number.
        noise: standard deviation of Gaussian noise for each of `sensors`, in the sensor's unit;
            empty means none.
        depth_noise: "kinect" adds the depth noise of `noise.kinect_depth`.
        rate_hz: the value is taken at the first sample in each period 1/rate_hz and held for the
            rest of it; none means taken afresh whenever time has passed.
        sporadic: whether there may be no new sample; there always is one at time 0.
        max_gap_s: longest time without a new sample; None means that it is not limited.
        contract: what every sample is checked with.
        declared: the type of the element, in the specification's words.
        is_vector: one raw number is a vector of one, not a number.
        is_pose: the raw numbers are a position and a quaternion, w first, of which the value is
            the pose; of the noise of an orientation, in rad, each axis has its own.
        panel: what of the operator's panel gives the value, if the plant does not.
        initial: the one value at time 0, of which the plant is not asked then; empty if it is.
        on_loss: the one value that a loss gives, after `max_gap_s` or when the plant tells of it;
            empty if a loss is a fault.
    """

    name: str
    joints: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    actuators: tuple[str, ...] = ()
    camera: str = ""
    image: Image = "rgb"
    through: Callable[[Any], Any] | None = None
    noise: tuple[float, ...] = ()
    depth_noise: DepthNoise = "none"
    rate_hz: float | None = None
    sporadic: bool = False
    max_gap_s: float | None = None
    contract: Contract = as_any
    declared: str = "any value"
    is_vector: bool = False
    is_pose: bool = False
    panel: PanelElement | None = None
    initial: tuple[Any, ...] = ()
    on_loss: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class ActuatorBinding:
    """One element that the plant reads.

    Attributes:
        name: of the binding; unique among the actuators of a plant.
        actuators: names of actuators of the model, driven in this order.
        joints: names of joints whose positions, then velocities, form `raw`.
        through: ctrl = through(command, raw); none means ctrl = command.
    """

    name: str
    actuators: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    through: Callable[[Any, Any], Any] | None = None
