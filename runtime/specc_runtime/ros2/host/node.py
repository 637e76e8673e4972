"""The devices of a plant behind ROS 2: one node, with a subscription or publisher for each."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import rclpy
from rclpy.action import get_action_names_and_types
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host import DEFINED, DIAGNOSTICS, OTHERS, PARAMETERS, WRONG
from specc_runtime.ros2.host.actions import Action
from specc_runtime.ros2.host.definitions import definition
from specc_runtime.ros2.host.joints import JointNumbers
from specc_runtime.ros2.host.parameters import Parameters
from specc_runtime.ros2.host.plain import check_field, fill, interface, interface_name, plain
from specc_runtime.ros2.host.qos import is_latched, mismatch, profile
from specc_runtime.ros2.host.services import CalledService, ServedService
from specc_runtime.ros2.host.serving import ServedAction
from specc_runtime.ros2.host.stamps import measured_at
from specc_runtime.ros2.host.transforms import Transforms

Call = Action | CalledService | ServedAction | ServedService
Samples = list[tuple[str, object, float]]
"""Names of elements, plain values, and when they were measured: s of `time.monotonic()`."""
_STEP_S = 0.05
_SETTLED_S = 1.0
"""How long the servers of actions have at the end for their answers."""
_ACKNOWLEDGED_S = 0.2
"""How long those who look have to take the last diagnostics."""
_AROUND_S = 1.0
"""How often others are looked for who send on a topic that is commanded, or not as it is read."""
_DISCOVERED_S = 1.0
"""How long publishers are waited for of topics whose first message is not."""
_CLOCK = "/clock"
_JOINT_STATES = 10
"""Messages of joint states that wait, since several publishers may have a part of the joints."""
_MOST_OTHERS = 10
_UNKNOWN = "_NODE_NAME_UNKNOWN_"
"""The name of a node that has just been discovered."""
_MOST_AT_ONCE = 64
"""Messages of a topic that one `poll` takes, so that it returns though they come without end."""


class NodeDevices:
    """What the device host asks: open, poll, send, close, with plain data only.

    The configuration has `node`, its name; `namespace`; `ros_args`, which may replace both and the
    names of topics; `use_sim_time`; `wait_s`; and `topics`,
    each with the `name` of its element, `topic`, `type`, whether it is `commanded`, `qos`, and
    `joints`: a message that has none of them is somebody else's. Messages may have some of the
    joints each if `field` says where their numbers are, none missing for longer than `max_gap_s`.
    One that `is_initialized` need not have a message. The loss of one that `is_answered`, of a
    joint or of the server of an action, is the value None instead of an error.
    Where it is a `part` of an action, `topic` and `type` are those of the action. Those that are
    `published` are for whoever looks. `constants` are those that others may change, as parameters.
    With `defines`, the definitions of these types are told.
    """

    def __init__(self) -> None:
        self._context = rclpy.Context()
        self._samples: Samples = []
        self._publishers: dict[str, Any] = {}
        self._calls: dict[tuple[str, str], Call] = {}
        """Actions and services, by the kinds and the names of their interfaces."""
        self._transforms: Transforms | None = None
        self._commands: dict[str, Callable[[Any], None]] = {}
        """What takes the values of elements that are parts of these."""
        self._waiting: dict[str, dict[str, Any]] = {}
        self._strangers: dict[str, list[str]] = {}
        """By elements: the joints of messages that were passed over."""
        self._joints: dict[str, JointNumbers] = {}
        """By elements."""
        self._commanded: dict[str, Any] = {}
        """Publishers of topics that are commanded, by elements."""
        self._others: dict[str, tuple[str, list[str]]] = {}
        self._wrong: dict[str, str] = {}
        """Why there will be no first message of elements that need none, as far as is known."""
        self._parameters: Parameters | None = None
        self._around_due_s = 0.0
        self._is_simulated = False
        self._node: Node | None = None
        self._executor: SingleThreadedExecutor | None = None

    def open(self, config: dict[str, Any]) -> None:
        """Connect; returns when each topic has a first message or a reader, after `wait_s` at most.

        Raises DeviceError for topics without one, with all that is known of why. Of those that need
        no message it tells what is known to be wrong.
        """
        node = self._begin(config)
        between = [topic for topic in config["topics"] if topic["between"]]
        if between:
            self._transforms = Transforms(node, between, self._put)
            self._waiting.update((topic["name"], topic) for topic in between)
        for topic in config["topics"]:
            if topic["between"]:
                continue
            check_field(topic)
            if topic["interface"]:
                self._connect(node, topic, config["topics"])
            elif topic["commanded"]:
                self._advertise(node, topic)
                self._commanded[topic["name"]] = self._publishers[topic["name"]]
                self._waiting[topic["name"]] = topic
            else:
                self._subscribe(node, topic)
        if self._is_simulated:
            self._follow_clock(node)
        for topic in config["published"]:
            self._publish(node, topic)
        self._wait(node, float(config["wait_s"]))
        if "defines" in config:
            self._put(DEFINED, {name: definition(name) for name in config["defines"]})
        if config["is_warned"]:
            self._put(WRONG, self._wrong)
        if self._commanded:
            self._look_for_others(node)
            self._put(OTHERS, self._others)

    def poll(self, timeout_s: float) -> Samples:
        """New samples; waits for the first at most that long. Raises DeviceError."""
        assert self._executor is not None, "poll comes after open"
        self._spin(timeout_s)
        self._take_waiting()
        self._look()
        if self._parameters is not None:
            self._parameters.look()
        if time.monotonic() >= self._around_due_s:
            assert self._node is not None, "poll comes after open"
            self._around_due_s = time.monotonic() + _AROUND_S
            if self._commanded and self._look_for_others(self._node):
                self._put(OTHERS, self._others)
            wrong = self._why_wrong(self._node)
            if wrong.keys() - self._wrong.keys():
                self._wrong |= wrong
                self._put(WRONG, self._wrong)
        samples, self._samples = self._samples, []
        return samples

    def send(self, name: str, value: Any) -> None:
        """Publish a command, or hand it to an action or a service.

        Parameters are what the run says that they are. Raises DeviceError for what does not fit.
        """
        if name == PARAMETERS:
            assert self._parameters is not None, "there are constants that may change"
            self._parameters.follow(value)
            return
        if name in self._commands:
            self._commands[name](value)
            return
        if name == DIAGNOSTICS:
            if name not in self._publishers:
                return
            self._name_node(value)
        publisher = self._publishers[name]
        message = fill(publisher.msg_type(), value)
        header: Any = getattr(message, "header", None)
        stamp = getattr(header, "stamp", None)
        if stamp is not None and not (stamp.sec or stamp.nanosec):
            assert self._node is not None, "send comes after open"
            header.stamp = self._node.get_clock().now().to_msg()
        publisher.publish(message)

    def _name_node(self, diagnostics: Any) -> None:
        """Two robots of one specification have the same subsystems, and nodes of their own."""
        assert self._node is not None, "send comes after open"
        own = self._node.get_fully_qualified_name().lstrip("/")
        for status in diagnostics["status"]:
            status["name"] = f"{own}: {status['name']}"

    def close(self) -> None:
        """Leave the graph; may be called twice, and without `open`."""
        if self._executor is not None:
            until_s = time.monotonic() + _SETTLED_S
            for call in self._calls.values():
                call.end()
            while time.monotonic() < until_s and not self._is_settled():
                self._spin(_STEP_S)
                for call in self._calls.values():
                    call.look()
            if DIAGNOSTICS in self._publishers:  # the last ones say why the run is over
                self._publishers[DIAGNOSTICS].wait_for_all_acked(Duration(seconds=_ACKNOWLEDGED_S))
            self._executor.shutdown(timeout_sec=1.0)
            self._executor = None
        if self._node is not None:
            self._node.destroy_node()
            self._node = None
        self._context.try_shutdown()

    def _spin(self, timeout_s: float) -> None:
        """Have one thing done that is ready; waits for it at most that long.

        With another timeout than before the executor first resumes each callback that waits for an
        answer of the agent, and does nothing else in that call.
        """
        assert self._executor is not None, "the node is open"
        for _ in range(1 + sum(call.waiting for call in self._calls.values())):
            self._executor.spin_once(timeout_sec=timeout_s)

    def _take_waiting(self) -> None:
        """Take the messages that wait; the executor would prepare to wait again for each of them.

        Those of `/clock` come first, also for the node itself, whose subscription is its first one.
        """
        assert self._node is not None, "the node is open"
        for subscription in self._node.subscriptions:
            handle, kind = subscription.handle, subscription.msg_type
            for _ in range(_MOST_AT_ONCE):
                with handle:
                    found = handle.take_message(kind, False)
                if found is None:
                    break
                subscription.callback(found[0])

    def _is_settled(self) -> bool:
        """Whether nobody waits for an answer: a goal must not outlive the run."""
        return all(call.is_settled for call in self._calls.values())

    def _begin(self, config: dict[str, Any]) -> Node:
        given = config.get("ros_args", [])
        try:
            # The host has its own ways to end.
            rclpy.init(
                args=["--ros-args", *given] if given else [],
                context=self._context,
                signal_handler_options=SignalHandlerOptions.NO,
            )
            node = self._node = _node(config, self._context)
        except Exception as error:
            if given:
                raise DeviceError(f"--ros-args {' '.join(given)}: {error}") from error
            raise
        self._is_simulated = bool(config.get("use_sim_time"))
        if node.get_parameter("use_sim_time").value and not self._is_simulated:
            raise DeviceError("--ros-args: `use_sim_time` stands in the specification")
        self._parameters = self._declared(node, config.get("constants", []))
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(node)
        return node

    def _declared(self, node: Node, constants: list[dict[str, Any]]) -> Parameters | None:
        """The parameters; None if there are none."""
        tell = partial(self._put, PARAMETERS) if constants else lambda _: None
        try:
            parameters = Parameters(node, constants, tell)
        except DeviceError as error:
            raise DeviceError(f"--ros-args: {error}") from error
        if parameters.ignored:
            self._wrong[PARAMETERS] = parameters.ignored
        return parameters if constants else None

    def _publish(self, node: Node, topic: dict[str, Any]) -> None:
        """Have a topic for those who look; for diagnostics, only if ROS has their messages."""
        try:
            self._advertise(node, topic)
        except DeviceError as error:
            if topic["name"] != DIAGNOSTICS:
                raise
            self._wrong[DIAGNOSTICS] = f"there are no diagnostics: {error}"

    def _connect(self, node: Node, topic: dict[str, Any], every: list[dict[str, Any]]) -> None:
        """Connect an action or a service, with all its parts."""
        interface, name, part = topic["interface"], topic["topic"], topic["part"]
        key = interface, name
        if key not in self._calls:
            same = [t for t in every if (t["interface"], t["topic"]) == key]
            self._calls[key] = self._call(node, interface, topic, same)
            if interface in ("action", "service"):
                self._waiting[f"{interface} {name}"] = topic
        call = self._calls[key]
        if isinstance(call, ServedAction | ServedService) and part == "request":
            self._commands[topic["name"]] = call.refuse
        if not topic["commanded"]:
            return
        if isinstance(call, Action):
            self._commands[topic["name"]] = lambda value: call.pursue(*value)
        elif isinstance(call, CalledService):
            self._commands[topic["name"]] = lambda value: call.call(*value)
        else:
            self._commands[topic["name"]] = partial(call.command, part)

    def _call(
        self, node: Node, interface: str, topic: dict[str, Any], same: list[dict[str, Any]]
    ) -> Call:
        name, type_ = topic["topic"], topic["type"]
        parts = {t["part"]: t["name"] for t in same}
        reported = {t["part"]: t["name"] for t in same if not t["commanded"]}
        put = partial(self._put_part, [t for t in same if not t["commanded"]])
        request = next((t for t in same if t["part"] == "request"), topic)
        within_s = request["answer_within_s"]
        with _opening(topic):
            if "service" in interface:
                where = node.resolve_service_name(name)
                made = CalledService if interface == "service" else ServedService
                return made(node, where, type_, reported, put, within_s)
            # Not every distribution remaps the topics of an action with its name.
            where = node.resolve_topic_name(name)
            if interface == "action":
                is_answered = any(t["is_answered"] for t in same)
                return Action(node, where, type_, parts, put, is_answered=is_answered)
            return ServedAction(
                node,
                where,
                type_,
                reported,
                put,
                when_busy=request["when_busy"],
                answer_within_s=within_s,
            )

    def _put_part(self, reported: list[dict[str, Any]], name: str, value: Any) -> None:
        """Put a message, of which several elements may be fields."""
        part = next(t["part"] for t in reported if t["name"] == name)
        for topic in reported:
            if topic["part"] == part:
                self._put(topic["name"], value)

    def _follow_clock(self, node: Node) -> None:
        def receive(message: Any) -> None:
            now_s = message.clock.sec + message.clock.nanosec * 1e-9
            self._samples.append((_CLOCK, now_s, time.monotonic()))
            self._waiting.pop(_CLOCK, None)

        topic = {"name": _CLOCK, "topic": _CLOCK, "type": "rosgraph_msgs/Clock"}
        none = {"commanded": False, "interface": "", "between": (), "is_initialized": False}
        self._waiting[_CLOCK] = topic | none
        qos = profile({}, commanded=False)
        node.create_subscription(interface(topic["type"]), _CLOCK, receive, qos)

    def _look(self) -> None:
        """Ask those that tell nothing by themselves."""
        for call in self._calls.values():
            call.look()
        for name, joints in self._joints.items():
            if joints.is_changed and not joints.missing:
                self._tell_joints(name, joints)
        if self._transforms is not None and self._ros_s():
            self._transforms.look()

    def _look_for_others(self, node: Node) -> bool:
        """Note who else sends on the topics that are commanded; whether there is somebody new."""
        before = dict(self._others)
        own = Counter(publisher.topic_name for publisher in self._commanded.values())
        for name, publisher in self._commanded.items():
            topic = publisher.topic_name
            ends = [_full_name(e) for e in node.get_publishers_info_by_topic(topic)]
            for _ in range(own[topic]):  # another node may have the same name
                with suppress(ValueError):
                    ends.remove(node.get_fully_qualified_name())
            known = self._others.get(name, (topic, []))[1]
            if new := sorted({e for e in ends if e not in known and _UNKNOWN not in e}):
                self._others[name] = topic, [*known, *new][:_MOST_OTHERS]
        return self._others != before

    def _tell_joints(self, name: str, joints: JointNumbers) -> None:
        now_s = self._of_devices(time.monotonic())
        value: Any
        try:
            value, measured_s = joints.joined(now_s)
        except DeviceError as error:
            value, measured_s = error, now_s
        self._report(name, value, measured_s)

    def _put(self, name: str, value: Any, measured_s: float | None = None) -> None:
        """Report a value, measured then or now by the clock of the machine."""
        measured_s = time.monotonic() if measured_s is None else measured_s
        self._report(name, value, self._of_devices(measured_s))

    def _report(self, name: str, value: Any, measured_s: float) -> None:
        """Report a value, measured then by the clock of the devices."""
        self._samples.append((name, value, measured_s))
        self._waiting.pop(name, None)

    def _of_devices(self, time_s: float) -> float:
        """A time of the machine's clock by that of the devices.

        Simulated time goes on at any pace: then it is told when that was on the clock of ROS.
        """
        return time_s + self._ros_s() - time.monotonic() if self._is_simulated else time_s

    def _ros_s(self) -> float:
        assert self._node is not None, "nothing comes before open"
        return float(self._node.get_clock().now().nanoseconds * 1e-9)

    def _advertise(self, node: Node, topic: dict[str, Any]) -> None:
        cls = interface(topic["type"])
        qos = profile(topic.get("qos", {}), commanded=True)
        with _opening(topic):
            self._publishers[topic["name"]] = node.create_publisher(cls, topic["topic"], qos)

    def _subscribe(self, node: Node, topic: dict[str, Any]) -> None:
        cls = interface(topic["type"])
        if topic["field"]:
            joints, gap_s = topic["joints"], topic["max_gap_s"]
            name, where = topic["name"], node.resolve_topic_name(topic["topic"])
            self._joints[name] = JointNumbers(
                where, joints, topic["field"], gap_s, is_answered=topic["is_answered"]
            )
        depth = _JOINT_STATES if topic["joints"] else 1
        qos = profile(topic.get("qos", {}), commanded=False, depth=depth)
        with _opening(topic):
            node.create_subscription(cls, topic["topic"], self._receiver(topic), qos)
        self._waiting[topic["name"]] = topic

    def _receiver(self, topic: dict[str, Any]) -> Callable[[Any], None]:
        name, where = topic["name"], topic["topic"]
        wanted, joints = frozenset(topic.get("joints", ())), self._joints.get(name)
        latched = topic.get("qos", {}).get("durability") == "transient_local"

        def receive(message: Any) -> None:
            now_s, ros_s = time.monotonic(), self._ros_s()
            if wanted and wanted.isdisjoint(others := getattr(message, "name", wanted)):
                self._strangers[name] = list(others)
                return
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            if not ros_s:  # simulated, and nothing has come on /clock yet
                if not latched:
                    return
                stamp = None
            try:
                at_s = measured_at(stamp, ros_s, now_s, where, latched=latched)
            except DeviceError as error:  # of this element, and of no other
                self._put(name, error, now_s)
                return
            times_s = map(self._of_devices, (at_s, now_s))
            if joints is None or not joints.take(message, *times_s):
                self._put(name, plain(message), at_s)

        return receive

    def _wait(self, node: Node, wait_s: float) -> None:
        assert self._executor is not None
        end_s = time.monotonic() + wait_s
        discovered_s = min(end_s, time.monotonic() + _DISCOVERED_S)
        while self._waiting:
            lacking = [t for t in self._waiting.values() if not t["is_initialized"]]
            left_s = end_s - time.monotonic()
            if left_s <= 0 or (not lacking and time.monotonic() >= discovered_s):
                wrong = self._why_wrong(node)
                if not lacking and not wrong:
                    return
                if left_s <= 0:
                    lost = [*(self._why_silent(node, topic) for topic in lacking), *wrong.values()]
                    raise DeviceError(f"after {wait_s:g} s of waiting: {'; '.join(lost)}")
            self._spin(min(left_s, _STEP_S))
            self._look()
            self._waiting = {n: t for n, t in self._waiting.items() if not self._is_met(n)}

    def _why_wrong(self, node: Node) -> dict[str, str]:
        """Why elements that need no message will have none; nothing of those that may have one."""
        initialized = {n: t for n, t in self._waiting.items() if t["is_initialized"]}
        found = {n: self._why_not(node, t) or _why_wrong(node, t) for n, t in initialized.items()}
        return {name: why for name, why in found.items() if why}

    def _why_silent(self, node: Node, topic: dict[str, Any]) -> str:
        return self._why_not(node, topic) or _why_wrong(node, topic) or _why_silent(node, topic)

    def _why_not(self, node: Node, topic: dict[str, Any]) -> str:
        """Why the messages that came are none of an element; empty if none came."""
        name, full = topic["name"], node.resolve_topic_name(topic["topic"])
        joints, strangers = self._joints.get(name), self._strangers.get(name, [])
        if joints is not None and joints.known:
            lacking, known = ", ".join(joints.missing), ", ".join([*joints.known, *strangers])
            return f"{full} has no joint {lacking}: it has {known} ({name})"
        if strangers:
            wanted, known = ", ".join(topic["joints"]), ", ".join(strangers)
            return f"{full} ({name}) has none of the joints {wanted}: it has {known}"
        return ""

    def _is_met(self, name: str) -> bool:
        """Whether somebody serves an action or reads a command; messages come by themselves."""
        interface, _, called = name.partition(" ")
        call = self._calls.get((interface, called))
        if isinstance(call, (Action, CalledService)):
            return call.is_there
        publisher = self._publishers.get(name)
        return publisher is not None and publisher.get_subscription_count() > 0


def _full_name(end: Any) -> str:
    return f"{end.node_namespace.rstrip('/')}/{end.node_name}"


@contextmanager
def _opening(topic: dict[str, Any]) -> Iterator[None]:
    """Have errors of ROS, as for two types of messages on one topic, say which topic it is."""
    try:
        yield
    except Exception as error:
        what = f"{topic['topic']} ({topic['name']}) cannot be opened as {topic['type']}"
        raise DeviceError(f"{what}: {error}") from error


def _node(config: dict[str, Any], context: Any) -> Node:
    overrides = []
    if config.get("use_sim_time"):
        overrides.append(Parameter("use_sim_time", value=True))
    return Node(
        config["node"],
        context=context,
        namespace=config.get("namespace") or None,
        parameter_overrides=overrides,
        start_parameter_services=bool(config.get("constants")),
        automatically_declare_parameters_from_overrides=True,
        enable_rosout=False,
    )


def _why_silent(node: Node, topic: dict[str, Any]) -> str:
    """What is known of a topic that has no message yet, or no reader."""
    full, commanded = node.resolve_topic_name(topic["topic"]), topic["commanded"]
    if topic["between"]:
        parent, child = topic["between"]
        return f"tf knows no transform from {parent} to {child} ({topic['name']})"
    if topic["interface"]:
        return _why_unserved(node, topic)
    others = _other_ends(node, topic)
    if not others:
        return f"nobody {'reads' if commanded else 'publishes'} {full} ({topic['name']})"
    return f"{full} ({topic['name']}) has {len(others)} publishers and no message"


def _why_unserved(node: Node, topic: dict[str, Any]) -> str:
    """Why an action or a service cannot be called: nobody serves it, or as another type."""
    kind, name = topic["interface"], topic["name"]
    if kind == "service":
        full = node.resolve_service_name(topic["topic"])
        known = dict(node.get_service_names_and_types())
    else:
        full = node.resolve_topic_name(topic["topic"])
        known = dict(get_action_names_and_types(node))
    wanted = interface_name(interface(topic["type"], "srv" if kind == "service" else "action"))
    if others := sorted({*known.get(full, ())} - {wanted}):
        return f"the {kind} {full} ({name}) is served as {' and '.join(others)}, not as {wanted}"
    return f"nobody serves the {kind} {full} ({name})"


def _other_ends(node: Node, topic: dict[str, Any]) -> list[Any]:
    """Who publishes what a topic is read from, or reads what is sent on it."""
    full = node.resolve_topic_name(topic["topic"])
    if topic["commanded"]:
        return list(node.get_subscriptions_info_by_topic(full))
    return list(node.get_publishers_info_by_topic(full))


def _why_wrong(node: Node, topic: dict[str, Any]) -> str:
    """Why no message comes from those who are there, or reaches them; empty if one may.

    Where no message is awaited, one publisher that fits will do, and who says that only new
    messages count means it.
    """
    if topic["between"] or topic["interface"]:
        return ""
    commanded, options = topic["commanded"], topic.get("qos", {})
    where = f"{node.resolve_topic_name(topic['topic'])} ({topic['name']})"
    others, wanted = _other_ends(node, topic), interface_name(interface(topic["type"]))
    own = profile(options, commanded=commanded)
    fits = [end.topic_type == wanted and not _mismatch(own, end, commanded) for end in others]
    is_chosen = topic["is_initialized"] and "durability" in options
    if not (topic["is_initialized"] and any(fits)):
        if types := sorted({end.topic_type for end in others} - {wanted}):
            verb = "read" if commanded else "published"
            return f"{where} is {verb} as {' and '.join(types)}, not as {wanted}"
        for end in others:
            if why := _mismatch(own, end, commanded):
                return f"the quality of service of {where} does not match: {why}"
    is_kept = others and all(is_latched(end.qos_profile) for end in others)
    if is_kept and options.get("durability") != "transient_local" and not is_chosen:
        return (
            f"{where} is latched, and its message was sent before this run began: "
            "bind it with `qos: {durability: transient_local}`"
        )
    return ""


def _mismatch(own: Any, end: Any, commanded: bool) -> str:
    ends = (own, end.qos_profile) if commanded else (end.qos_profile, own)
    return mismatch(*ends)
