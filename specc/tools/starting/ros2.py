"""The specification of a robot by its graph of ROS 2: an agent that looks on and moves nothing.

First which topics go with elements of devices, as what; then the devices; then the text, which is
`templates/init/ros2.yaml.j2`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from specc.analysis.ros2 import ONLY_SENT
from specc.analysis.ros2_messages import (
    JOINT_STATE,
    MESSAGES,
    MessagePart,
    scalar,
    short_message_type,
)
from specc.diagnostics.nearest import common_prefix_length
from specc.diagnostics.phrases import join_some
from specc.lang import is_size
from specc.model.units import METRE, RADIAN, SECOND
from specc.schema.keys import message_fault, topic_fault
from specc.tools.importers.writing import PEERS, Commented, Data, SpecNames, fill_yaml, fold
from specc.tools.starting.document import wrap


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
        return short_message_type(self.types[0])

    @property
    def order(self) -> tuple[str, int, tuple[str, ...]]:
        """Tells topics and their parts apart, and the order in which devices are made of them."""
        joints = tuple(self.message.get("joints", ())) if self.is_part else ()
        return self.name, -len(joints), joints

    @property
    def is_about_ros(self) -> bool:
        """Whether it is about nodes and models, and not about what robots do."""
        packages = {name.partition("/")[0] for name in self.types}
        return bool(packages & _INFRASTRUCTURE) or self.name.endswith("/robot_description")

    @property
    def commanded(self) -> bool:
        """Whether somebody waits for messages, and nobody sends any."""
        return not self.publishers

    @property
    def is_silent(self) -> bool:
        """Whether somebody may send messages, and none came."""
        return not (self.commanded or self.count)


@dataclass(frozen=True, slots=True)
class RosGraph:
    """What there is; `more` topics are left out."""

    topics: tuple[Topic, ...]
    actions: tuple[tuple[str, str], ...] = ()
    """Names, and types as `package/Type`."""
    more: int = 0


def graph_from(data: Mapping[str, Any]) -> RosGraph:
    """The graph of what `specc_runtime.ros2.looking` found.

    A topic comes once for each of the lists of joints that its messages have, the longest first.
    """
    topics = []
    for each in data["topics"]:
        parts: Sequence[Mapping[str, Any]] = each.get("parts", ())
        for part in sorted(parts, key=lambda p: -len(p["message"].get("joints", ()))) or ({},):
            fields = {k: v for k, v in each.items() if k != "parts"}
            topics.append(Topic(**{**fields, **part}, is_part=len(parts) > 1))
    actions = tuple(
        (name, short_message_type(types[0])) for name, types in data["actions"] if len(types) == 1
    )
    return RosGraph(tuple(topics), actions, data["more"])


_READ = {
    name: parts
    for name, parts in MESSAGES.items()
    if any(part.shape not in ONLY_SENT for part in parts)
}
LISTENED = tuple(name.replace("/", "/msg/") for name in _READ)
"""Types of the topics whose messages say something."""


class UnfitTopic(Exception):
    """Why a topic goes with no element."""


_INFRASTRUCTURE = {
    "action_msgs", "lifecycle_msgs", "rcl_interfaces", "rosgraph_msgs", "statistics_msgs",
    "tf2_msgs", "type_description_interfaces",
}  # fmt: skip
"""Packages of messages about ROS itself."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]{,98}", re.ASCII)


def is_legal(name: str, message: str) -> bool:
    """Whether a specification can have that topic or action."""
    return not topic_fault(name) and not message_fault(message) and len(name) <= 200


def check_topic(topic: Topic) -> None:
    """Raises UnfitTopic for a topic that cannot be bound, whatever its messages have."""
    if len(topic.types) != 1:
        raise UnfitTopic("its nodes do not agree on a type")
    if not is_legal(topic.name, topic.type):
        raise UnfitTopic("its name is none of ROS 2")
    if topic.type not in _READ:
        raise UnfitTopic(
            "of another type: it is bound with a function under `through`, docs/ros2.md"
        )
    is_simple = all(part.shape in ("arrival", "scalar") for part in MESSAGES[topic.type])
    if topic.is_silent and not is_simple:
        raise UnfitTopic("no message came: bind it with its size and an `init:`, docs/ros2.md")


_SINGLE = {"Bool": "bool", "Int64": "int", "Float64": "real", "String": "text"}
_SYMBOLS = {
    "arrival": "came", "camera": "K", "depth": "D", "image": "I", "pose": "T", "scalar": "value",
    "transform": "T", "tuple": "n", "twist": "V", "vector": "v", "wrench": "F",
}  # fmt: skip
_OF_UNITS = {METRE: "p", RADIAN / SECOND: "w", METRE / SECOND**2: "a"}
_OF_JOINTS = {"position": "q", "velocity": "dq", "effort": "tau"}
_ENCODINGS = {
    "image": ("rgb8", "bgr8", "rgba8", "bgra8"),
    "depth": ("16UC1", "mono16", "32FC1"),
}
GUESSED_FRAME = "base_link"


class Frames:
    """Frames of the specification: those that messages name, and guesses for the others."""

    def __init__(self) -> None:
        self._names = SpecNames()
        self.named: dict[str, str] = {}
        """Name in the specification -> name in ROS."""
        self.guessed: list[str] = []

    def of(self, topic: Topic, at: str, of: str) -> str:
        """The frame that a field of messages holds, or one of a topic whose messages name none.

        Raises UnfitTopic for a frame that no specification can name.
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
    """The types of the elements that a topic goes with, by their names. Raises UnfitTopic."""
    check_topic(topic)
    if topic.type == JOINT_STATE:
        return _of_joints(topic)
    parts = [p for p in MESSAGES[topic.type] if p.sent or not topic.commanded]
    found: dict[str, str] = {}
    for part in parts:
        if type_ := _type(part, topic, device, frames):
            of_unit = _OF_UNITS.get(part.unit, "v") if part.unit else "v"
            type_ = f"optional[{type_}]" if topic.is_silent else type_
            found[of_unit if part.shape == "vector3" else _SYMBOLS[part.shape]] = type_
    if not found:
        raise UnfitTopic(
            "its messages cannot be sent" if topic.commanded else "of another encoding"
        )
    if topic.commanded and len(found) > 1:
        raise UnfitTopic(
            "its messages have several values: name a function under `through` for all"
        )
    return {f"{name}_d" if topic.commanded else name: type_ for name, type_ in found.items()}


def _type(part: MessagePart, topic: Topic, device: str, frames: Frames) -> str:
    """The type of elements whose values are that part; empty if the message has another one."""
    unit = f", {part.unit}" if part.unit else ""
    match part.shape:
        case "scalar":
            return f"real[{part.unit}]" if part.unit else _SINGLE[scalar(topic.type)]
        case "arrival":
            return "bool"
        case "vector":
            return f"vector[{_size(topic, 'size')}]"
        case "tuple":
            return f"vector[{_size(topic, 'size')}, int]"
        case "vector3" if part.unit == METRE and part.frame:
            return f"point[{frames.of(topic, part.frame, device)}]"
        case "vector3" | "camera":
            return f"vector[{3 if part.shape == 'vector3' else 4}{unit}]"
        case "image" | "depth":
            if topic.commanded:
                raise UnfitTopic(_NO_SIZE)
            if topic.message.get("encoding") not in _ENCODINGS[part.shape]:
                return ""
            size = f"{_size(topic, 'height')}, {_size(topic, 'width')}"
            return f"image[{size}, 3]" if part.shape == "image" else f"image[{size}]"
        case "twist" | "wrench":
            return f"{part.shape}[{frames.of(topic, part.frame, device)}]"
    parent = frames.of(topic, part.frame, f"{device}_origin")
    return f"pose[{parent}, {frames.of(topic, part.child, device)}]"


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
    valid = [each for each in topics if len(each.types) == 1]
    states = {t.order: t for t in valid if t.type == JOINT_STATE and not t.commanded and t.count}
    commands = {t.name: t for t in valid if t.commanded and t.type in _TO_JOINTS}
    pairs = []
    for state in states.values():
        for name in commands:
            levels = common_prefix_length(state.name.split("/")[:-1], name.split("/")[:-1])
            kinds = [n for n, (word, *_) in enumerate(_COMMANDS) if word in name]
            kind = kinds[0] if kinds else len(_COMMANDS) - 1
            pairs.append((-levels, -kind, name, state.order))
    paired = set[object]()
    for _, kind, name, order in sorted(pairs):
        if not {name, order} & paired:
            paired |= {name, order}
            _, element, unit = _COMMANDS[-kind]
            yield states[order], commands[name], element, unit


# Devices.


LOOKED_S = 5
_OFTEN_HZ, _SEEN_HZ, _DECIDED_HZ = 50, 10, 10
_MOST_DEVICES = 100
_GAPS = 5
"""Periods of the sender or of the reader without a message that are no fault."""
_MOST_AGE_S = 1.0
"""The greatest age of a message on arrival; older stamps come from another clock."""
_FEWEST = 3
"""The fewest messages that give a rate."""


@dataclass(eq=False, slots=True)
class ProposedDevice:
    """A real effector or receptor: the types of its elements, and their bindings."""

    name: str
    title: str
    acts: bool
    rate_hz: int = _OFTEN_HZ
    commands: dict[str, Data] = field(default_factory=dict)
    reports: dict[str, Data] = field(default_factory=dict)
    bind: dict[str, Data] = field(default_factory=dict)
    oldest_s: dict[str, float] = field(default_factory=dict)
    """Report -> its greatest age before the next one comes, where that is known."""

    def limited(self, periods: int) -> dict[str, Data]:
        """What it reports, with a `max_age` so many of its periods after it was sampled."""
        found: dict[str, Data] = {}
        for name, type_ in self.reports.items():
            oldest_s = self.oldest_s.get(name)
            limit_ms = _round_ms(oldest_s + periods / self.rate_hz) if oldest_s else 0
            limited: Data = {"type": type_, "max_age": _duration(limit_ms)}
            found[name] = limited if limit_ms else type_
        return found


class Devices:
    """The devices of a graph; `left_out` lists topics and actions without one, by reasons."""

    def __init__(self, graph: RosGraph) -> None:
        self.graph = graph
        self.every: list[ProposedDevice] = []
        self.left_out: dict[str, list[str]] = {}
        self.frames = Frames()
        self.is_simulated = any(t.name == "/clock" and t.publishers for t in graph.topics)
        self._names = SpecNames(PEERS)
        self._cameras: dict[str, ProposedDevice] = {}
        self._commanded_joints = set[str]()
        topics = {t.order: t for t in self._without_subsets(graph.topics) if not t.is_about_ros}
        for state, command, element, unit in arms(topics.values()):
            for used in self._add_arm(state, command, element, unit):
                del topics[used.order]
        for topic in topics.values():
            if topic.publishers or topic.readers:
                self._add_topic(topic)
        for name, type_ in graph.actions:
            self._add_action(name, type_)

    def _without_subsets(self, topics: Iterable[Topic]) -> Iterator[Topic]:
        """The topics, without those whose joints also come with a larger message."""
        read: dict[str, set[str]] = {}
        for topic in topics:
            joints = set(topic.order[-1])
            if joints & read.setdefault(topic.name, set()):
                unfit = UnfitTopic("its joints also come in other messages")
                self._leave_out(unfit, topic.name, topic.types[0], _endpoints(topic))
            else:
                read[topic.name] |= joints
                yield topic

    def _add(self, wish: str, title: str, *, acts: bool) -> ProposedDevice:
        """Raises UnfitTopic if the specification has the most devices that it may have."""
        if len(self.every) >= _MOST_DEVICES:
            raise UnfitTopic(f"there are {_MOST_DEVICES} devices already")
        self.every.append(ProposedDevice(self._names.new(wish), title, acts))
        return self.every[-1]

    def _add_arm(self, state: Topic, command: Topic, element: str, unit: str) -> tuple[Topic, ...]:
        """A device for joint states and their commands, unless another arm moves those joints.

        Returns:
            The topics that nothing else is to be made of.
        """
        space = state.name.rpartition("/")[0]
        space = space if f"{command.name}/".startswith(f"{space}/") else ""
        try:
            found = elements(state, "", self.frames)
            check_topic(command)
            joints = joints_of(state)
            if not self._commanded_joints.isdisjoint(joints):
                unfit = UnfitTopic(
                    "which joints it moves is not known: others command some of the nearest"
                )
                self._leave_out(unfit, command.name, command.types[0], _endpoints(command))
                return (command,)
            device = self._add(f"{space}/arm", "Passes on commands to joints", acts=True)
        except UnfitTopic:
            return ()
        self._commanded_joints.update(joints)
        device.reports.update(found)
        self._bind_reports(device, state, found)
        device.commands[element] = f"vector[{len(joints)}, {unit}]"
        named: dict[str, Data] = {"joints": joints} if command.type == JOINT_STATE else {}
        guess = f"A guess: in {unit}, of {', '.join(joints)}, in this order."
        device.bind[element] = _binding(command, named, (_endpoints(command), guess))
        return state, command

    def _add_topic(self, topic: Topic) -> None:
        """A device for a topic; images and camera information of one camera share a device."""
        space = topic.name.rpartition("/")[0]
        camera = space if topic.type in _CAMERAS else ""
        try:
            wish = topic.name.strip("/").replace("/", "_")
            found = elements(topic, wish, self.frames)
            device = self._cameras.get(camera)
            if device is None or device.reports.keys() & found:
                title = f"{topic.type} on {topic.name}"
                joints = topic.order[-1]
                name = "".join(joints) if len(joints) == 1 else camera or topic.name
                device = self._add(name, title, acts=topic.commanded)
        except UnfitTopic as unfit:
            self._leave_out(unfit, topic.name, topic.types[0], _endpoints(topic))
            return
        if camera:
            device.rate_hz, self._cameras[camera] = _SEEN_HZ, device
        if topic.commanded:
            device.commands.update(found)
            qos = _LATCHED if topic.read_kept else {}
            is_placed = any(GUESSED_FRAME in text for text in found.values())
            guess = f"A guess: in {GUESSED_FRAME}." if is_placed else ""
            device.bind.update({n: _binding(topic, qos, (_endpoints(topic), guess)) for n in found})
        else:
            device.reports.update(found)
            self._bind_reports(device, topic, found)

    def _add_action(self, name: str, type_: str) -> None:
        try:
            if not is_legal(name, type_):
                raise UnfitTopic("its name is none of ROS 2")
            device = self._add(name, f"Action {name}", acts=True)
        except UnfitTopic as unfit:
            self._leave_out(unfit, name, type_, "An action.")
            return
        device.reports["status"] = "text"
        remark = "Its goal, feedback and result are bound alike, as docs/ros2.md says."
        bind: dict[str, Data] = {"action": name, "type": type_, "part": "status"}
        device.bind["status"] = Commented(bind, (remark,))

    def _leave_out(self, why: UnfitTopic, name: str, type_: str, remark: str) -> None:
        shown = f"{_sanitized(name)} ({_sanitized(type_)}). {remark}"
        self.left_out.setdefault(str(why), []).append(shown)

    def _bind_reports(self, device: ProposedDevice, topic: Topic, found: Mapping[str, str]) -> None:
        """Bind the elements of a device to a topic."""
        more: dict[str, Data] = {}
        if topic.type == JOINT_STATE:
            more["joints"] = joints_of(topic)
        is_measured = topic.count >= _FEWEST and not topic.published_kept and not self.is_simulated
        # A time without a message that is no fault of a sender as it was.
        gap_s = max(_GAPS * topic.mean_s, 2 * topic.longest_s, _GAPS / device.rate_hz)
        # A period that was measured is a little longer or shorter.
        gap_ms = _round_ms(0.95 * gap_s) if is_measured and topic.mean_s > 0 else 0
        if gap_ms:
            more["max_gap"] = _duration(gap_ms)
            age_s = topic.message.get("age_s", 0.0)
            if isinstance(age_s, float) and abs(age_s) < _MOST_AGE_S:
                device.oldest_s |= dict.fromkeys(found, gap_ms / 1e3 + 2 * max(0.0, age_s))
        more |= _LATCHED if topic.published_kept else {}
        rate = f"{1 / topic.mean_s:.3g} Hz were measured." if "max_gap" in more else ""
        turn = "A guess: joints turn, so that rad is right." if topic.type == JOINT_STATE else ""
        came = "No message came: `None` until one does." if topic.is_silent else rate
        for name in found:
            device.bind[name] = _binding(topic, more, (f"{_endpoints(topic)} {came}".strip(), turn))


_CAMERAS = ("sensor_msgs/Image", "sensor_msgs/CameraInfo")
_LATCHED: dict[str, Data] = {"qos": {"durability": "transient_local"}}
_MOST_SHOWN = 3


def _binding(topic: Topic, more: Mapping[str, Data], notes: Sequence[str]) -> Data:
    lines = [line for note in notes for line in wrap(note, 4)]
    return Commented({"topic": topic.name, "type": topic.type, **more}, lines)


def _round_ms(time_s: float) -> int:
    """A time rounded up to 1, 2 or 5 times a power of ten; 0 if it is 0 or too long."""
    steps = (digit * 10**power for power in range(6) for digit in (1, 2, 5))
    return next((ms for ms in steps if ms >= 1e3 * time_s), 0) if time_s > 0 else 0


def _duration(time_ms: int) -> str:
    return f"{time_ms} ms" if time_ms < 1000 else f"{time_ms // 1000} s"


def _endpoints(topic: Topic) -> str:
    """The nodes at the other end of a topic, and its joints."""
    ends = topic.readers if topic.commanded else topic.publishers
    by = join_some(list(map(_sanitized, ends)), _MOST_SHOWN)
    text = f"{'Read' if topic.commanded else 'Published'} by {by}."
    joints = join_some(list(map(_sanitized, topic.order[-1])), _MOST_SHOWN)
    return f"{text} Joints of one message: {joints}." if joints else text


def _sanitized(text: str) -> str:
    """A foreign name with `?` for characters that names do not have."""
    return re.sub(r"[^\w./~-]", "?", text, flags=re.ASCII)[:80]


# The text.


def proposal(devices: Devices, system: str, agent: str, command: str, python: str = "") -> str:
    """The text of a specification, in the canonical layout.

    `python` is that of ROS; empty for the usual one.
    """
    every = devices.every
    frames, named = _frames(devices), devices.frames.named
    present = [f"present(x.{each.name}.{name})" for each in every for name in each.reports]
    parts = {
        "head": [line for remark in _remarks(devices, command) for line in wrap(remark, 4)],
        "system": system,
        "agent": agent,
        "frames": frames,
        "acting": [each for each in every if each.acts],
        "sensing": [each for each in every if not each.acts],
        "reporting": [each for each in every if each.reports],
        "commanded": [each for each in every if each.commands],
        "looked_s": LOOKED_S,
        "decided_hz": _DECIDED_HZ,
        "seen": " and ".join((f"elapsed >= {LOOKED_S}[s]", *present)),
        "python": python,
        "use_sim_time": devices.is_simulated,
        "named_frames": {name: named[name] for name in frames if name in named},
        "bind": {
            f"{agent}.{'E' if each.acts else 'R'}.{each.name}.{name}": how
            for each in every
            for name, how in each.bind.items()
        },
    }
    return fill_yaml("init/ros2.yaml.j2", parts, fold)


def _frames(devices: Devices) -> dict[str, Data]:
    """Frames that elements have, with what they are."""
    types = [text for d in devices.every for text in (*d.reports.values(), *d.commands.values())]
    used = {word for text in types for word in re.findall(r"\w+", str(text))}
    named = {
        name: f"`{frame}` in ROS" if frame else "messages name none"
        for name, frame in devices.frames.named.items()
    }
    every = {**named, **dict.fromkeys(devices.frames.guessed, "messages do not name it")}
    return {name: title for name, title in every.items() if name in used}


def _remarks(devices: Devices, command: str) -> Iterator[str]:
    yield f"Made by `{command}`. What ROS does not say is called a guess."
    if any(each.commands for each in devices.every):
        yield (
            "Nothing is sent until the control subsystem writes commands: W0413 of `specc validate`"
            " asks for that. They are passed on as they are: bound their speed first, as "
            "docs/ros2.md does."
        )
    if devices.is_simulated:
        yield "Time is that of /clock."
    graph = devices.graph
    if any("tf2_msgs/msg/TFMessage" in topic.types for topic in graph.topics):
        yield "There is tf: an element `pose[A, B]` may be bound as {tf: {from: A, to: B}}."
    if graph.more:
        yield f"There are {graph.more} more topics; the first {len(graph.topics)} were looked at."
    for why, names in devices.left_out.items():
        yield f"Left out: {why}."
        yield from (f"- {name}" for name in names)
