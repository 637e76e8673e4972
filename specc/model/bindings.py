"""What stands behind the elements of devices: parts of a plant, messages of ROS 2, the panel."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final, Literal

from specc.model.expr import Expr, Number
from specc.model.units import Unit
from specc.source import Place

PanelKind = Literal["button", "switch", "slider", "choice", "number"]


@dataclass(frozen=True, slots=True)
class Widget:
    """What of the panel sets an element, whose value is the `initial` one until then.

    `bounds` are the least and the greatest value. All are literals, and None where they are wrong;
    `texts` are the expressions that they come from.
    """

    kind: PanelKind
    initial: Expr | None = None
    bounds: tuple[Number, Number] | None = None
    hold: bool = False
    """Whether a button is true while it is held; another one is true once for each press."""
    key: str = ""
    """The character that operates it in a terminal."""
    texts: tuple[Expr, ...] = ()


@dataclass(frozen=True, slots=True)
class Initial:
    """What an element is until its first message, or after a loss.

    `value` is as `specc.lang.evaluate` has it.
    """

    expr: Expr
    value: Any


CallKind = Literal["action", "action_server", "service", "service_server"]


@dataclass(frozen=True, slots=True)
class Binding:
    """What the plant binds to one element of a device."""

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
    part: Literal["", "goal", "status", "feedback", "result", "request", "cancel", "response"] = ""
    """What of an action or a service the element is; `message` is the type of that."""
    panel: Widget | None = None
    """Of an element that the operator sets, and no plant."""
    initial: Initial | None = None
    """Of an element that need not have a message when a run begins."""
    on_loss: Initial | None = None
    """Of an element whose loss is no fault."""
    action_server: str = ""
    service: str = ""
    service_server: str = ""
    field: str = ""
    """The field of the message that is the value, a path with dots."""
    when_busy: Literal["", "reject", "queue", "preempt"] = ""
    answer_within_s: Fraction | None = None

    @property
    def call(self) -> tuple[CallKind | Literal[""], str]:
        """The kind and the name of the action or service of which the element is a part."""
        kinds: tuple[CallKind, ...] = ("action", "action_server", "service", "service_server")
        return next(((k, getattr(self, k)) for k in kinds if getattr(self, k)), ("", ""))

    @property
    def is_of_ros(self) -> bool:
        """Whether a node of ROS stands behind the element, as one of its keys says."""
        return bool(self.topic or self.tf or self.call[0])

    @property
    def name(self) -> str:
        """The element with its device: `irp.E.m.c_d`."""
        return f"{self.device}.{self.element}"


PLANT: Final = "plant"
"""Stands for the device in bindings of what requirements see of the plant."""


DIAGNOSTICS: Final = "diagnostics"
"""Stands for the diagnostics of all subsystems among what is published."""


@dataclass(frozen=True, slots=True)
class Published:
    """A state or an output that is published in ROS.

    It is named `agent.subsystem` or `agent.subsystem.y.peer.element`, or is `DIAGNOSTICS`.
    """

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
