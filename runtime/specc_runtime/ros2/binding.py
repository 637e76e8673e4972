"""What generated code says of a plant behind ROS 2: its node and the topics of its devices."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from specc_runtime.ros2.host import DIAGNOSTICS as _DIAGNOSTICS

Shape = Literal[
    "arrival",
    "camera",
    "depth",
    "image",
    "joints",
    "message",
    "pose",
    "record",
    "records",
    "scalar",
    "trajectory",
    "transform",
    "tuple",
    "twist",
    "vector",
    "vector3",
    "wrench",
]
"""What the part of a message that has the value consists of; see `specc_runtime.ros2.messages`."""


_OF_CALLS = ("interface", "part", "when_busy", "answer_within_s")


@dataclass(frozen=True, slots=True)
class Ros2Topic:
    """One element of a device, and the messages that it is read from or sent as.

    Attributes:
        name: of the element, `agent.E.device.element`.
        topic: its name in ROS, resolved in the namespace of the node.
        type: of the messages, `package/Type`.
        shape: what the value is made of; "message" is the whole, for a function of `through`.
        path: the fields that lead to it, `pose.pose`; empty if it is the message itself.
        commanded: whether messages are sent, and not read.
        joints: names of joints, in the order of the vector's elements.
        frames: fields that hold a coordinate frame, and the frame that they must have.
        qos: options of the quality of service that are not the usual ones.
        is_number: the vector is a number, of one joint.
        interface: "action", "action_server", "service" or "service_server", whose name and type
            then stand for those of a topic.
        part: of such an interface: "goal", "status", "feedback", "result", "request", "cancel" or
            "response".
        when_busy: of a request to an action server: whether it is to "reject", "queue" or "preempt"
            while another goal is pursued.
        answer_within_s: of a request: how long whoever asks waits for the answer.
        between: frames of ROS, from the first to the second of which tf2 has the transform.
    """

    name: str
    topic: str
    type: str
    shape: Shape
    path: str = ""
    commanded: bool = False
    joints: tuple[str, ...] = ()
    frames: tuple[tuple[str, str], ...] = ()
    qos: tuple[tuple[str, str | int], ...] = ()
    is_number: bool = False
    interface: str = ""
    part: str = ""
    when_busy: str = "reject"
    answer_within_s: float = 1.0
    between: tuple[str, ...] = ()

    @property
    def is_call(self) -> bool:
        """Whether it is a part of an action or a service that the agent calls."""
        return self.interface in ("action", "service")

    @property
    def config(self) -> dict[str, Any]:
        """What the node is told of it."""
        keys = (
            *("name", "topic", "type", "commanded", "shape", "path", "joints", "between"),
            *_OF_CALLS,
        )
        every = asdict(self)
        field = self.path if self.shape == "joints" else ""
        return {key: every[key] for key in keys} | {"qos": dict(self.qos), "field": field}


@dataclass(frozen=True, slots=True)
class Ros2Published:
    """What others can watch: an `output` of a subsystem, or its state if that is empty."""

    subsystem: str
    output: str
    topic: Ros2Topic


@dataclass(frozen=True, slots=True)
class Ros2:
    """The node behind which the devices are.

    `node` is its name, with its namespace if it has one: `/cell/irp`. `python` runs it: that of
    the user's ROS. `wait_s` is how long topics may have no first message, or nobody who reads
    them. With `use_sim_time` the time is that of `/clock`, and with `diagnostics` others learn
    how each subsystem goes on.
    """

    node: str
    topics: tuple[Ros2Topic, ...] = ()
    python: str = "python3"
    wait_s: float = 5.0
    use_sim_time: bool = False
    published: tuple[Ros2Published, ...] = ()
    diagnostics: bool = False

    @property
    def elements(self) -> frozenset[str]:
        """Names of the elements that have topics."""
        return frozenset([topic.name for topic in self.topics])

    @property
    def config(self) -> dict[str, Any]:
        """What the node is told: plain data."""
        namespace, _, name = self.node.rpartition("/")
        return {
            "node": name,
            "namespace": namespace,
            "use_sim_time": self.use_sim_time,
            "wait_s": self.wait_s,
            "topics": [topic.config for topic in self.topics],
            "published": [
                *_watched(self.published),
                *([DIAGNOSTICS.config] if self.diagnostics else []),
            ],
        }


CLOCK = "/clock"
"""The name of simulated time among what the node reports, s."""
CHANGES = Ros2Topic("~/changes", "~/changes", "std_msgs/String", "scalar", "data", commanded=True)
"""A text for each change of a state that is published: JSON, with `subsystem`, `from`, `to` and
`time_s`, that of the run."""

DIAGNOSTICS = Ros2Topic(
    _DIAGNOSTICS, _DIAGNOSTICS, "diagnostic_msgs/DiagnosticArray", "message", commanded=True
)


def _watched(published: tuple[Ros2Published, ...]) -> list[dict[str, Any]]:
    """The topics; who comes late gets the last state, which may have been for long."""
    latched = {"qos": {"durability": "transient_local"}}
    found = [each.topic.config | ({} if each.output else latched) for each in published]
    return [*found, CHANGES.config] if published else []
