"""Which messages of ROS 2 go with which elements, and what others can watch.

What is known of messages is the table in `ros2_messages`; here elements are compared with it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.analysis.ros2_messages import (
    CALL_MESSAGES,
    JOINTS,
    MESSAGES,
    NEEDED_IN_POINTS,
    TIME_OF_POINT,
    MessagePart,
    scalar,
    short_message_type,
)
from specc.diagnostics import nearest
from specc.diagnostics.phrases import with_article
from specc.lang.kinds import kind
from specc.model.bindings import DIAGNOSTICS, Binding, CallKind, Published
from specc.model.system import Element, Subsystem, System
from specc.model.types import Enum, OptionalOf, Pose, Record, Text, Type, Vector
from specc.model.units import DIMENSIONLESS


@dataclass(frozen=True, slots=True)
class MessageTypeMismatch:
    """Why messages do not carry an element, and a way out; `code` is that of the finding."""

    message: str
    help: str
    code: str = "E0521"


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


def known_parts(binding: Binding) -> tuple[MessagePart, ...]:
    """The parts that messages of a binding are known to have."""
    message = short_message_type(binding.message)
    return (
        CALL_MESSAGES.get((message, binding.part), ())
        if binding.call[0]
        else MESSAGES.get(message, ())
    )


def takes_joints(binding: Binding) -> bool:
    """Whether messages of a binding name joints."""
    return any(part.shape in JOINTS for part in known_parts(binding))


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
    if call == "action_server" and binding.part == "request" and "Bool" in shapes:
        return MessagePart("arrival")
    if known_parts(binding):
        name = f"the {binding.part} of a {short_message_type(binding.message)}"
        return _known_part(binding, value, name, commanded=commanded)
    if commanded and isinstance(value, Record) and _is_plain(value):
        return MessagePart("record")
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
    field = binding.field
    if any(part.path == field for part in known_parts(binding)):
        return _known_part(binding, type_, f"`{field}`", commanded=commanded)
    for shape in kind(type_).shapes(type_):
        if shape not in ONLY_SENT or (commanded and _is_plain(type_)):
            return MessagePart("scalar" if shape in _WORDS_OF_SCALARS else shape, field)
    return MessageTypeMismatch(
        f"{type_} is no field of a message", "name a function under `through:` that converts"
    )


def _known_part(
    binding: Binding, type_: Type, name: str, *, commanded: bool
) -> MessagePart | MessageTypeMismatch:
    """The part of messages that are in the table. `name` says what of them is meant."""
    message = short_message_type(binding.message)
    parts = [p for p in known_parts(binding) if binding.field in ("", p.path)]
    fitting = [p for p in parts if _carries(p, message, type_)]
    if fitting and commanded and not any(part.sent for part in fitting):
        return MessageTypeMismatch(
            f"{name} is only read" if binding.call[0] else f"{name} are only read",
            "name a function under `through:` that makes the fields of a message",
        )
    if not commanded and all(part.shape in ONLY_SENT for part in fitting or parts):
        return MessageTypeMismatch(
            f"{type_} is not read from {name}: records are only sent",
            "name a function under `through:` that makes the value of a message",
        )
    if not fitting:
        verb = "sent as" if commanded else "read from"
        words = (_WORDS.get(p.shape, _WORDS_OF_SCALARS[_scalar_of(p, message)]) for p in parts)
        return MessageTypeMismatch(
            f"{type_} is not {verb} {name}",
            f"make it {' or '.join(dict.fromkeys(words))}, or name a function under `through:` "
            "that converts",
        )
    unit = type_.units[0] if len(type_.units) == 1 else None
    for part in fitting:
        if part.fields:
            return _record_mismatch(part, type_, name) or part
        if part.unit is None or unit is None or part.unit == unit:
            return part
    units: dict[str, list[str]] = {}
    for each in fitting:
        units.setdefault(each.path, []).append(str(each.unit))
    known = [f"{path} in {' or '.join(each)}".strip() for path, each in units.items()]
    return MessageTypeMismatch(
        f"numbers in {unit or DIMENSIONLESS} are not those of {name}: known are {', '.join(known)}",
        "give the element the unit of REP 103, or name a function under `through:` that converts",
        "E0511",
    )


ONLY_SENT = ("record", "records", "trajectory")
"""Shapes that are only sent."""


def _is_plain(type_: Type) -> bool:
    """Whether a value tells by itself what its fields are: of six numbers, nothing does."""
    shape = next(iter(kind(type_).shapes(type_)), "")
    is_known = shape in (*_WORDS_OF_SCALARS, *_PLAIN, *ONLY_SENT)
    return is_known and all(map(_is_plain, type_.parts))


_PLAIN = ("vector", "tuple", "vector3", "pose")


def _record_mismatch(part: MessagePart, type_: Type, name: str) -> MessageTypeMismatch | None:
    """Why the fields of a record are not those of a message."""
    record = type_ if isinstance(type_, Record) else type_.parts[0]
    assert isinstance(record, Record), "only records and lists of them have that shape"
    known, given = dict(part.fields), dict(record.fields)
    listed = ", ".join(
        f"{field} ({' or '.join(map(str, units))})" for field, units in known.items()
    )
    needed = NEEDED_IN_POINTS if part.shape == "trajectory" else ()
    if lacking := [field for field in needed if field not in given]:
        why, code = f"{record} has no {' and no '.join(lacking)}", "E0521"
    elif unknown := [field for field in given if field not in known]:
        why, code = f"{name} has no {' and no '.join(unknown)}, which {record} has", "E0521"
    elif other := next((f for f, of in given.items() if _is_other(part, f, of)), ""):
        why = f"`{other}` of {record} is {given[other]}"
        code = "E0521" if set(given[other].units) & set(known[other]) else "E0511"
    elif len({len(of.components) for of in given.values()} - {0}) > 1:
        why, code = f"the vectors of {record} are not of one size", "E0521"
    else:
        return None
    return MessageTypeMismatch(why, f"known fields are {listed}", code)


def _is_other(part: MessagePart, name: str, type_: Type) -> bool:
    """Whether a field has another unit, or is a vector where it is to be a number, or the other
    way round.
    """
    is_vector = part.shape == "trajectory" and name != TIME_OF_POINT
    return is_vector != isinstance(type_, Vector) or not set(type_.units) & set(
        dict(part.fields)[name]
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
    if message in MESSAGES:
        name = f"messages of type {message}"
        return _known_part(binding, type_, name, commanded=commanded)
    if commanded and isinstance(type_, Record) and _is_plain(type_):
        return MessagePart("record")
    return MessageTypeMismatch(
        f"no value is known to stand in messages of type {message}",
        "name a function under `through:` that makes the value of a message"
        if not commanded
        else "name a function under `through:` that makes the fields of a message",
    )


def _carries(part: MessagePart, message: str, type_: Type) -> bool:
    """Whether values of a type have the shape of that part, in any unit."""
    shape = _scalar_of(part, message) if part.shape in ("scalar", "arrival") else part.shape
    return shape in kind(type_).shapes(type_)


def _scalar_of(part: MessagePart, message: str) -> str:
    return part.scalar or scalar(message)


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
    "record": "a record",
    "trajectory": "a record with positions and time_from_start, or a list of these",
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
