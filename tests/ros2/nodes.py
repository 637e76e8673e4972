"""Other nodes of the graph, each in a process of its own: run by a Python of ROS, without specc.

The first argument names the node, the others are its own.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from random import Random
from typing import Any

import rclpy
import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
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
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci, NestedMessage
from test_msgs.msg import Nested
from trajectory_msgs.msg import JointTrajectory


def latched(topic: str) -> list[Node]:
    """Sends one message and keeps it for those who come late."""
    node = rclpy.create_node("safety")
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(Bool, topic, qos).publish(Bool(data=True))
    return [node]


def lamp(topic: str) -> list[Node]:
    """Sends one message of a type that few have, again and again."""
    node, message = rclpy.create_node("lamp"), Nested()
    message.basic_types_value.float64_value = 3.0
    publisher = node.create_publisher(Nested, topic, 10)
    node.create_timer(0.05, lambda: publisher.publish(message))
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


def twice(action: str) -> list[Node]:
    """Succeeds with twice the numbers of each goal."""
    node = rclpy.create_node("twice")

    def pursue(handle: ServerGoalHandle) -> NestedMessage.Result:
        goal, result = handle.request, NestedMessage.Result()
        result.nested_field.float64_value = 2 * goal.nested_field.float64_value
        time = goal.nested_field_no_pkg.duration_value
        total = 2 * (time.sec * 10**9 + time.nanosec)
        sec, nanosec = divmod(total, 10**9)
        result.nested_field_no_pkg.duration_value.sec = sec
        result.nested_field_no_pkg.duration_value.nanosec = nanosec
        print(goal.nested_field.bool_value, total, flush=True)
        handle.succeed()
        return result

    SERVERS.append(ActionServer(node, NestedMessage, action, pursue))
    return [node]


def follower(topic: str) -> list[Node]:
    """Joints that are at the points of the last trajectory, each at its time, and at 0 before."""
    node, at = rclpy.create_node("follower"), {"q2": 0.0, "q1": 0.0}
    states = node.create_publisher(JointState, "/joint_states", 10)
    left: list[tuple[float, dict[str, float]]] = []

    def receive(message: JointTrajectory) -> None:
        now_s = time.monotonic()
        for point in message.points:
            due_s = point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
            where = dict(zip(message.joint_names, point.positions, strict=True))
            print(due_s, where, *point.velocities, flush=True)
            left.append((now_s + due_s, where))

    def tell() -> None:
        while left and left[0][0] < time.monotonic():
            at.update(left.pop(0)[1])
        state = JointState(name=list(at), position=list(at.values()))
        state.header.stamp = node.get_clock().now().to_msg()
        states.publish(state)

    node.create_subscription(JointTrajectory, topic, receive, 10)
    node.create_timer(0.02, tell)
    return [node]


def heard(node: Node, state: str, told: Callable[[str], None]) -> None:
    """Have the states told of a machine that is published as `state`."""
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(String, state, lambda message: told(message.data), qos)


def moody(state: str, silent: str) -> list[Node]:
    """Publishes the state of q1 and a load, but for the time in which a machine is in a state.

    The state of q2 comes from another node, which goes on.
    """
    node = Driver("moody", ["q1"], 50.0, 10**9)
    loads = node.create_publisher(Float64, "/load", 10)
    node.create_timer(0.02, lambda: None if node.is_silent else loads.publish(Float64(data=3.0)))
    heard(node, state, lambda name: setattr(node, "is_silent", name == silent))
    return [node, Driver("steady", ["q2"], 50.0, 10**9)]


def mortal(action: str, state: str, waiting: str, *lives: str) -> list[Node]:
    """A server that ends when it has a goal, and says so: it is another node from then on.

    That one is there at once, or, where the life was to "leave", when the machine is in its state
    `waiting` for the second time since then. The last life, "serve", lets goals succeed.
    """
    keeper, left, waits = rclpy.create_node("keeper"), list(lives), []
    server: list[tuple[Node, ActionServer]] = []
    goals: list[ServerGoalHandle] = []

    def begin() -> None:
        node = rclpy.create_node("gripper")
        is_last = left[0] == "serve"
        begun = ServerGoalHandle.execute if is_last else goals.append
        serving = ActionServer(node, Fibonacci, action, pursue, handle_accepted_callback=begun)
        server.append((node, serving))
        EXECUTOR[0].add_node(node)

    def pursue(handle: ServerGoalHandle) -> Fibonacci.Result:
        handle.succeed()
        print("succeed", flush=True)
        return Fibonacci.Result(sequence=[handle.request.order])

    def look() -> None:
        if goals:
            goals.clear()
            node, serving = server.pop()
            EXECUTOR[0].remove_node(node)
            serving.destroy()
            node.destroy_node()
            waits.clear()
            life = left.pop(0)
            print(life, flush=True)
            if life == "swap":
                begin()
        elif not server and waits.count(waiting) > 1:
            begin()

    heard(keeper, state, waits.append)
    keeper.create_timer(0.05, look)
    begin()
    return [keeper]


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
        self.is_silent = False
        self._joints, self._left = joints, count
        self._states = self.create_publisher(JointState, "/joint_states", 10)
        self.create_timer(1 / hz, self._tell)

    def _tell(self) -> None:
        if self._left and not self.is_silent:
            message = JointState(name=self._joints, position=[float(j[-1]) for j in self._joints])
            message.header.stamp = self.get_clock().now().to_msg()
            self._states.publish(message)
            self._left -= self._states.get_subscription_count()


def switch(service: str, *outcomes: str) -> list[Node]:
    """Answers each call: `succeed` or `fail` at once, `slow` after 0.6 s; then it is gone."""
    node, left = rclpy.create_node("switch"), list(outcomes)

    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        outcome = left.pop(0)
        print(outcome, request.data, flush=True)
        if outcome == "slow":
            time.sleep(0.6)
        response.success = outcome == "succeed"
        if not left:
            node.create_timer(0.1, partial(node.destroy_service, served))
        return response

    served = node.create_service(SetBool, service, answer)
    return [node]


def presser(service: str, count: str) -> list[Node]:
    """Calls a `Trigger` so often, one call after another; says how each was answered."""
    node = rclpy.create_node("presser")
    client = node.create_client(Trigger, service)

    def press() -> None:
        assert client.wait_for_service(20.0)
        for _ in range(int(count)):
            print(client.call(Trigger.Request()).success, flush=True)
            time.sleep(0.7)
        print("done", flush=True)

    threading.Thread(target=press, daemon=True).start()
    return [node]


def client(action: str, count: str, seed: str) -> list[Node]:
    """Commands, pre-empts and cancels goals of an action, one by one; says what is wrong, and in
    the end how many goals have ended in each way.
    """
    node = rclpy.create_node("client")
    threading.Thread(target=Caller(node, action, int(count), Random(seed)).run).start()
    return [node]


class Caller:
    """Goals beyond `LARGEST` have to be rejected; those that succeed have their order as result."""

    LARGEST = 50

    def __init__(self, node: Node, action: str, count: int, random: Random) -> None:
        self._client = ActionClient(node, Fibonacci, action)
        self._count, self._random = count, random
        self._ends: Counter[str] = Counter()
        self._results: Counter[int] = Counter()
        """How many results each goal has had."""

    def run(self) -> None:
        """Have all goals end."""
        assert self._client.wait_for_server(20.0)
        preempted: list[Future] = []
        for number in range(self._count):
            order = 60 if number % 8 == 5 else self._random.randint(1, 9)
            handle = self._done(self._client.send_goal_async(Fibonacci.Goal(order=order)))
            if not handle.accepted:
                self._ends["rejected"] += 1
                continue
            if order > self.LARGEST:
                print(f"goal {number} of {order} was accepted", flush=True)
            result = handle.get_result_async()
            result.add_done_callback(partial(self._ended, number, order))
            time.sleep(self._random.uniform(0.0, 0.15))
            if self._random.random() < 0.3:
                preempted.append(result)
                continue
            if self._random.random() < 0.5:
                time.sleep(0.4)
            if not result.done():
                self._done(handle.cancel_goal_async())
            self._done(result)
        for result in preempted:
            if not result.done():
                time.sleep(1.0)
        known = self._ends.total()
        if known != self._count or set(self._results.values()) - {1}:
            print(f"{known} of {self._count} goals have ended: {self._results}", flush=True)
        print("ends", *sorted(self._ends), flush=True)
        print("done", flush=True)

    def _ended(self, number: int, order: int, done: Future) -> None:
        outcome, status = done.result(), GOAL_STATUS.get(done.result().status, "?")
        self._results[number] += 1
        self._ends[status] += 1
        if status == "succeeded" and list(outcome.result.sequence) != [order]:
            print(f"goal {number} of {order} has {outcome.result}", flush=True)

    def _done(self, future: Future) -> Any:
        """What has become of a future, which another thread completes."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        if not done.wait(10.0):
            print("a call hangs", flush=True)
            print("done", flush=True)
            raise SystemExit
        return future.result()


def customer(action: str, state: str, *orders: str) -> list[Node]:
    """Gives orders, one after the other, and says how each ends: its status, what the feedback said
    in turn, and the result. `2@STATE` is cancelled once the machine that is published as `state` is
    in that state.
    """
    node, states = rclpy.create_node("customer"), [""]
    client = ActionClient(node, Fibonacci, action)
    heard(node, state, states.append)

    def give(text: str) -> str:
        wanted, _, cancelled_in = text.partition("@")
        told: dict[int, None] = {}
        goal = Fibonacci.Goal(order=int(wanted))
        handle = waited(
            client.send_goal_async(goal, lambda one: told.update({one.feedback.sequence[0]: None}))
        )
        if not handle.accepted:
            return f"{text} rejected"
        result = handle.get_result_async()
        if cancelled_in:
            while states[-1] != cancelled_in:
                time.sleep(0.01)
            waited(handle.cancel_goal_async())
        end = waited(result)
        return " ".join(map(str, (text, GOAL_STATUS[end.status], *told, [*end.result.sequence])))

    def run() -> None:
        assert client.wait_for_server(20.0)
        for order in orders:
            print(give(order), flush=True)
        print("done", flush=True)

    threading.Thread(target=run, daemon=True).start()
    return [node]


def waited(future: Future) -> Any:
    """What has become of a future, which another thread completes."""
    while not future.done():
        time.sleep(0.01)
    return future.result()


GOAL_STATUS = {4: "succeeded", 5: "canceled", 6: "aborted"}
SERVERS: list[ActionServer] = []
EXECUTOR: list[MultiThreadedExecutor] = []
NODES = {
    "asker": asker,
    "client": client,
    "commander": commander,
    "customer": customer,
    "doctor": doctor,
    "follower": follower,
    "joints": joints,
    "lamp": lamp,
    "latched": latched,
    "moody": moody,
    "mortal": mortal,
    "presser": presser,
    "server": server,
    "switch": switch,
    "tuner": tuner,
    "twice": twice,
}


def main() -> None:
    """Run until somebody ends the process."""
    rclpy.init()
    name, *given = sys.argv[1:]
    executor = MultiThreadedExecutor(num_threads=4)
    EXECUTOR.append(executor)
    for node in NODES[name](*given):
        executor.add_node(node)
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
