"""The plant behind ROS 2: a node in the device host, and values instead of messages here."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from specc_runtime.changes import Event
from specc_runtime.clock import EndingClock, WallClock
from specc_runtime.faults import DeviceFailed
from specc_runtime.hosting.client import HostedPlant, Setup
from specc_runtime.hosting.memory import Raw
from specc_runtime.hosting.wire import plain
from specc_runtime.live import Change
from specc_runtime.plant import LOST, NO_SAMPLE
from specc_runtime.plants.errors import PlantError
from specc_runtime.printing import say
from specc_runtime.ros2.binding import CHANGES, CLOCK, DIAGNOSTICS, Ros2, Ros2Topic
from specc_runtime.ros2.clock import RosClock
from specc_runtime.ros2.constants import Constants, constants_config
from specc_runtime.ros2.diagnosing import Diagnosing
from specc_runtime.ros2.goals import goals_of
from specc_runtime.ros2.host import DEFINED, LAST, OTHERS, PARAMETERS, WRONG
from specc_runtime.ros2.messages import message_of, value_of
from specc_runtime.ros2.publishing import Publishing
from specc_runtime.ros2.run import Ros2Run
from specc_runtime.system import PlantSpec, System

NODE = "specc_runtime.ros2.host.opening:devices"
START_S = 10.0
"""How long the Python of ROS may take to start, and rclpy to be imported."""

Convert = Callable[[Any], Any]
_MOST_REFUSALS = 10
"""Refused requests that are told of."""
_SERVED_STATUS = "action_server", "status"


class Listener(Protocol):
    """What is told of all that crosses between the node and the agent, while a run goes on."""

    def heard(self, name: str, data: bytes, age_s: float, time_s: float) -> None:
        """An element has reported something, that old, at a time of the run."""

    def sent(self, name: str, data: Any, time_s: float) -> None:
        """Plain data of what an element was sent."""


class Ros2Plant(HostedPlant):
    """The plant, whose node publishes what others can watch as well."""

    def __init__(
        self,
        system: System,
        setup: Setup,
        *,
        decode: Mapping[str, Convert],
        encode: Mapping[str, Convert],
    ) -> None:
        assert system.plant is not None and system.plant.ros2 is not None
        topics = system.plant.ros2.topics
        optional = {t.name for t in topics if is_given_back(t)}
        optional |= {sensor.name for sensor in system.plant.sensors if sensor.initial}
        own = _behind_node(system)
        super().__init__(own, setup, decode=decode, encode=encode, optional=frozenset(optional))
        self._goals = goals_of(topics)
        served = {t.name for t in topics if t.interface.endswith("_server") and t.part == "request"}
        self._requests = {s.name: s.contract for s in system.plant.sensors if s.name in served}
        """What requests of others have to be."""
        self._refusals = 0
        self._eager |= self._goals.keys() | served
        self._statuses: dict[str, Any] = {}
        """What the agent says of served goals in this tick: behind their results, in any order."""
        self._status_parts = {t.name for t in topics if (t.interface, t.part) == _SERVED_STATUS}
        self._is_simulated = system.plant.ros2.use_sim_time
        self._clock_s = 0.0
        self._begin_s: float | None = None
        self._wrong: set[str] = set()
        self.other_commanders: dict[str, dict[str, Any]] = {}
        """By elements: who else sends on its topic, and how long after the begin that was seen."""
        self._pace: RosClock | None = None
        self.listener: Listener | None = None
        self._time_s = 0.0
        self._observed = {*self._observed, *_told_only(system.plant.ros2)}
        self._run: Ros2Run | None = None
        self._constants: Constants | None = None
        self._diagnosing: Diagnosing | None = None
        published = system.plant.ros2.published
        observers = [Publishing(published, self._publish).observe] if published else []
        if system.plant.ros2.diagnostics:
            self._diagnosing = Diagnosing(system, partial(self._publish, DIAGNOSTICS.name))
            observers.append(self._diagnosing.observe)
        self.step_observers = tuple(observers)
        self._look_around()

    def join(self, run: Ros2Run) -> None:
        """Let others in ROS change the constants of the run and learn how it goes on."""
        self._run = run
        if run.live:
            self._constants = Constants(run, partial(self._publish, PARAMETERS))
            self._constants.take(self._new_report(PARAMETERS))

    def changed(self, change: Event) -> None:
        """Something that was changed from outside takes effect."""
        if self._constants is not None and isinstance(change, Change):
            self._constants.changed(change)

    def advance(self, duration_s: float) -> None:
        """See `HostedPlant`."""
        if self._begin_s is None:
            self._begin_s = time.monotonic()
        for name, value in self._statuses.items():
            super().actuate(name, value)
        self._statuses.clear()
        self._time_s += duration_s
        super().advance(duration_s)
        self._look_around()
        if self._constants is not None:
            self._constants.tell()
            self._constants.take(self._new_report(PARAMETERS))
        if self._diagnosing is not None and self._run is not None:
            self._diagnosing.look(self._run)

    def close(self) -> None:
        """See `HostedPlant`."""
        run, self._run = self._run, None
        if self._diagnosing is not None and run is not None:
            self._diagnosing.end(run)
        super().close()

    def actuate(self, name: str, value: Any) -> None:
        """See `HostedPlant`."""
        if name in self._status_parts and not self._is_leaving:
            self._statuses[name] = value
        else:
            super().actuate(name, value)

    def _new_report(self, what: str) -> Mapping[str, Any]:
        """What the node has reported, by elements, since the last call; nothing if that is old."""
        reading = self._readings.get(what)
        if reading is None or self._host.memory.number(reading.index) == reading.number:
            return {}
        raw = self._host.memory.read(reading.index)
        if raw is None:
            return {}
        reading.number = raw.number
        by_element: Mapping[str, Any] = plain(bytes(raw.data))
        return by_element

    def _look_around(self) -> None:
        """Say it if somebody else has begun to send on a topic that is commanded, or in such a way
        on one that is read that no message will come."""
        for name, why in self._new_report(WRONG).items():
            if name not in self._wrong:
                self._wrong.add(name)
                say(f"warning: {why}")
        for name, (topic, nodes) in self._new_report(OTHERS).items():
            data = {"topic": topic, "nodes": nodes, "first_s": self._run_s()}
            before = self.other_commanders.setdefault(name, data)
            if before is data or before["nodes"] != nodes:
                before["nodes"] = nodes
                say(f"warning: {', '.join(nodes)} can send on {topic}, too, which commands {name}")

    def _run_s(self) -> float:
        return 0.0 if self._begin_s is None else time.monotonic() - self._begin_s

    def sample(self, name: str) -> Any:
        """See `HostedPlant`; of an action, what belongs to its present goal."""
        if name in self._requests:
            return self._request(name)
        goals = self._goals.get(name)
        return super().sample(name) if goals is None else goals.sample(name, super().sample)

    def _request(self, name: str) -> Any:
        """The sample of a request. One whose values are none for the element is refused, and ends
        no run: it is a stranger's.
        """
        if self._failure(name):
            return super().sample(name)  # raises it
        try:
            sample = super().sample(name)
            if sample is not NO_SAMPLE:
                self._requests[name](sample.value)
        except Exception as error:  # noqa: BLE001  # of a function, or of a contract
            reading = self._readings[name]
            reading.number = self._host.memory.number(reading.index)
            self._host.channel.send("send", name.rpartition(".")[0], name, None, 0)
            self._refusals += 1
            if self._refusals <= _MOST_REFUSALS:
                say(f"warning: {name}: a request is refused: {error}")
            return NO_SAMPLE
        return sample

    def _heard(self, name: str, raw: Raw) -> None:
        if self.listener is not None:
            age_s = self._age_s(raw.measured_s)
            self.listener.heard(name, bytes(raw.data), age_s, self._time_s)

    def _ordered(self, name: str, value: Any) -> Any:
        goals = self._goals.get(name)
        if goals is None or self._is_leaving:
            data = self._encoded(name, value)
        else:
            data = goals.take(value), super()._encoded(name, value)
        if self.listener is not None:
            self.listener.sent(name, data, self._time_s)
        return data

    def _encoded(self, name: str, value: Any) -> Any:
        fields = super()._encoded(name, value)
        return (LAST, fields) if name in self._goals else fields

    def clock_of_run(self, clock: WallClock, is_over: Callable[[], bool]) -> WallClock:
        """The clock of the run: `clock` until the end, or simulated time where ROS has that."""
        if not self._is_simulated:
            return EndingClock(clock, is_over)

        def goes_on() -> bool:
            self._host.memory.beat_s = time.monotonic()
            self._hear()
            failed = self._failures.keys() - self._observed
            return not (failed or self._ended or is_over())

        self._pace = RosClock(self._newest_s, goes_on, self._fail)
        return self._pace

    def waits_for(self) -> list[str]:
        """What keeps the run, if it has to be told."""
        awaited_s = None if self._pace is None else self._pace.awaited_s
        if awaited_s is None:
            return []
        return [f"the next tick is at {awaited_s:.6g} s, and /clock is at {self._clock_s:.6g} s"]

    def _newest_s(self) -> float:
        """Simulated time, s, as it was told last; never raises."""
        raw = self._host.memory.read(self._readings[CLOCK].index)
        if raw is not None:
            self._clock_s = plain(bytes(raw.data))
        return self._clock_s

    def definitions(self) -> Mapping[str, str]:
        """The texts of types, as `package/Type`, that the node was asked for."""
        return self._new_report(DEFINED)

    def ros_ns(self) -> int:
        """The time on the clock of ROS."""
        return round(self._newest_s() * 1e9) if self._is_simulated else time.time_ns()

    def _age_s(self, measured_s: float) -> float:
        """See `HostedPlant`; in simulated time the node tells when that was on its clock."""
        return (self._newest_s() if self._is_simulated else time.monotonic()) - measured_s

    def _fail(self, error: PlantError) -> None:
        self._ended = self._ended or error

    def _publish(self, name: str, message: dict[str, Any]) -> None:
        """Hand a message to the node; nobody waits for it, and no device is behind it."""
        self._host.channel.send("send", "", name, message, 0)


def _behind_node(system: System) -> System:
    """The system with nothing in its plant but what is behind the node: all, or beside a simulation
    what has a topic.
    """
    spec = system.plant
    assert spec is not None and spec.ros2 is not None
    if not spec.is_simulated:
        return system
    own = spec.ros2.elements
    plant = replace(
        spec,
        sensors=tuple(each for each in spec.sensors if each.name in own),
        actuators=tuple(each for each in spec.actuators if each.name in own),
        inputs=tuple(each for each in spec.inputs if each.sensor in own),
        outputs=tuple(each for each in spec.outputs if each.actuator in own),
        observed=(),
        safe=tuple(s for s in spec.safe if any(f"{s.name}.{e}" in own for e in s.elements)),
    )
    return replace(system, plant=plant)


def ros2_plant(
    system: System, ros_args: Sequence[str] = (), *, is_recorded: bool = False
) -> Ros2Plant:
    """The plant of a system with `ros2`: its node runs, and topics have had their first messages.

    The node gets `ros_args`, as those of `ros2 run` behind `--ros-args`. If it is recorded as a
    bag, the node tells the definitions of types of messages for functions of `through`.

    Raises UsageError for a Python that cannot be started; PlantError for topics that are not there
    or not as declared.
    """
    spec = system.plant
    assert spec is not None and spec.ros2 is not None, "the caller knows that it is behind ROS 2"
    decode, encode = conversions(spec)
    # What nobody reads need not come.
    read = {item.sensor for item in spec.inputs}
    topics = tuple(
        topic
        for topic in spec.ros2.topics
        if topic.commanded or (topic.name in read and not is_given_back(topic))
    )
    ros2 = replace(spec.ros2, topics=topics)
    gaps = {sensor.name: sensor.max_gap_s for sensor in spec.sensors}
    known = {topic.name for topic in topics}
    initialized = {sensor.name for sensor in spec.sensors if sensor.initial} & known
    answered = {sensor.name for sensor in spec.sensors if sensor.on_loss}
    constants = constants_config(system.live)
    config = ros2.config | {"ros_args": [*ros_args], "constants": constants}
    for topic in config["topics"]:
        topic["max_gap_s"] = gaps.get(topic["name"])
        topic["is_initialized"] = topic["name"] in initialized
        topic["is_answered"] = topic["name"] in answered
    besides = (CLOCK,) if ros2.use_sim_time else ()
    if is_recorded:
        whole = {t.type for t in topics if t.shape == "message" and not t.interface}
        config["defines"] = sorted(whole)
        besides = (*besides, DEFINED)
    config["is_warned"] = bool(initialized or ros_args or ros2.diagnostics)
    if config["is_warned"]:
        besides = (*besides, WRONG)
    if constants:
        besides = (*besides, PARAMETERS)
    if any(topic.commanded and not topic.interface for topic in topics):
        besides = (*besides, OTHERS)
    setup = Setup(NODE, config, python=ros2.python, wait_s=ros2.wait_s + START_S, besides=besides)
    return Ros2Plant(system, setup, decode=decode, encode=encode)


def conversions(spec: PlantSpec) -> tuple[Mapping[str, Convert], Mapping[str, Convert]]:
    """By the names of elements: values of messages, and messages of values."""
    assert spec.ros2 is not None
    through: dict[str, Any] = {sensor.name: sensor.through for sensor in spec.sensors}
    through |= {actuator.name: actuator.through for actuator in spec.actuators}
    answered = {sensor.name for sensor in spec.sensors if sensor.on_loss}
    decode: dict[str, Convert] = {}
    encode: dict[str, Convert] = {}
    for topic in spec.ros2.topics:
        function = through.get(topic.name)
        made = None if function is None else partial(_made, topic.name, function)
        if topic.commanded:
            encode[topic.name] = _after(made, partial(message_of, topic))
            if topic.interface:
                encode[topic.name] = _unless_none(encode[topic.name])
        else:
            read = _after(partial(value_of, topic), made)
            if topic.name in answered:
                read = _unless_none(read, LOST)
            elif topic.is_call:
                read = _unless_none(read)
            decode[topic.name] = _numbered(read) if topic.is_call else read
    return decode, encode


def _after(first: Convert | None, second: Convert | None) -> Convert:
    if first is None or second is None:
        return first or second or (lambda value: value)
    return lambda value: second(first(value))


def _made(name: str, function: Convert, given: Any) -> Any:
    """What a function of `through` makes; raises DeviceFailed, which blames it."""
    try:
        return function(given)
    except Exception as error:
        raise DeviceFailed(name, error, {"value": given}, through=function) from error


def _told_only(ros2: Ros2) -> set[str]:
    """What is published: a message that cannot be ends no run."""
    own = CHANGES.name, DIAGNOSTICS.name, PARAMETERS
    return {*own, *(each.topic.name for each in ros2.published)}


def is_given_back(topic: Ros2Topic) -> bool:
    """Whether an element is what an action or a service was asked last; the agent knows that
    without the node.
    """
    given = {"action": "goal", "service": "request"}
    return given.get(topic.interface) == topic.part and not topic.commanded


def _numbered(convert: Convert) -> Convert:
    """Convert what is reported of a goal, beside the number of that."""
    return lambda reported: (reported[0], convert(reported[1]))


def _unless_none(convert: Convert, otherwise: Any = None) -> Convert:
    """No goal, and no feedback and no result yet, are None; what has been lost is told as None."""
    return lambda value: otherwise if value is None else convert(value)
