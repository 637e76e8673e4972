"""The graph of ROS 2, and which of its topics go with elements of devices, as what."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from specc.analysis.ros2 import JOINT_STATE, MESSAGES, MessagePart, scalar, short
from specc.diagnostics.nearest import common_prefix
from specc.lang import is_size
from specc.model.units import METRE, RADIAN, SECOND
from specc.schema.keys import message_fault, topic_fault
from specc.tools.importers.writing import SpecNames


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic and the nodes at its ends; what its last `message` says of sizes, joints and frames.

    `*_kept`: the last message is kept for those who come late, or they ask for that. The others are
    the number of messages that came, and the mean and the longest time between them. It is a part
    if messages of a topic of joint states have different joints: those with these joints.
    """

    name: str
    types: Sequence[str]
    publishers: Sequence[str] = ()
    readers: Sequence[str] = ()
    published_kept: bool = False
    read_kept: bool = False
    message: Mapping[str, Any] = field(default_factory=dict)
    count: int = 0
    mean_s: float = 0.0
    longest_s: float = 0.0
    is_part: bool = False

    @property
    def type(self) -> str:
        """`package/Type` of its messages."""
        return short(self.types[0])

    @property
    def order(self) -> tuple[str, int, tuple[str, ...]]:
        """Tells topics and their parts apart, and the order in which devices are made of them."""
        joints = tuple(self.message.get("joints", ())) if self.is_part else ()
        return self.name, -len(joints), joints

    @property
    def commanded(self) -> bool:
        """Whether somebody waits for messages, and nobody sends any."""
        return not self.publishers


@dataclass(frozen=True, slots=True)
class RosGraph:
    """What there is; `more` topics are left out."""

    topics: tuple[Topic, ...]
    actions: tuple[tuple[str, str], ...] = ()
    """Names, and types as `package/Type`."""
    more: int = 0


def graph_from(data: Mapping[str, Any]) -> RosGraph:
    """The graph of what `specc_runtime.ros2.looking` found."""
    actions = tuple((name, short(types[0])) for name, types in data["actions"] if len(types) == 1)
    topics = tuple(topic for each in data["topics"] for topic in _parts(**each))
    return RosGraph(topics, actions, data["more"])


def _parts(parts: Sequence[Mapping[str, Any]] = (), **told: Any) -> Iterator[Topic]:
    """The topic, once for each of the lists of joints that its messages have, the longest first."""
    longest_first = sorted(parts, key=lambda part: -len(part["message"].get("joints", ())))
    for part in longest_first or ({},):
        yield Topic(**{**told, **part}, is_part=len(parts) > 1)


LISTENED = tuple(name.replace("/", "/msg/") for name in MESSAGES)
"""Types of the topics whose messages say something."""


class UnfitTopic(Exception):
    """Why a topic goes with no element."""


_INFRASTRUCTURE = {
    "action_msgs", "lifecycle_msgs", "rcl_interfaces", "rosgraph_msgs", "statistics_msgs",
    "tf2_msgs", "type_description_interfaces",
}  # fmt: skip
"""Packages of messages about ROS itself."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]{,98}", re.ASCII)


def is_about_ros(topic: Topic) -> bool:
    """Whether a topic is about nodes and models, and not about what robots do."""
    packages = {name.partition("/")[0] for name in topic.types}
    return bool(packages & _INFRASTRUCTURE) or topic.name.endswith("/robot_description")


def is_legal(name: str, message: str) -> bool:
    """Whether a specification can have that topic or action."""
    return not topic_fault(name) and not message_fault(message) and len(name) <= 200


def checked(topic: Topic) -> None:
    """Raises Unfit for a topic that cannot be bound, whatever its messages have."""
    if len(topic.types) != 1:
        raise UnfitTopic("its nodes do not agree on a type")
    if not is_legal(topic.name, topic.type):
        raise UnfitTopic("its name is none of ROS 2")
    if topic.type not in MESSAGES:
        raise UnfitTopic(
            "of another type: it is bound with a function under `through`, docs/ros2.md"
        )
    if not topic.commanded and not topic.count:
        raise UnfitTopic("no message came, and a run begins when each topic has had one")


_SINGLE = {"Bool": "bool", "Int64": "int", "Float64": "real", "String": "text"}
_SYMBOLS = {
    "camera": "K", "depth": "D", "image": "I", "pose": "T", "scalar": "value", "transform": "T",
    "tuple": "n", "twist": "V", "vector": "v", "wrench": "F",
}  # fmt: skip
_OF_UNITS = {METRE: "p", RADIAN / SECOND: "w", METRE / SECOND**2: "a"}
_OF_JOINTS = {"position": "q", "velocity": "dq", "effort": "tau"}
_DEPTHS = ("16UC1", "mono16", "32FC1")
_COLOURS = ("rgb8", "bgr8", "rgba8", "bgra8")
GUESSED_FRAME = "base_link"


class Frames:
    """Frames of the specification: those that messages name, and those that nobody has named."""

    def __init__(self) -> None:
        self._names = SpecNames()
        self.named: dict[str, str] = {}
        """By their names in the specification, what ROS calls them."""
        self.guessed: list[str] = []

    def of(self, topic: Topic, at: str, of: str) -> str:
        """The frame that a field of messages holds, or one of a topic whose messages name none.

        Raises Unfit for a frame that no specification can name.
        """
        if not at:
            self.guessed.append(self._names.of(f"/{of}"))
            return self.guessed[-1]
        frame = GUESSED_FRAME if topic.commanded else str(topic.message.get(at, ""))
        frame = frame.removeprefix("/")
        if frame and not _NAME.fullmatch(frame):
            raise UnfitTopic("its frame has an unusual name: bind it by hand")
        name = self._names.of(frame)
        self.named[name] = frame
        return name


def elements(topic: Topic, device: str, frames: Frames) -> dict[str, str]:
    """The types of the elements that a topic goes with, by their names. Raises Unfit."""
    checked(topic)
    if topic.type == JOINT_STATE:
        return _of_joints(topic)
    parts = [p for p in MESSAGES[topic.type] if p.sent or not topic.commanded]
    types = {_symbol(part): _type(part, topic, device, frames) for part in parts}
    found = {name: type_ for name, type_ in types.items() if type_}
    if not found:
        raise UnfitTopic(
            "its messages cannot be sent" if topic.commanded else "of another encoding"
        )
    if topic.commanded and len(found) > 1:
        raise UnfitTopic(
            "its messages have several values: name a function under `through` for all"
        )
    return {f"{name}_d" if topic.commanded else name: type_ for name, type_ in found.items()}


def _symbol(part: MessagePart) -> str:
    if part.shape == "vector3":
        return _OF_UNITS.get(part.unit, "v") if part.unit else "v"
    return _SYMBOLS[part.shape]


def _type(part: MessagePart, topic: Topic, device: str, frames: Frames) -> str:
    """The type of elements whose values are that part; empty if the message has another one."""
    unit = f", {part.unit}" if part.unit else ""
    match part.shape:
        case "scalar":
            return f"real[{part.unit}]" if part.unit else _SINGLE[scalar(topic.type)]
        case "vector":
            return f"vector[{_size(topic, 'size')}]"
        case "tuple":
            return f"vector[{_size(topic, 'size')}, int]"
        case "vector3" if part.unit == METRE and part.frame:
            return f"point[{frames.of(topic, part.frame, device)}]"
        case "vector3" | "camera":
            return f"vector[{3 if part.shape == 'vector3' else 4}{unit}]"
        case "image" | "depth":
            return _image(part, topic)
        case "twist" | "wrench":
            return f"{part.shape}[{frames.of(topic, part.frame, device)}]"
    parent = frames.of(topic, part.frame, f"{device}_origin")
    return f"pose[{parent}, {frames.of(topic, part.child, device)}]"


def _image(part: MessagePart, topic: Topic) -> str:
    if topic.commanded:
        raise UnfitTopic(_NO_SIZE)
    known = _COLOURS if part.shape == "image" else _DEPTHS
    if topic.message.get("encoding") not in known:
        return ""
    size = f"{_size(topic, 'height')}, {_size(topic, 'width')}"
    return f"image[{size}, 3]" if part.shape == "image" else f"image[{size}]"


_NO_SIZE = "nothing says how many numbers it takes"


def _size(topic: Topic, of: str) -> int:
    size = topic.message.get(of)
    if topic.commanded or not isinstance(size, int):
        raise UnfitTopic(_NO_SIZE)
    if not is_size(size):
        raise UnfitTopic("its values are too large, or empty")
    return size


# Joints, and commands to them.


def joints_of(topic: Topic) -> list[str]:
    """Joints of a topic of joint states, by their numbers if nothing else tells them apart."""
    joints = list(topic.message.get("joints", ()))
    if len({re.sub("[0-9]+", "", joint) for joint in joints}) == 1:
        joints.sort(key=lambda joint: [int(number) for number in re.findall("[0-9]+", joint)])
    return joints


def _of_joints(topic: Topic) -> dict[str, str]:
    if topic.commanded:
        raise UnfitTopic("it takes commands to joints, and no joint states tell which these are")
    joints = joints_of(topic)
    if len(joints) > 150 or len(set(joints)) < len(joints):
        raise UnfitTopic("it has more than 150 joints, or a name twice")
    if not all(map(_NAME.fullmatch, joints)):
        raise UnfitTopic("its joints have unusual names: bind it by hand")
    found: dict[str, str] = {}
    for part in MESSAGES[JOINT_STATE]:
        if topic.message.get(part.path):  # rad rather than m: it is the first
            found.setdefault(_OF_JOINTS[part.path], f"vector[{len(joints)}, {part.unit}]")
    if not joints or not found:
        raise UnfitTopic("its messages have no numbers of joints")
    return found


_COMMANDS = (("velocity", "dq_d", "rad/s"), ("effort", "tau_d", "N*m"), ("position", "q_d", "rad"))
_TO_JOINTS = (JOINT_STATE, "std_msgs/Float64MultiArray", "std_msgs/Float32MultiArray")


def arms(topics: Iterable[Topic]) -> Iterator[tuple[Topic, Topic, str, str]]:
    """Topics of joint states with those that command the same joints, as far as names tell.

    Each with the name of the command's element and its unit: of several, positions go first, and
    more joints before fewer.
    """

    def shared(one: str, other: str) -> int:
        """Levels of a namespace."""
        return common_prefix(one.split("/")[:-1], other.split("/")[:-1])

    every = [each for each in topics if len(each.types) == 1]
    states = {t.order: t for t in every if t.type == JOINT_STATE and not t.commanded and t.count}
    pairs = [
        (-shared(state.name, topic.name), -_kind(topic), topic.name, state.order)
        for state in states.values()
        for topic in every
        if topic.commanded and topic.type in _TO_JOINTS
    ]
    commands, taken = {t.name: t for t in every}, set[object]()
    for _, kind, command, state in sorted(pairs):
        if not {command, state} & taken:
            taken |= {command, state}
            _, element, unit = _COMMANDS[-kind]
            yield states[state], commands[command], element, unit


def _kind(topic: Topic) -> int:
    found = (n for n, (word, *_) in enumerate(_COMMANDS) if word in topic.name)
    return next(found, len(_COMMANDS) - 1)
