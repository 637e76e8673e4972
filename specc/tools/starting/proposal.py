"""The specification of a robot by its graph of ROS 2: an agent that looks on and moves nothing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from specc.analysis.ros2 import JOINT_STATE
from specc.diagnostics.phrases import join_some
from specc.tools.importers.writing import PEERS, Data, Noted, SpecNames, filled
from specc.tools.starting.channels import qualified
from specc.tools.starting.document import wrapped, written
from specc.tools.starting.graph import (
    GUESSED_FRAME,
    Frames,
    RosGraph,
    Topic,
    UnfitTopic,
    arms,
    checked,
    elements,
    is_about_ros,
    is_legal,
    joints_of,
)

LOOKED_S = 5
_OFTEN_HZ, _SEEN_HZ, _DECIDED_HZ = 50, 10, 10
_MOST_DEVICES = 100
_GAPS = 5
"""How many periods, of the sender or of the reader, there may be no message."""
_MOST_AGE_S = 1.0
"""Of a message when it comes: what is older has been stamped by another clock."""
_FEWEST = 3
"""Messages by which a rate is known."""


@dataclass(eq=False, slots=True)
class ProposedDevice:
    """A real effector or receptor: the types of its elements, and what is behind them."""

    name: str
    title: str
    acts: bool
    rate_hz: int = _OFTEN_HZ
    commands: dict[str, Data] = field(default_factory=dict)
    reports: dict[str, Data] = field(default_factory=dict)
    bind: dict[str, Data] = field(default_factory=dict)
    oldest_s: dict[str, float] = field(default_factory=dict)
    """By reports: the age of a value before the next one comes, where that is known."""

    def limited(self, periods: int) -> dict[str, Data]:
        """What it reports, with a `max_age` so many of its periods after it was sampled."""
        found: dict[str, Data] = {}
        for name, type_ in self.reports.items():
            oldest_s = self.oldest_s.get(name)
            limit_ms = _round_ms(oldest_s + periods / self.rate_hz) if oldest_s else 0
            found[name] = (
                {"type": type_, "max_age": _duration_text(limit_ms)} if limit_ms else type_
            )
        return found

    @property
    def side(self) -> str:
        """Of the agent, in names of elements."""
        return "E" if self.acts else "R"


class Devices:
    """The devices of a graph, and what of it is `left_out`, by the reasons."""

    def __init__(self, graph: RosGraph) -> None:
        self.graph = graph
        self.every: list[ProposedDevice] = []
        self.left_out: dict[str, list[str]] = {}
        self.frames = Frames()
        self.is_simulated = any(t.name == "/clock" and t.publishers for t in graph.topics)
        self._names = SpecNames(PEERS)
        self._cameras: dict[str, ProposedDevice] = {}
        self._commanded_joints = set[str]()
        topics = {t.order: t for t in self._apart(graph.topics) if not is_about_ros(t)}
        for state, command, element, unit in arms(topics.values()):
            for done in self._arm(state, command, element, unit):
                del topics[done.order]
        for topic in topics.values():
            if topic.publishers or topic.readers:
                self._single(topic)
        for name, type_ in graph.actions:
            self._action(name, type_)

    def _apart(self, topics: Iterable[Topic]) -> Iterator[Topic]:
        """The topics, without parts whose joints are those of a larger part, too."""
        read: dict[str, set[str]] = {}
        for topic in topics:
            joints = set(topic.order[-1])
            if joints & read.setdefault(topic.name, set()):
                unfit = UnfitTopic("its joints also come in other messages")
                self._leave_out(unfit, topic.name, topic.types[0], _ends(topic))
            else:
                read[topic.name] |= joints
                yield topic

    def _new(self, wish: str, title: str, *, acts: bool) -> ProposedDevice:
        """Raises Unfit if there are as many as a specification may have."""
        if len(self.every) >= _MOST_DEVICES:
            raise UnfitTopic(f"there are {_MOST_DEVICES} devices already")
        self.every.append(ProposedDevice(self._names.new(wish), title, acts))
        return self.every[-1]

    def _arm(self, state: Topic, command: Topic, element: str, unit: str) -> tuple[Topic, ...]:
        """A device for joint states and their commands, unless another arm moves those joints.

        Returns:
            The topics that nothing else is to be made of.
        """
        space = state.name.rpartition("/")[0]
        space = space if f"{command.name}/".startswith(f"{space}/") else ""
        try:
            found = elements(state, "", self.frames)
            checked(command)
            joints = joints_of(state)
            if not self._commanded_joints.isdisjoint(joints):
                unfit = UnfitTopic(
                    "which joints it moves is not known: others command some of the nearest"
                )
                self._leave_out(unfit, command.name, command.types[0], _ends(command))
                return (command,)
            device = self._new(f"{space}/arm", "Passes on commands to joints", acts=True)
        except UnfitTopic:
            return ()
        self._commanded_joints.update(joints)
        device.reports.update(found)
        self._read(device, state, found)
        device.commands[element] = f"vector[{len(joints)}, {unit}]"
        named: dict[str, Data] = {"joints": joints} if command.type == JOINT_STATE else {}
        guess = f"A guess: in {unit}, of {', '.join(joints)}, in this order."
        device.bind[element] = _bound(command, named, (_ends(command), guess))
        return state, command

    def _single(self, topic: Topic) -> None:
        """A device for a topic; an image and what its camera says of it are of one."""
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
                device = self._new(name, title, acts=topic.commanded)
        except UnfitTopic as unfit:
            self._leave_out(unfit, topic.name, topic.types[0], _ends(topic))
            return
        if camera:
            device.rate_hz, self._cameras[camera] = _SEEN_HZ, device
        if topic.commanded:
            device.commands.update(found)
            kept = _kept(topic.read_kept)
            is_placed = any(GUESSED_FRAME in text for text in found.values())
            guess = f"A guess: in {GUESSED_FRAME}." if is_placed else ""
            device.bind.update({n: _bound(topic, kept, (_ends(topic), guess)) for n in found})
        else:
            device.reports.update(found)
            self._read(device, topic, found)

    def _action(self, name: str, type_: str) -> None:
        try:
            if not is_legal(name, type_):
                raise UnfitTopic("its name is none of ROS 2")
            device = self._new(name, f"Action {name}", acts=True)
        except UnfitTopic as unfit:
            self._leave_out(unfit, name, type_, "An action.")
            return
        device.reports["status"] = "text"
        told = ("Its goal, feedback and result are bound alike, each by a function of `through`.",)
        bind: dict[str, Data] = {"action": name, "type": type_, "part": "status"}
        device.bind["status"] = Noted(bind, told)

    def _leave_out(self, why: UnfitTopic, name: str, type_: str, said: str) -> None:
        shown = f"{_shown(name)} ({_shown(type_)}). {said}"
        self.left_out.setdefault(str(why), []).append(shown)

    def _read(self, device: ProposedDevice, topic: Topic, found: Mapping[str, str]) -> None:
        """Bind elements to what a topic has."""
        more: dict[str, Data] = {}
        if topic.type == JOINT_STATE:
            more["joints"] = joints_of(topic)
        is_measured = topic.count >= _FEWEST and not topic.published_kept and not self.is_simulated
        # A period that was measured is a little longer or shorter.
        gap_ms = _round_ms(0.95 * _gap_s(topic, device.rate_hz)) if is_measured else 0
        if gap_ms:
            more["max_gap"] = _duration_text(gap_ms)
            age_s = topic.message.get("age_s", 0.0)
            if isinstance(age_s, float) and abs(age_s) < _MOST_AGE_S:
                device.oldest_s |= dict.fromkeys(found, gap_ms / 1e3 + 2 * max(0.0, age_s))
        more |= _kept(topic.published_kept)
        rate = f"{1 / topic.mean_s:.3g} Hz were measured." if "max_gap" in more else ""
        turn = "A guess: joints turn, so that rad is right." if topic.type == JOINT_STATE else ""
        for name in found:
            device.bind[name] = _bound(topic, more, (f"{_ends(topic)} {rate}".strip(), turn))


_CAMERAS = ("sensor_msgs/Image", "sensor_msgs/CameraInfo")


def _bound(topic: Topic, more: Mapping[str, Data], notes: Sequence[str]) -> Data:
    lines = [line for note in notes for line in wrapped(note)]
    return Noted({"topic": topic.name, "type": topic.type, **more}, tuple(lines))


def _kept(asked: bool) -> dict[str, Data]:
    return {"qos": {"durability": "transient_local"}} if asked else {}


def _gap_s(topic: Topic, rate_hz: int) -> float:
    """A time without a message that is no fault of a sender as it was; 0 if none is known."""
    least_s = max(_GAPS * topic.mean_s, 2 * topic.longest_s, _GAPS / rate_hz)
    return least_s if topic.mean_s > 0 else 0.0


def _round_ms(time_s: float) -> int:
    """1, 2 or 5 times a power of ten, not less than a time; 0 for none and for what is too long."""
    steps = (digit * 10**power for power in range(6) for digit in (1, 2, 5))
    return next((ms for ms in steps if ms >= 1e3 * time_s), 0) if time_s > 0 else 0


def _duration_text(time_ms: int) -> str:
    return f"{time_ms} ms" if time_ms < 1000 else f"{time_ms // 1000} s"


_MOST_SHOWN = 3


def _ends(topic: Topic) -> str:
    """Who is at the ends of a topic."""
    ends = topic.readers if topic.commanded else topic.publishers
    by = join_some(list(map(_shown, ends)), _MOST_SHOWN)
    said = f"{'Read' if topic.commanded else 'Published'} by {by}."
    joints = join_some(list(map(_shown, topic.order[-1])), _MOST_SHOWN)
    return f"{said} Joints of one message: {joints}." if joints else said


def _shown(text: str) -> str:
    """A name of somebody else, without what is not in names: it says nothing to specc."""
    return re.sub(r"[^\w./~-]", "?", text, flags=re.ASCII)[:80]


# The text.


def proposal(devices: Devices, system: str, agent: str, command: str, python: str = "") -> str:
    """The text of a specification, in the canonical layout.

    `python` is that of ROS; empty for the usual one.
    """
    bind = {
        name: how
        for each in devices.every
        for name, how in qualified(f"{agent}.{each.side}.{each.name}", each.bind).items()
    }
    frames, named = _frames(devices), devices.frames.named
    ros2: dict[str, Data] = {
        "node": agent,
        "python": python,
        "wait": "5 s",
        "use_sim_time": devices.is_simulated,
        "frames": {name: named[name] for name in frames if name in named},
    }
    data: dict[str, Data] = {
        "specc": "1.2",
        "system": system,
        "title": "Looks at a robot behind ROS 2",
        "frames": frames,
        "agents": {agent: _agent(devices.every)},
        "plant": {"ros2": filled(ros2), "bind": bind},
        "task": {"cycle": {"of": f"{agent}.c", "from": "look", "to": "look"}},
    }
    return written(_remarks(devices, command), data)


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


def _agent(devices: Sequence[ProposedDevice]) -> Data:
    acting = [each for each in devices if each.acts]
    sensing = [each for each in devices if not each.acts]
    return filled(
        {
            "real_effectors": {d.name: filled({"x": d.commands, "y": d.reports}) for d in acting},
            "real_receptors": {d.name: {"y": d.reports} for d in sensing},
            "virtual_effectors": {
                d.name: _moving(d) if d.commands else _passing(d) for d in acting
            },
            "virtual_receptors": {d.name: _passing(d) for d in sensing},
            "control": _control(devices),
        }
    )


def _passing(device: ProposedDevice) -> Data:
    return {"title": device.title, "rate": f"{device.rate_hz} Hz", "through": "identity"}


def _moving(device: ProposedDevice) -> Data:
    """A virtual effector that sends nothing before the first command, and then the last one."""
    report: dict[str, Data] = {f"y.c.{name}": f"x.E.{name}" for name in device.reports}
    wait: list[Data] = ["report"] if report else []
    (commanded,) = device.commands
    data: dict[str, Data] = {
        "title": device.title,
        "rate": f"{device.rate_hz} Hz",
        "x": filled({"c": device.commands, "E": device.limited(1)}),
        "y": filled({"c": device.reports, "E": device.commands}),
        "conditions": {"terminal": {"commanded": f"present(x.c.{commanded})"}},
        "functions": filled(
            {"report": report, "command": {f"y.E.{commanded}": f"x.c.{commanded}"}}
        ),
        "behaviours": {
            "wait": filled({"functions": wait, "terminal": "commanded"}),
            "follow": {"functions": [*wait, "command"], "terminal": "never"},
        },
        "states": {"wait": "wait", "follow": "follow"},
        "initial_state": "wait",
        "transitions": [["wait", "terminal", "always", "follow"]],
    }
    return data


def _control(devices: Sequence[ProposedDevice]) -> Data:
    x: dict[str, Data] = {each.name: each.limited(3) for each in devices if each.reports}
    y: dict[str, Data] = {each.name: each.commands for each in devices if each.commands}
    there = [f"present(x.{each.name}.{name})" for each in devices for name in each.reports]
    note = ("Write these in a function of a behaviour.",)
    data: dict[str, Data] = {
        "title": f"Looks on until all have reported, {LOOKED_S} s at least",
        "rate": f"{_DECIDED_HZ} Hz",
        "x": x,
        "y": Noted(y, note) if y else y,
        "conditions": {"terminal": {"seen": " and ".join((f"elapsed >= {LOOKED_S}[s]", *there))}},
        "behaviours": {"look": {"terminal": "seen"}},
        "states": {"look": "look"},
        "initial_state": "look",
        "transitions": [["look", "terminal", "always", "look"]],
    }
    return filled(data)
