"""What others in ROS can watch: which messages states of machines and outputs become."""

from __future__ import annotations

import re

from specc.analysis.ros2 import FRAME, MessageMisfit, MessagePart
from specc.diagnostics import nearest
from specc.frozen import frozen
from specc.lang.kinds import kind
from specc.model.binding import Published
from specc.model.system import Element, Subsystem, System
from specc.model.types import (
    OptionalOf,
    Text,
    Type,
)


@frozen
class PublishedValue:
    """A state, or an output element, with the messages that it becomes.

    `peer` is empty for a state.
    """

    name: str
    subsystem: Subsystem
    peer: str
    element: str
    message: str
    part: MessagePart
    type: Type

    @property
    def topic(self) -> str:
        """Below the name of the node; ROS has no double underscores."""
        return "~/" + "/".join(re.sub("_+", "_", word).strip("_") for word in self.name.split("."))


def watched(published: Published, system: System) -> PublishedValue | MessageMisfit:
    """What a name stands for, or why nobody can watch it."""
    subsystems = {part.qualified_name: part for part in system.subsystems}
    name = published.name
    owner = ".".join(name.split(".")[:2])
    subsystem = subsystems.get(owner)
    if subsystem is None:
        return _unknown("subsystem", owner, tuple(subsystems))
    if name == owner:
        return PublishedValue(
            name, subsystem, "", "", "std_msgs/String", MessagePart("scalar", "data"), Text()
        )
    sent = {
        f"{owner}.y.{port.peer}.{element.name}": (port.peer, element)
        for port in subsystem.ports
        if port.direction == "y"
        for element in port.elements
    }
    if name not in sent:
        return _unknown("output", name, tuple(sent))
    return _output(name, subsystem, *sent[name])


def _unknown(kind: str, name: str, known: tuple[str, ...]) -> MessageMisfit:
    close = nearest(name, known)
    listed = ", ".join(f"`{one}`" for one in (close or known)[:6])
    help = f"did you mean {listed}?" if close else f"there are {listed}" if listed else "delete it"
    return MessageMisfit("E0523", f"there is no {kind} `{name}` to publish", help)


def _output(
    name: str, subsystem: Subsystem, peer: str, element: Element
) -> PublishedValue | MessageMisfit:
    type_ = element.type.value if isinstance(element.type, OptionalOf) else element.type
    found = _message(type_)
    if found is None:
        help = "publish a part of it: send that as an element of its own"
        return MessageMisfit("E0523", f"{type_} becomes no message that is known", help)
    return PublishedValue(name, subsystem, peer, element.name, *found, type_)


_MESSAGES = {
    "vector": ("std_msgs/Float64MultiArray", "data"),
    "tuple": ("std_msgs/Int64MultiArray", "data"),
    "vector3": ("geometry_msgs/PointStamped", "point"),
    **{
        part: (f"geometry_msgs/{part.title()}Stamped", part) for part in ("pose", "twist", "wrench")
    },
    **dict.fromkeys(("image", "depth"), ("sensor_msgs/Image", "")),
}
"""By the shapes of values."""


def _message(type_: Type) -> tuple[str, MessagePart] | None:
    """The type of messages, and where in them the value is."""
    for shape in kind(type_).shapes(type_)[:1]:
        if shape not in _MESSAGES:
            return f"std_msgs/{shape}", MessagePart("scalar", "data")
        message, path = _MESSAGES[shape]
        return message, MessagePart(shape, path, frame=FRAME if type_.frames else "")
    return None
