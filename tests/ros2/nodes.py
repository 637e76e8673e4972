"""Other nodes of the graph, each in a process of its own: run by a Python of ROS, without specc.

The first argument names the node, the others are its own.
"""

from __future__ import annotations

import json
import sys
import time
from contextlib import suppress
from typing import Any

import rclpy
import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Empty, Float64, Float64MultiArray, Int64, String
from test_msgs.action import Fibonacci


def latched(topic: str) -> list[Node]:
    """Sends one message and keeps it for those who come late."""
    node = rclpy.create_node("safety")
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(Bool, topic, qos).publish(Bool(data=True))
    return [node]


def asker(state: str, topic: str, *kinds: str) -> list[Node]:
    """Once somebody tells its `state`, sends `Empty` or `Bool` on a topic, 0.4 s apart."""
    node, left = rclpy.create_node("asker"), list(kinds)
    types = {"Empty": Empty, "Bool": Bool}
    publishers: list[Publisher] = []

    def ask() -> None:
        if left and publishers:
            kind = types[left.pop(0)]
            publishers[0].publish(kind())

    def heard(_: String) -> None:
        if not publishers:
            publishers.append(node.create_publisher(types[kinds[0]], topic, 10))

    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(String, state, heard, qos)
    node.create_timer(0.4, ask)
    return [node]


def server(action: str, *outcomes: str) -> list[Node]:
    """Has an outcome for each goal, the last one for all that follow, and says when it is there.

    `reject` and `abort` come at once, `succeed` after 0.2 s, `wait` until somebody cancels.
    """
    node, left = rclpy.create_node("gripper"), list(outcomes)

    def asked(_: Fibonacci.Goal) -> GoalResponse:
        is_rejected = left[0] == "reject"
        if is_rejected:
            print(left.pop(0) if len(left) > 1 else left[0], flush=True)
        return GoalResponse.REJECT if is_rejected else GoalResponse.ACCEPT

    def pursue(handle: ServerGoalHandle) -> Fibonacci.Result:
        outcome = left.pop(0) if len(left) > 1 else left[0]
        print(outcome, handle.request.order, flush=True)
        if outcome == "abort":
            handle.abort()
        else:
            steps = 4 if outcome == "succeed" else 10**6
            while steps and not handle.is_cancel_requested:
                time.sleep(0.05)
                steps -= 1
            handle.succeed() if not steps else handle.canceled()
        print(GOAL_STATUS[handle.status], flush=True)
        return Fibonacci.Result(sequence=[handle.request.order])

    SERVERS.append(
        ActionServer(
            node,
            Fibonacci,
            action,
            pursue,
            goal_callback=asked,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
    )
    return [node]


def tuner(node: str, *requests: str) -> list[Node]:
    """Once somebody tells its speed, makes requests about the parameters of a node, in turn.

    `set NAME VALUE`, `get NAME`, `list`, `describe NAME`; `insist NAME VALUE` sets until that is
    taken, `until NAME VALUE` gets until it is so. `strange NAME` sets one of a type that there is
    not, `many NAME` more of them than a request may have, and `burst NAME VALUE` makes two requests
    that have as many as they may. Prints what is answered, and each new speed.
    """
    own, left, speeds = rclpy.create_node("tuner"), list(requests), [0.0]
    client, asked = AsyncParameterClient(own, node), list[tuple[str, Future]]()

    def heard(message: Float64) -> None:
        if message.data != speeds[-1]:
            speeds.append(message.data)
            print("speed", message.data, flush=True)

    def ask() -> None:
        if asked and asked[0][1].done():
            request, future = asked.pop()
            text = answered(*request.split(), future.result())
            if text:
                print(request, text, flush=True)
            else:
                left.insert(0, request)
        if left and not asked and len(speeds) > 1 and client.services_are_ready():
            request = left.pop(0)
            asked.append((request, requested(client, *request.split())))

    own.create_subscription(Float64, "/speed", heard, 10)
    own.create_subscription(Int64, "/tries", lambda _: None, 10)
    own.create_timer(0.02, ask)
    return [own]


def requested(client: AsyncParameterClient, kind: str, name: str = "", value: str = "") -> Future:
    """Make a request."""
    if kind in ("get", "until"):
        return client.get_parameters([name])
    if kind == "list":
        return client.list_parameters([], 10)
    if kind == "describe":
        return client.describe_parameters([name])
    message = ParameterMessage(name=name)
    if kind == "strange":
        message.value.type = 99
    elif value:
        message = RosParameter(name, value=yaml.safe_load(value or "1")).to_parameter_msg()
    if kind == "burst":
        client.set_parameters([message] * 200)
    return client.set_parameters([message] * {"many": 1000, "burst": 200}.get(kind, 1))


def answered(kind: str, *given: Any) -> str:
    """An answer in words; empty if it has to be asked for again."""
    *about, answer = given
    if kind in ("get", "until"):
        value = str(parameter_value_to_python(answer.values[0]) if answer.values else None)
        return value if kind == "get" or value == about[1] else ""
    if kind == "list":
        return " ".join(sorted(answer.result.names))
    if kind == "describe":
        one = answer.descriptors[0]
        bounds = [*one.floating_point_range, *one.integer_range][0]
        return f"{one.description}: {bounds.from_value} to {bounds.to_value}"
    if kind == "insist" and not answer.results[0].successful:
        return ""
    return f"{answer.results[-1].successful} {answer.results[-1].reason}".strip()


def doctor() -> list[Node]:
    """Prints each message of diagnostics, as JSON."""
    from diagnostic_msgs.msg import DiagnosticArray

    own = rclpy.create_node("doctor")

    def heard(message: DiagnosticArray) -> None:
        every = {
            each.name: {
                "level": each.level[0],
                "message": each.message,
                "hardware_id": each.hardware_id,
                "values": {one.key: one.value for one in each.values},
            }
            for each in message.status
        }
        print(json.dumps(every | {"stamp": message.header.stamp.sec}), flush=True)

    own.create_subscription(DiagnosticArray, "/diagnostics", heard, 10)
    return [own]


def commander(topic: str, when: str) -> list[Node]:
    """Sends on a topic of commands: "now", or "later", once 20 messages of somebody have come."""
    node, came = rclpy.create_node("teleop"), []
    if when == "now":
        node.create_publisher(Float64MultiArray, topic, 10)

    def heard(_: Float64MultiArray) -> None:
        came.append(True)
        if len(came) == 20:
            node.create_publisher(Float64MultiArray, topic, 10)

    if when == "later":
        node.create_subscription(Float64MultiArray, topic, heard, 10)
    return [node]


def joints(*drivers: str) -> list[Node]:
    """Publishers of `/joint_states`: each text is `NODE=JOINT,...@HZ`, where each joint is at the
    number in its name; `@HZxN` ends after N messages that somebody reads. The first one reads
    commands, and says so once.
    """
    made, is_told = [], []

    def commanded(_: Float64MultiArray) -> None:
        if not is_told:
            print("commanded", flush=True)
        is_told.append(True)

    for text in drivers:
        (name, _, rest) = text.partition("=")
        names, _, rate = rest.partition("@")
        hz, _, count = rate.partition("x")
        made.append(Driver(name, names.split(","), float(hz), int(count or 10**9)))
    topic = "/forward_position_controller/commands"
    made[0].create_subscription(Float64MultiArray, topic, commanded, 10)
    return made


class Driver(Node):
    """Publishes the states of some joints, a number of messages once somebody reads them."""

    def __init__(self, name: str, joints: list[str], hz: float, count: int) -> None:
        super().__init__(name)
        self._joints, self._left = joints, count
        self._states = self.create_publisher(JointState, "/joint_states", 10)
        self.create_timer(1 / hz, self._tell)

    def _tell(self) -> None:
        if self._left:
            message = JointState(name=self._joints, position=[float(j[-1]) for j in self._joints])
            message.header.stamp = self.get_clock().now().to_msg()
            self._states.publish(message)
            self._left -= self._states.get_subscription_count()


GOAL_STATUS = {4: "succeeded", 5: "canceled", 6: "aborted"}
SERVERS: list[ActionServer] = []
NODES = {
    "asker": asker,
    "commander": commander,
    "doctor": doctor,
    "joints": joints,
    "latched": latched,
    "server": server,
    "tuner": tuner,
}


def main() -> None:
    """Run until somebody ends the process."""
    rclpy.init()
    name, *given = sys.argv[1:]
    executor = MultiThreadedExecutor(num_threads=4)
    for node in NODES[name](*given):
        executor.add_node(node)
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
