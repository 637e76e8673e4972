"""What others in ROS can watch: which messages states of machines and outputs become."""

from __future__ import annotations

import re

from specc.analysis.ros2 import FRAME, Misfit, Part
from specc.diagnostics import nearest
from specc.frozen import frozen
from specc.model.binding import Published
from specc.model.system import Element, Subsystem, System
from specc.model.types import (
    Bool,
    Enum,
    Image,
    Int,
    OptionalOf,
    Pose,
    Real,
    Spatial,
    Text,
    Type,
    Vector,
)


@frozen
class Watched:
    """A state, or an output element, with the messages that it becomes.

    `peer` is empty for a state.
    """

    name: str
    subsystem: Subsystem
    peer: str
    element: str
    message: str
    part: Part
    type: Type

    @property
    def topic(self) -> str:
        """Below the name of the node; ROS has no double underscores."""
        return "~/" + "/".join(re.sub("_+", "_", word).strip("_") for word in self.name.split("."))


def watched(published: Published, system: System) -> Watched | Misfit:
    """What a name stands for, or why nobody can watch it."""
    subsystems = {part.qualified_name: part for part in system.subsystems}
    name = published.name
    owner = ".".join(name.split(".")[:2])
    subsystem = subsystems.get(owner)
    if subsystem is None:
        return _unknown("subsystem", owner, tuple(subsystems))
    if name == owner:
        return Watched(name, subsystem, "", "", "std_msgs/String", Part("scalar", "data"), Text())
    sent = {
        f"{owner}.y.{port.peer}.{element.name}": (port.peer, element)
        for port in subsystem.ports
        if port.direction == "y"
        for element in port.elements
    }
    if name not in sent:
        return _unknown("output", name, tuple(sent))
    return _output(name, subsystem, *sent[name])


def _unknown(kind: str, name: str, known: tuple[str, ...]) -> Misfit:
    close = nearest(name, known)
    listed = ", ".join(f"`{one}`" for one in (close or known)[:6])
    help = f"did you mean {listed}?" if close else f"there are {listed}" if listed else "delete it"
    return Misfit("E0523", f"there is no {kind} `{name}` to publish", help)


def _output(name: str, subsystem: Subsystem, peer: str, element: Element) -> Watched | Misfit:
    type_ = element.type.value if isinstance(element.type, OptionalOf) else element.type
    found = _message(type_)
    if found is None:
        help = "publish a part of it: send that as an element of its own"
        return Misfit("E0523", f"{type_} becomes no message that is known", help)
    return Watched(name, subsystem, peer, element.name, *found, type_)


_SCALARS: dict[type, str] = {
    Bool: "Bool",
    Int: "Int64",
    Real: "Float64",
    Text: "String",
    Enum: "String",
}


def _message(type_: Type) -> tuple[str, Part] | None:
    """The type of messages, and where in them the value is."""
    match type_:
        case Bool() | Int() | Real() | Text() | Enum():
            return f"std_msgs/{_SCALARS[type(type_)]}", Part("scalar", "data")
        case Vector(frame=frame) if frame:
            return "geometry_msgs/PointStamped", Part("vector3", "point", frame=FRAME)
        case Vector(element=Real()):
            return "std_msgs/Float64MultiArray", Part("vector", "data")
        case Vector(element=Int()):
            return "std_msgs/Int64MultiArray", Part("tuple", "data")
        case Pose():
            return "geometry_msgs/PoseStamped", Part("pose", "pose", frame=FRAME)
        case Image(channels=channels):
            return "sensor_msgs/Image", Part("image" if channels == 3 else "depth")
        case Spatial() if str(type_).startswith(("twist", "wrench")):
            kind = str(type_).partition("[")[0]
            message = f"geometry_msgs/{kind.title()}Stamped"
            return message, Part(kind, kind, frame=FRAME)
    return None
