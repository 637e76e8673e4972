"""What stands behind the elements of devices: parts of a model, or topics of ROS 2."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final, Literal

from specc.model.units import Unit
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Binding:
    """What stands behind one element of a device in the plant."""

    device: str
    element: str
    place: Place
    joints: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    actuators: tuple[str, ...] = ()
    camera: str = ""
    image: Literal["", "rgb", "depth"] = ""
    rate_hz: Fraction | None = None
    noise: tuple[float, ...] = ()
    depth_noise: str = ""
    through: str = ""
    noise_units: tuple[Unit, ...] = ()
    """Units in which `noise` is written."""
    sporadic: bool = False
    """Whether there may be no new sample, for at most `max_gap_s` if that is known."""
    max_gap_s: Fraction | None = None
    topic: str = ""
    message: str = ""
    """Type of the messages of the topic, `package/Type`."""
    qos: tuple[tuple[str, str | int], ...] = ()
    """Options of the quality of service of the topic, as they are given."""
    tf: tuple[str, ...] = ()
    """Frames of the specification between which tf2 has the transform."""
    action: str = ""
    part: Literal["", "goal", "status", "feedback", "result"] = ""
    """What of the action the element is; `message` is the type of the action."""


PLANT: Final = "plant"
"""Stands for the device in bindings of what requirements see of the plant."""


@dataclass(frozen=True, slots=True)
class Published:
    """What others in ROS can watch: `agent.subsystem` its state, `agent.subsystem.y.peer.element`
    what it sends."""

    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Ros2:
    """The node behind which devices are; `frames` has what ROS calls those of the system."""

    node: str
    python: str
    wait_s: Fraction
    use_sim_time: bool
    frames: tuple[tuple[str, str], ...]
    place: Place
