"""What the elements of a system get of a bag: the newest of their topics at each time.

Messages are converted as a node would have told them: joints are joined, stamps are times of
measurement, transforms those of a tree.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain
from math import isfinite
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.options import UsageError
from specc_runtime.plants.errors import PlantError
from specc_runtime.printing import visible
from specc_runtime.recording.budget import Unusable
from specc_runtime.ros2.bags.comparing import Commands
from specc_runtime.ros2.bags.names import TopicNames
from specc_runtime.ros2.bags.reading import Bag, BagMessage, BagTopic
from specc_runtime.ros2.bags.transforms import TOPICS, TransformTree
from specc_runtime.ros2.bags.types import TEXT, NoMessage, Types, data_of, whole_type
from specc_runtime.ros2.binding import CHANGES, CLOCK, Ros2Topic
from specc_runtime.ros2.host.joints import JointNumbers
from specc_runtime.ros2.host.stamps import measured_at
from specc_runtime.ros2.plant import is_given_back
from specc_runtime.system import PlantSpec

LONGEST_GAP_S = 3600.0
"""How long a bag may have nothing: more is a clock that is wrong."""
EARLY_S = 1e-6
"""Times of a bag are those of ticks up to rounding."""
_MOST_NAMED = 12
_CLOCK, _TRANSFORM = "rosgraph_msgs/msg/Clock", "geometry_msgs/msg/TransformStamped"
Make = Callable[[], Any]


@dataclass(frozen=True, slots=True)
class News:
    """What an element has reported: `make` gives the data of its value, or raises why not."""

    make: Make
    measured_s: float


class Readings:
    """The news of elements, by their names, at times of the bag.

    `begin_s` is when the recorded run of these `subsystems` began, if the bag has its changes, or
    else the first moment at which all that is awaited has had a message.
    """

    def __init__(
        self, spec: PlantSpec, names: TopicNames, file: Path, subsystems: Collection[str] = ()
    ) -> None:
        """Reads the bag until that moment.

        Raises UsageError for a bag that cannot be read, or that lacks what is awaited.
        """
        ros2 = spec.ros2
        assert ros2 is not None, "the caller knows that it is behind ROS 2"
        read = {item.sensor for item in spec.inputs}
        self._sensors = {sensor.name: sensor for sensor in spec.sensors if sensor.name in read}
        initialized = {name for name, sensor in self._sensors.items() if sensor.initial}
        self._names = names
        self._types = Types()
        self._types_of: dict[str, Types] = {}
        """By types: those of the distribution that has recorded them."""
        self._topics = {t.name: t for t in ros2.topics if t.name in read and not is_given_back(t)}
        self._readers: dict[str, list[Ros2Topic]] = {}
        for topic in self._topics.values():
            self._readers.setdefault(names.of_element(topic.name), []).append(topic)
            if not topic.interface and not topic.between:
                self._readers.setdefault(names.full(topic.topic), []).append(topic)
        commanded = {names.full(t.topic): t for t in ros2.topics if t.commanded and not t.interface}
        self.commands = Commands(commanded, self._types)
        self._between = [topic for topic in self._topics.values() if topic.between]
        wanted = {*self._readers, *commanded, *(TOPICS if self._between else ())}
        self._is_simulated = ros2.use_sim_time
        self._awaited = {t.name for t in self._topics.values() if not t.interface} - initialized
        self._changes = names.full(CHANGES.topic)
        wanted.add(self._changes)
        self._wanted = {*wanted, *([CLOCK] if self._is_simulated else ())}
        self._subsystems = subsystems
        try:
            self._rewind(file)
            self.begin_s = self._find_begin()
        except Unusable as error:
            raise UsageError(f"--bag: {error}") from error

    def _rewind(self, file: Path) -> None:
        """Be before the first message of the bag; raises Unusable."""
        self._at_s = self._passed_s = 0.0
        self._newest_ns = self._late = self._latest_ns = 0
        """Messages too far behind those of later times to be put in order, and how far."""
        self._clock_s: float | None = None
        self._restart()
        self.commands.restart()
        self._bag = Bag(file)
        self._coming = self._bag.messages(self._wanted)
        self._next: BagMessage | None = None

    def _restart(self) -> None:
        """Know nothing of what the bag has told."""
        self._missing = set(self._awaited)
        self._news: dict[str, News] = {}
        self._transforms = TransformTree()
        self._stamps: dict[str, float] = {}
        self.changes: list[dict[str, Any]] = []
        """Of constants and of the panel, as they come."""
        of_joints = (t for t in self._topics.values() if t.joints and not t.interface)
        self._joints = {topic.name: self._join_of(topic) for topic in of_joints}

    def _join_of(self, topic: Ros2Topic) -> JointNumbers:
        sensor = self._sensors[topic.name]
        how = topic.topic, topic.joints, topic.path, sensor.max_gap_s
        return JointNumbers(*how, is_answered=bool(sensor.on_loss))

    def _find_begin(self) -> float:
        told_ns = self._told_begin_ns()
        is_any = told_ns is not None
        while self._missing or not is_any:
            message = next(self._coming, None)
            if message is None:
                raise UsageError(f"--bag: {self._bag.path} {self._lacks()}")
            self._take(message)
            is_any = True
        if told_ns is None and not self._awaited:
            told_ns = next(message.time_ns for message in Bag(self._bag.path).messages(None))
        if told_ns is None:
            begin_s = self._at_s
            self._next = next(self._coming, None)
        else:
            self._rewind(self._bag.path)
            begin_s = self._go_to(told_ns)
        self.commands.begin(begin_s - EARLY_S)
        self.changes.clear()
        for topic in self._topics.values():
            if topic.is_call or topic.part == "cancel":  # until the bag says something of it
                self._news.setdefault(topic.name, News(partial(_nothing, topic), begin_s))
        self.until(begin_s)
        return begin_s

    def _told_begin_ns(self) -> int | None:
        """When a run of the same system began, if the bag has the first change of a state."""
        bag = Bag(self._bag.path)
        begin_ns = None
        for message in bag.messages({self._changes}):
            change = self._change(message)
            if change.get("from", "") is None and change.get("subsystem") in self._subsystems:
                begin_ns = message.time_ns
                break
        for name, topics in self._readers.items():
            for topic in topics if name in bag.topics else ():
                self._check_type(bag.topics[name], self._type_of(name, topic))
        has_time = not self._is_simulated or bag.is_own or CLOCK in bag.topics
        if not has_time and bag.topics:
            raise Unusable(f"{bag.path} has no {CLOCK}, which gives the time with `use_sim_time`")
        return begin_ns

    def _change(self, message: BagMessage) -> dict[str, Any]:
        """What a message says of changes; nothing if it does not."""
        try:
            if message.topic.type == TEXT:
                change = data_of(self._types.decoded(TEXT, message.data)["data"])
                return change if isinstance(change, dict) else {}
        except NoMessage:
            pass
        return {}

    def _go_to(self, begin_ns: int) -> float:
        """Take what was received before a moment; when that is on the clock of the run."""
        self._next = next(self._coming, None)
        while self._next is not None and (
            self._next.time_ns < begin_ns or (self._next.topic.name == CLOCK and not self._clock_s)
        ):
            self._take(self._next)
            self._next = next(self._coming, None)
        self._at_s = begin_ns * 1e-9 if self._clock_s is None else self._clock_s
        return self._at_s

    def _lacks(self) -> str:
        if not self._bag.topics:
            return "is cut, and has no message" if self._bag.cut else "is empty"
        names = sorted(self._missing or self._topics)
        where = [f"{self._where(self._topics[name])} ({name})" for name in names]
        lacking = ", ".join(where or self.commands.topics)
        there = sorted(f"{t.name} [{t.type}]" for t in self._bag.topics.values())
        more = f" and {len(there) - _MOST_NAMED} more" if len(there) > _MOST_NAMED else ""
        cut = ", and it is cut" if self._bag.cut else ""
        return f"has no message of {lacking}: it has {', '.join(there[:_MOST_NAMED])}{more}{cut}"

    def _where(self, topic: Ros2Topic) -> str:
        if topic.between:
            return " or ".join((*TOPICS, self._names.of_element(topic.name)))
        if topic.interface:
            return self._names.of_element(topic.name)
        joints, where = self._joints.get(topic.name), self._names.full(topic.topic)
        known = joints.missing if joints is not None and joints.known else ()
        return f"{where} with joint {', '.join(known)}" if known else where

    # What the run asks.

    def until(self, time_s: float) -> bool:
        """Take the messages until a time of the bag; whether that is its end.

        Raises PlantError for a bag that cannot be read any further.
        """
        now_s = time_s + EARLY_S
        try:
            while self._next is not None and self._time_of(self._next) <= now_s:
                self._take(self._next)
                self._next = next(self._coming, None)
        except (Unusable, UsageError) as error:
            raise PlantError(str(error).removeprefix("--bag: ")) from error
        if self._next is None:
            return now_s >= self._end_s()
        next_s = self._time_of(self._next)
        if next_s > self._passed_s + LONGEST_GAP_S and (gap := self._gap(now_s, next_s)):
            raise PlantError(f"{self._bag.path} has no message for {gap:.6g} s")
        return False

    def _gap(self, from_s: float, to_s: float) -> float:
        """How long the bag has no message at all between two times, s; 0 if that is not too long.

        Looked for once, where nothing comes that is read.
        """
        self._passed_s = to_s
        if self._clock_s is not None:
            return to_s - from_s
        try:
            times = (each.time_ns * 1e-9 for each in Bag(self._bag.path).messages(None))
            longest_s, last_s = 0.0, from_s
            for time_s in chain((t for t in times if from_s < t < to_s), (to_s,)):
                longest_s, last_s = max(longest_s, time_s - last_s), max(last_s, time_s)
        except Unusable as error:
            raise PlantError(str(error)) from error
        return longest_s if longest_s > LONGEST_GAP_S else 0.0

    def _end_s(self) -> float:
        """When the bag ends, all of which has been taken."""
        end_s = self._at_s if self._clock_s is not None else self._bag.end_ns * 1e-9
        is_far = end_s > max(self._at_s, self._passed_s) + LONGEST_GAP_S
        return self._at_s if is_far and self._gap(self._at_s, end_s) else max(end_s, self._at_s)

    def news(self, name: str) -> News | None:
        """What an element has reported since the last call, if anything."""
        return self._news.pop(name, None)

    def differences(self) -> Iterator[str]:
        """What the run has commanded otherwise than the bag, in words."""
        return self.commands.differences({t.name: t.type for t in self._bag.topics.values()})

    def losses(self) -> Iterator[str]:
        """What of the bag was not read, and which actions it does not know, in words."""
        if self._bag.cut or self._bag.damaged:
            yield f"{self._bag.path} is cut or damaged: what is left of it was read"
        if self._late:
            yield (
                f"{self._bag.path}: the times of {self._late} messages are up to "
                f"{self._latest_ns * 1e-9:.6g} s before those of earlier ones: they were taken late"
            )
        calls = {(t.interface, t.topic) for t in self._topics.values() if t.interface}
        for call in sorted(calls):
            parts = [t for t in self._topics.values() if (t.interface, t.topic) == call]
            if not any(self._names.of_element(t.name) in self._bag.topics for t in parts):
                yield f"{self._bag.path} tells nothing of the {' '.join(call).replace('_', ' ')}"

    # The messages.

    def _time_of(self, message: BagMessage) -> float:
        if self._clock_s is None:
            return message.time_ns * 1e-9
        return self._clock_of(message) if message.topic.name == CLOCK else self._clock_s

    def _clock_of(self, message: BagMessage) -> float:
        try:
            clock = self._fields(message.topic, _CLOCK, message.data)()["clock"]
        except NoMessage as error:
            raise Unusable(f"{self._bag.path}: {CLOCK}: {error}") from error
        return float(clock["sec"] + clock["nanosec"] * 1e-9)

    def _take(self, message: BagMessage) -> None:
        """Take the next message. Raises Unusable, UsageError for one that cannot be taken."""
        name = message.topic.name
        if self._is_simulated and name == CLOCK:
            self._follow(self._clock_of(message))
            return
        self._at_s = max(self._at_s, self._time_of(message))
        self._newest_ns = max(self._newest_ns, message.time_ns)
        if (behind_ns := self._newest_ns - message.time_ns) > 0:
            self._late, self._latest_ns = self._late + 1, max(self._latest_ns, behind_ns)
        for topic in self._readers.get(name, ()):
            fields = self._fields(message.topic, self._type_of(name, topic), message.data)
            if name != self._names.of_element(topic.name):
                self._give(topic, fields)
            elif topic.between:
                self._give(topic, fields, lambda message: message["transform"])
            else:
                self._put(topic.name, partial(_from_text, fields), self._at_s)
        if name == self._changes and not (change := self._change(message)).get("subsystem"):
            self.changes.append(change)
        if self._between and name in TOPICS:
            self._transform(message)
        if name in self.commands.topics:
            type_ = whole_type(self.commands.topics[name].type)
            if message.topic.type == type_ and type_ in self._types:
                fields = self._fields(message.topic, type_, message.data)
                self.commands.had(name, fields, self._at_s)

    def _follow(self, clock_s: float) -> None:
        """Be at a time of `/clock`; what came before the first one has no time."""
        if self._clock_s is None:
            self._restart()
            self._at_s = clock_s
        elif clock_s < self._clock_s:
            times = f"from {self._clock_s:.6g} s to {clock_s:.6g} s"
            raise Unusable(f"{self._bag.path}: /clock jumps back {times}: the simulation was reset")
        self._clock_s = clock_s

    def _fields(self, topic: BagTopic, type_: str, data: bytes) -> Callable[[], dict[str, Any]]:
        """What gives the fields of a message; raises UsageError if it is of another type."""
        self._check_type(topic, type_)
        if type_ not in self._types_of:
            try:
                self._types_of[type_] = self._types_for(topic)
            except NoMessage as error:
                raise UsageError(f"--bag: {visible(f'{topic.name}: {error}')}") from error
        return partial(self._types_of[type_].decoded, type_, data)

    def _type_of(self, name: str, topic: Ros2Topic) -> str:
        """What the messages of an element are, on the topic of that name."""
        if name != self._names.of_element(topic.name):
            return whole_type(topic.type)
        return _TRANSFORM if topic.between else TEXT

    def _check_type(self, topic: BagTopic, type_: str) -> None:
        if topic.type != type_:
            words = f"{topic.name} is {topic.type} in {self._bag.path}, where {type_} is read"
            raise UsageError(f"--bag: {visible(words)}")

    def _types_for(self, topic: BagTopic) -> Types:
        """What unpacks the messages of a topic as they were recorded; raises NoMessage."""
        types, (_, name, text) = self._types, topic
        if name in types and types.agrees(name, text):
            return types
        if name in types:
            types = Types(is_empty=True)
        types.learn(name, text)
        return types

    def _give(
        self,
        topic: Ros2Topic,
        fields: Callable[[], dict[str, Any]],
        part: Callable[[dict[str, Any]], Any] = lambda message: message,
    ) -> None:
        """Let an element have a message, measured at the time of its stamp."""
        try:
            message = fields()
            measured_s = self._measured_s(topic, message.get("header", {}).get("stamp"))
            if topic.name not in self._joints:
                self._put(topic.name, partial(part, message), measured_s)
            elif message[topic.path] or not message["name"]:  # else it is of another quantity
                self._join(topic, message, measured_s)
        except (DeviceError, NoMessage) as error:
            self._fail(topic, error)

    def _measured_s(self, topic: Ros2Topic, stamp: Mapping[str, int] | None) -> float:
        """When a message that comes now was measured; raises DeviceError for another clock."""
        at = SimpleNamespace(**stamp) if stamp else None
        latched = dict(topic.qos).get("durability") == "transient_local"
        who: Any = {"latched": latched, "receiver": "the bag"}
        return measured_at(at, self._at_s, self._at_s, topic.topic, **who)

    def _join(self, topic: Ros2Topic, message: dict[str, Any], measured_s: float) -> None:
        joints = self._joints[topic.name]
        if not joints.take(SimpleNamespace(**message), measured_s, self._at_s):
            self._put(topic.name, lambda: message, measured_s)
        elif joints.is_changed and not joints.missing:
            fields, measured_s = joints.joined(self._at_s)
            self._put(topic.name, lambda: fields, measured_s)

    def _transform(self, message: BagMessage) -> None:
        """Let the elements that are transforms have what is new of theirs."""
        fields = self._fields(message.topic, "tf2_msgs/msg/TFMessage", message.data)
        try:
            self._transforms.take(fields(), is_static=message.topic.name == TOPICS[1])
        except (NoMessage, PlantError) as error:
            for topic in self._between:
                self._fail(topic, error)
            return
        for topic in self._between:
            found = self._transforms.between(*topic.between)
            if found is None or self._stamps.get(topic.name) == found[1]:
                continue
            transform, stamp_s = found
            self._stamps[topic.name] = stamp_s
            seconds = int(stamp_s) if isfinite(stamp_s) else 0
            nanosec = round((stamp_s - seconds) * 1e9) if isfinite(stamp_s) else 0
            try:
                measured_s = self._measured_s(topic, {"sec": seconds, "nanosec": nanosec})
            except DeviceError as error:
                self._fail(topic, error)
            else:
                self._put(topic.name, partial(dict, transform), measured_s)

    def _fail(self, topic: Ros2Topic, error: Exception) -> None:
        self._put(topic.name, partial(_raise, PlantError(str(error))), self._at_s)

    def _put(self, name: str, make: Make, measured_s: float) -> None:
        self._news[name] = News(make, measured_s)
        self._missing.discard(name)


def _nothing(topic: Ros2Topic) -> Any:
    """What a node tells first of a part of an action or a service."""
    if topic.is_call:
        return 0, "none" if topic.part == "status" else None
    return False


def _from_text(fields: Callable[[], dict[str, Any]]) -> Any:
    return data_of(fields()["data"])


def _raise(error: PlantError) -> Any:
    raise error
