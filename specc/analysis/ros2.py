"""Which messages of ROS 2 go with which types, what of them is the value, what others can watch.

The units of messages are those of REP 103: an element in another unit is another quantity, since
all numbers of a running system are SI's. How parts of messages are read and written is in the
runtime, by the names of shapes that are chosen here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.diagnostics import nearest
from specc.diagnostics.phrases import with_article
from specc.lang.kinds import kind
from specc.model.system import DIAGNOSTICS, Binding, CallKind, Element, Published, Subsystem, System
from specc.model.types import Enum, OptionalOf, Pose, Text, Type
from specc.model.units import (
    DIMENSIONLESS,
    METRE,
    NEWTON,
    NEWTON_METRE,
    RADIAN,
    SECOND,
    Unit,
    parse_unit,
)
from specc.reachable import grouped

FRAME, CHILD = "header.frame_id", "child_frame_id"
"""Fields that hold coordinate frames."""


@dataclass(frozen=True, slots=True)
class MessagePart:
    """A part of messages that is the value of elements of some types.

    `unit` is that of numbers, None where it is not said; `frame` and `child` are the fields of the
    coordinate frames that the value is in. A part that is not `sent` is only read.
    """

    shape: str
    path: str = ""
    unit: Unit | None = None
    frame: str = ""
    child: str = ""
    sent: bool = True


@dataclass(frozen=True, slots=True)
class MessageTypeMismatch:
    """Why messages do not carry an element, and a way out; `code` is that of the finding."""

    message: str
    help: str
    code: str = "E0521"


_INTS = [f"{sign}{bits}" for sign in ("Int", "UInt") for bits in (8, 16, 32, 64)]
_FLOATS = ("Float32", "Float64")
_OF_JOINTS = {
    "position": (RADIAN, METRE),
    "velocity": (RADIAN / SECOND, METRE / SECOND),
    "effort": (NEWTON_METRE, NEWTON),
}
JOINT_STATE = "sensor_msgs/JointState"


def _table() -> Iterator[tuple[str, MessagePart]]:
    """Parts by the type of messages; one type may have several."""
    for name in ("Bool", "String", "Char", *_INTS, *_FLOATS):
        yield f"std_msgs/{name}", MessagePart("scalar", "data")
    for name in _FLOATS:
        yield f"std_msgs/{name}MultiArray", MessagePart("vector", "data")
    for name in _INTS:
        yield f"std_msgs/{name}MultiArray", MessagePart("tuple", "data")
    for field, units in _OF_JOINTS.items():
        yield from ((JOINT_STATE, MessagePart("joints", field, unit)) for unit in units)
    yield from _geometry()
    yield "nav_msgs/Odometry", MessagePart("pose", "pose.pose", frame=FRAME, child=CHILD)
    yield "nav_msgs/Odometry", MessagePart("twist", "twist.twist", frame=CHILD)
    yield "std_msgs/Empty", MessagePart("arrival", sent=False)
    yield "sensor_msgs/Range", MessagePart("scalar", "range", METRE)
    yield "sensor_msgs/Imu", MessagePart("vector3", "angular_velocity", RADIAN / SECOND)
    yield "sensor_msgs/Imu", MessagePart("vector3", "linear_acceleration", METRE / SECOND**2)
    yield "sensor_msgs/Image", MessagePart("image")
    yield "sensor_msgs/Image", MessagePart("depth")
    yield "sensor_msgs/CameraInfo", MessagePart("camera", "k", parse_unit("px"), sent=False)


def _geometry() -> Iterator[tuple[str, MessagePart]]:
    """Of `geometry_msgs`, as they are and with a header."""
    for name, shape, unit in (
        ("Pose", "pose", None),
        ("Twist", "twist", None),
        ("Wrench", "wrench", None),
        ("Point", "vector3", METRE),
        ("Vector3", "vector3", None),
    ):
        field = "vector" if name == "Vector3" else name.lower()
        yield f"geometry_msgs/{name}", MessagePart(shape, "", unit)
        yield f"geometry_msgs/{name}Stamped", MessagePart(shape, field, unit, frame=FRAME)
    for name, shape in (("Pose", "pose"), ("Twist", "twist")):
        lower = f"{name.lower()}.{name.lower()}"
        full = f"geometry_msgs/{name}WithCovariance"
        yield full, MessagePart(shape, name.lower())
        yield f"{full}Stamped", MessagePart(shape, lower, frame=FRAME)
    yield "geometry_msgs/Transform", MessagePart("transform")
    stamped = MessagePart("transform", "transform", frame=FRAME, child=CHILD)
    yield "geometry_msgs/TransformStamped", stamped


MESSAGES = {name: tuple(parts) for name, parts in grouped(_table()).items()}
"""The parts of messages, by their types as `package/Type`."""


def short_message_type(message: str) -> str:
    """`package/Type` of a type that may be written `package/msg/Type`."""
    return message.replace("/msg/", "/").replace("/action/", "/").replace("/srv/", "/")


# Actions and services: which parts of them elements are.

STATUSES = (
    "none", "accepted", "executing", "canceling", "succeeded", "canceled", "aborted", "rejected",
)  # fmt: skip
"""Of an action that is called: there was no goal yet, or what has become of the last one."""
SERVED_STATUSES = tuple(status for status in STATUSES if status != "canceling")
"""Of an action that is served: what the agent says; `none` is that it takes a goal."""
CALL_STATUSES = ("none", "called", "answered", "missing", "late")
"""Of a service that is called: there was no call yet, or what has become of the last one."""


@dataclass(frozen=True, slots=True)
class CallParts:
    """The parts that an action or a service has for an agent, commanded and reported ones.

    A `given_back` part is reported, too: what the device took last.
    """

    commanded: tuple[str, ...]
    reported: tuple[str, ...]
    given_back: str = ""


CALLS: dict[CallKind, CallParts] = {
    "action": CallParts(("goal",), ("status", "feedback", "result"), given_back="goal"),
    "action_server": CallParts(("status", "feedback", "result"), ("request", "cancel")),
    "service": CallParts(("request",), ("status", "response"), given_back="request"),
    "service_server": CallParts(("response",), ("request",)),
}

_CALLED = (MessagePart("arrival"),)
_ANSWERED = (MessagePart("scalar", "success"), MessagePart("scalar", "message", sent=False))
_OF_SERVICES = {
    ("std_srvs/Empty", "request"): _CALLED,
    ("std_srvs/Empty", "response"): _CALLED,
    ("std_srvs/SetBool", "request"): (MessagePart("scalar", "data"),),
    ("std_srvs/SetBool", "response"): _ANSWERED,
    ("std_srvs/Trigger", "request"): _CALLED,
    ("std_srvs/Trigger", "response"): _ANSWERED,
}
"""By types of services and parts: which fields hold a value without a word in the binding."""
_SCALAR_OF = {"data": "Bool", "success": "Bool", "message": "String", "": "Bool"}
"""The scalars of these fields."""


def _part_of_call(
    binding: Binding, type_: Type, *, commanded: bool
) -> MessagePart | MessageTypeMismatch:
    """The part of an action or a service that holds the element's value, or why there is none."""
    call, _ = binding.call
    assert call, "the caller knows that it is a part of one"
    what = "service" if "service" in call else "action"
    if binding.part in ("status", "cancel"):
        return _word_of_call(binding, type_, what)
    is_given_back = binding.part == CALLS[call].given_back and not commanded
    value = type_.value if isinstance(type_, OptionalOf) else type_
    if (lacking := _lacks_none(binding, what, commanded)) and value is type_:
        return MessageTypeMismatch(
            f"{type_} has no None, which {lacking}", f'make it an "optional[{type_}]"'
        )
    if is_given_back:
        return MessagePart("scalar")
    if binding.through or binding.field:
        return _part_by_key(binding, value, commanded=commanded)
    shapes = kind(value).shapes(value)
    for part in _OF_SERVICES.get((short_message_type(binding.message), binding.part), ()):
        if _SCALAR_OF[part.path] in shapes and (part.sent or not commanded):
            return part
    if call == "action_server" and binding.part == "request" and "Bool" in shapes:
        return MessagePart("arrival")
    made = "its fields" if commanded else "its value of a message"
    return MessageTypeMismatch(
        f"the {binding.part} of {with_article(what)} is a message of its own type",
        f"name the field that holds the value, `field: NAME`, or a function under `through:` that "
        f"makes {made}",
    )


def _word_of_call(binding: Binding, type_: Type, what: str) -> MessagePart | MessageTypeMismatch:
    """Of a status, which is a text or an enum, and of `cancel`."""
    shapes, is_served = kind(type_).shapes(type_), binding.call[0] == "action_server"
    if binding.part == "cancel":
        if "Bool" in shapes:
            return MessagePart("scalar")
        why = f"`cancel` says whether the goal is given up, and {type_} is no bool"
        return MessageTypeMismatch(why, "make it a bool")
    words = SERVED_STATUSES if is_served else CALL_STATUSES if what == "service" else STATUSES
    members = type_.members if isinstance(type_, Enum) else words
    if is_served:
        wrong = [member for member in members if member not in words]
        lacking = [] if "none" in members else ["none"]
    else:
        wrong, lacking = [], [word for word in words if word not in members]
    if "String" in shapes and not (wrong or lacking):
        return MessagePart("scalar")
    listed = f"with {'some of ' if is_served else ''}these members: {', '.join(words)}"
    complaint = f"{type_} is neither"
    if wrong or lacking:
        complaint = f"{type_} lacks {', '.join(lacking)}"
        if wrong:
            complaint = f"{type_} has {' and '.join(f'`{word}`' for word in wrong)}"
    subject = f"the status of {with_article(what)}"
    return MessageTypeMismatch(
        f"{subject} is a text or an enum: {complaint}", f"make it a text, or an enum {listed}"
    )


def _lacks_none(binding: Binding, what: str, commanded: bool) -> str:
    """What None stands for in an element that must have it; empty for others."""
    call = binding.call[0]
    if call == "action_server" or (call == "service_server" and not commanded):
        return ""
    if not commanded:
        return "is what there is before the first"
    if call == "service_server":
        return "says that the next call may come"
    return "cancels the goal" if what == "action" else "says that nothing is called"


def _part_by_key(
    binding: Binding, type_: Type, *, commanded: bool
) -> MessagePart | MessageTypeMismatch:
    """The part that a function makes, or that a field holds; its numbers are SI's, as REP 103."""
    if binding.through:
        return MessagePart("message")
    for shape in kind(type_).shapes(type_):
        return MessagePart("scalar" if shape in _WORDS_OF_SCALARS else shape, binding.field)
    return MessageTypeMismatch(
        f"{type_} is no field of a message", "name a function under `through:` that converts"
    )


def part_of(binding: Binding, type_: Type, *, commanded: bool) -> MessagePart | MessageTypeMismatch:
    """The part of a binding's messages that holds the element's value, or why there is none."""
    if binding.call[0]:
        return _part_of_call(binding, type_, commanded=commanded)
    if isinstance(type_, OptionalOf) and not (commanded or binding.through):
        return part_of(binding, type_.value, commanded=commanded)
    if binding.tf:
        wanted = Pose(*binding.tf)
        if type_ == wanted:
            return MessagePart("transform", frame="from", child="to")
        return MessageTypeMismatch(
            f"{type_} is not the transform from {binding.tf[0]} to {binding.tf[1]}",
            f'make it "{wanted}", or name the frames that it is between',
        )
    if binding.through or binding.field:
        return _part_by_key(binding, type_, commanded=commanded)
    message = short_message_type(binding.message)
    parts = MESSAGES.get(message)
    if parts is None:
        return MessageTypeMismatch(
            f"no value is known to stand in messages of type {message}",
            "name a function under `through:` that makes the value of a message"
            if not commanded
            else "name a function under `through:` that makes the fields of a message",
        )
    fitting = [p for p in parts if _carries(p, message, type_)]
    if fitting and commanded and not any(part.sent for part in fitting):
        return MessageTypeMismatch(
            f"messages of type {message} are only read",
            "name a function under `through:` that makes the fields of a message",
        )
    if not fitting:
        verb = "sent as" if commanded else "read from"
        of_scalar = _WORDS_OF_SCALARS[scalar(message)]
        types = dict.fromkeys(_WORDS.get(part.shape, of_scalar) for part in parts)
        return MessageTypeMismatch(
            f"{type_} is not {verb} messages of type {message}",
            f"make it {' or '.join(types)}, or name a function under `through:` that converts",
        )
    unit = type_.units[0] if len(type_.units) == 1 else None
    for part in fitting:
        if part.unit is None or unit is None or part.unit == unit:
            return part
    units: dict[str, list[str]] = {}
    for each in fitting:
        units.setdefault(each.path, []).append(str(each.unit))
    known = [f"{path} in {' or '.join(each)}".strip() for path, each in units.items()]
    return MessageTypeMismatch(
        f"numbers in {unit or DIMENSIONLESS} are not those of {message}: it has {', '.join(known)}",
        "give the element the unit of REP 103, or name a function under `through:` that converts",
        "E0511",
    )


def _carries(part: MessagePart, message: str, type_: Type) -> bool:
    """Whether values of a type have the shape of that part, in any unit."""
    shape = scalar(message) if part.shape in ("scalar", "arrival") else part.shape
    return shape in kind(type_).shapes(type_)


def scalar(message: str) -> str:
    """The scalar of `std_msgs` that stands for those of a message."""
    name = message.partition("/")[2]
    if name in ("String", "Bool", "Empty"):
        return name.replace("Empty", "Bool")
    return "Float64" if name in (*_FLOATS, "Range") else "Int64"


_WORDS = {
    "vector": "a vector of reals",
    "tuple": "a vector of ints",
    "joints": "a vector with one real for each joint",
    "vector3": "a vector of three reals, or a point",
    "camera": "a `vector[4, px]`: fx, fy, cx, cy",
    "pose": "a pose",
    "transform": "a pose",
    "twist": "a twist",
    "wrench": "a wrench",
    "image": "an `image[height, width, 3]`",
    "depth": "an `image[height, width, 1]`, in metres",
}
_WORDS_OF_SCALARS = {
    "String": "a text or an enum",
    "Bool": "a bool",
    "Int64": "an int",
    "Float64": "a real",
}


# Coordinate frames: which fields have to hold which frame.


def frames_of(part: MessagePart, type_: Type) -> Iterator[tuple[str, str]]:
    """Fields of a message that hold a frame, and the frame of the specification."""
    return zip((part.frame, part.child), type_.frames, strict=False)


# What others in ROS can watch: which messages states of machines and outputs become.


@dataclass(frozen=True, slots=True)
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


def published_value(published: Published, system: System) -> PublishedValue | MessageTypeMismatch:
    """The state or output of a name, or why it cannot be published."""
    subsystems = {part.qualified_name: part for part in system.subsystems}
    name = published.name
    owner = ".".join(name.split(".")[:2])
    subsystem = subsystems.get(owner)
    if subsystem is None:
        return _unknown("subsystem", owner, (*subsystems, DIAGNOSTICS))
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


def _unknown(kind: str, name: str, known: tuple[str, ...]) -> MessageTypeMismatch:
    close = nearest(name, known)
    listed = ", ".join(f"`{one}`" for one in (close or known)[:6])
    help = f"did you mean {listed}?" if close else f"there are {listed}" if listed else "delete it"
    return MessageTypeMismatch(f"there is no {kind} `{name}` to publish", help, "E0521")


def _output(
    name: str, subsystem: Subsystem, peer: str, element: Element
) -> PublishedValue | MessageTypeMismatch:
    type_ = element.type.value if isinstance(element.type, OptionalOf) else element.type
    found = _message(type_)
    if found is None:
        help = "publish a part of it: send that as an element of its own"
        return MessageTypeMismatch(f"{type_} becomes no message that is known", help, "E0521")
    return PublishedValue(name, subsystem, peer, element.name, *found, type_)


_PUBLISHED_AS = (
    "std_msgs/Float64MultiArray", "std_msgs/Int64MultiArray", "geometry_msgs/PointStamped",
    "geometry_msgs/PoseStamped", "geometry_msgs/TwistStamped", "geometry_msgs/WrenchStamped",
    "sensor_msgs/Image",
)  # fmt: skip
"""Messages of what is no scalar."""


def _message(type_: Type) -> tuple[str, MessagePart] | None:
    """The type of messages, and where in them the value is."""
    for shape in kind(type_).shapes(type_)[:1]:
        for message in (f"std_msgs/{shape}", *_PUBLISHED_AS):
            for part in MESSAGES.get(message, ()):
                if part.shape in (shape, "scalar"):
                    return message, replace(part, frame=part.frame if type_.frames else "")
    return None
