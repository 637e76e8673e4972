"""The table of messages of ROS 2: which of their fields hold a value, of which shape and unit.

The units of messages are those of REP 103: an element in another unit is another quantity, since
all numbers of a running system are SI's. How parts of messages are read and written is in the
runtime, by the names of shapes that are chosen here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.model.units import METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND, Unit, parse_unit
from specc.reachable import grouped

FRAME, CHILD = "header.frame_id", "child_frame_id"
"""Fields that hold coordinate frames."""


@dataclass(frozen=True, slots=True)
class MessagePart:
    """A part of messages that is the value of elements of some types.

    `unit` is that of numbers, None where it is not said; `frame` and `child` are the fields of the
    coordinate frames that the value is in. A part that is not `sent` is only read, and one that is
    a record is only sent: `fields` are those that it may have, with their units. `scalar` is that
    of `std_msgs`, unless it follows from the message.
    """

    shape: str
    path: str = ""
    unit: Unit | None = None
    frame: str = ""
    child: str = ""
    sent: bool = True
    fields: tuple[tuple[str, tuple[Unit, ...]], ...] = ()
    scalar: str = ""


_INTS = [f"{sign}{bits}" for sign in ("Int", "UInt") for bits in (8, 16, 32, 64)]
_FLOATS = ("Float32", "Float64")
_OF_JOINTS = {
    "position": (RADIAN, METRE),
    "velocity": (RADIAN / SECOND, METRE / SECOND),
    "effort": (NEWTON_METRE, NEWTON),
}
JOINT_STATE = "sensor_msgs/JointState"
JOINTS = ("joints", "trajectory")
"""Shapes whose numbers belong to joints that have names."""
_POINT = (
    ("positions", _OF_JOINTS["position"]),
    ("velocities", _OF_JOINTS["velocity"]),
    ("accelerations", (RADIAN / SECOND**2, METRE / SECOND**2)),
    ("effort", _OF_JOINTS["effort"]),
    ("time_from_start", (SECOND,)),
)
"""Fields of a point of a trajectory."""
TIME_OF_POINT = "time_from_start"
NEEDED_IN_POINTS = ("positions", TIME_OF_POINT)
"""Without a time, a controller would jump there."""


def _table() -> Iterator[tuple[str, MessagePart]]:
    """Parts by the type of messages; one type may have several."""
    for name in ("Bool", "String", "Char", *_INTS, *_FLOATS):
        yield f"std_msgs/{name}", MessagePart("scalar", "data")
    for name in _FLOATS:
        yield f"std_msgs/{name}MultiArray", MessagePart("vector", "data")
    for name in _INTS:
        yield f"std_msgs/{name}MultiArray", MessagePart("tuple", "data")
    for field, units in _OF_JOINTS.items():
        yield from ((JOINT_STATE, MessagePart("joints", field, unit)) for unit in units)
    yield "trajectory_msgs/JointTrajectory", MessagePart("trajectory", fields=_POINT)
    yield from _geometry()
    yield "nav_msgs/Odometry", MessagePart("pose", "pose.pose", frame=FRAME, child=CHILD)
    yield "nav_msgs/Odometry", MessagePart("twist", "twist.twist", frame=CHILD)
    yield "std_msgs/Empty", MessagePart("arrival", sent=False)
    yield "sensor_msgs/Range", MessagePart("scalar", "range", METRE)
    yield "sensor_msgs/Imu", MessagePart("vector3", "angular_velocity", RADIAN / SECOND)
    yield "sensor_msgs/Imu", MessagePart("vector3", "linear_acceleration", METRE / SECOND**2)
    yield "sensor_msgs/Image", MessagePart("image")
    yield "sensor_msgs/Image", MessagePart("depth")
    yield "sensor_msgs/CameraInfo", MessagePart("camera", "k", parse_unit("px"), sent=False)


def _geometry() -> Iterator[tuple[str, MessagePart]]:
    """Of `geometry_msgs`, as they are and with a header."""
    for name, shape, unit in (
        ("Pose", "pose", None),
        ("Twist", "twist", None),
        ("Wrench", "wrench", None),
        ("Point", "vector3", METRE),
        ("Vector3", "vector3", None),
    ):
        field = "vector" if name == "Vector3" else name.lower()
        yield f"geometry_msgs/{name}", MessagePart(shape, "", unit)
        yield f"geometry_msgs/{name}Stamped", MessagePart(shape, field, unit, frame=FRAME)
    for name, shape in (("Pose", "pose"), ("Twist", "twist")):
        lower = f"{name.lower()}.{name.lower()}"
        full = f"geometry_msgs/{name}WithCovariance"
        yield full, MessagePart(shape, name.lower())
        yield f"{full}Stamped", MessagePart(shape, lower, frame=FRAME)
    yield "geometry_msgs/Transform", MessagePart("transform")
    stamped = MessagePart("transform", "transform", frame=FRAME, child=CHILD)
    yield "geometry_msgs/TransformStamped", stamped


MESSAGES = {name: tuple(parts) for name, parts in grouped(_table()).items()}
"""The parts of messages, by their types as `package/Type`."""


def short_message_type(message: str) -> str:
    """`package/Type` of a type that may be written `package/msg/Type`."""
    return message.replace("/msg/", "/").replace("/action/", "/").replace("/srv/", "/")


def scalar(message: str) -> str:
    """The scalar of `std_msgs` that stands for those of a message."""
    name = message.partition("/")[2]
    if name in ("String", "Bool", "Empty"):
        return name.replace("Empty", "Bool")
    return "Float64" if name in (*_FLOATS, "Range") else "Int64"


# Of actions and services.


_SUCCESS = MessagePart("scalar", "success", scalar="Bool")
_EXPLANATION = MessagePart("scalar", "message", sent=False, scalar="String")
_CODE = MessagePart("scalar", "error_code", scalar="Int64")


def _calls() -> Iterator[tuple[tuple[str, str], MessagePart]]:
    """Parts of messages by types of actions and services, and what of these the messages are."""
    called = MessagePart("arrival", scalar="Bool")
    for name in ("Empty", "Trigger"):
        yield (f"std_srvs/{name}", "request"), called
    yield ("std_srvs/Empty", "response"), called
    yield ("std_srvs/SetBool", "request"), MessagePart("scalar", "data", scalar="Bool")
    for name in ("SetBool", "Trigger"):
        yield from (((f"std_srvs/{name}", "response"), part) for part in (_SUCCESS, _EXPLANATION))
    yield from ((("control_msgs/FollowJointTrajectory", part), of) for part, of in _trajectories())
    yield from _grippers()
    yield from ((("nav2_msgs/NavigateToPose", part), of) for part, of in _navigation())


def _trajectories() -> Iterator[tuple[str, MessagePart]]:
    yield "goal", MessagePart("trajectory", "trajectory", fields=_POINT)
    for of in ("actual", "desired", "error"):
        for field in ("positions", "velocities", "effort"):
            for unit in dict(_POINT)[field]:
                yield "feedback", MessagePart("joints", f"{of}.{field}", unit, sent=False)
    yield "result", _CODE
    yield "result", MessagePart("scalar", "error_string", scalar="String")


def _grippers() -> Iterator[tuple[tuple[str, str], MessagePart]]:
    """The goal of `ParallelGripperCommand`, and the state that it tells, are joint states."""
    name, of_joints = "control_msgs/GripperCommand", "control_msgs/ParallelGripperCommand"
    goal = (("position", _OF_JOINTS["position"]), ("max_effort", _OF_JOINTS["effort"]))
    yield (name, "goal"), MessagePart("record", "command", fields=goal)
    for unit in _OF_JOINTS["position"]:
        yield (name, "goal"), MessagePart("scalar", "command.position", unit, scalar="Float64")
        yield (of_joints, "goal"), MessagePart("joints", "command.position", unit)
    for part in ("feedback", "result"):
        for field in ("position", "effort"):
            for unit in _OF_JOINTS[field]:
                yield (name, part), MessagePart("scalar", field, unit, scalar="Float64")
                yield (of_joints, part), MessagePart("joints", f"state.{field}", unit)


def _navigation() -> Iterator[tuple[str, MessagePart]]:
    yield "goal", MessagePart("pose", "pose.pose", frame=f"pose.{FRAME}")
    here = MessagePart("pose", "current_pose.pose", frame=f"current_pose.{FRAME}")
    yield "feedback", here
    yield "feedback", MessagePart("scalar", "distance_remaining", METRE, scalar="Float64")
    for field in ("estimated_time_remaining", "navigation_time"):
        yield "feedback", MessagePart("scalar", field, SECOND, scalar="Float64")
    yield "feedback", MessagePart("scalar", "number_of_recoveries", scalar="Int64")
    yield "result", _CODE
    yield "result", MessagePart("scalar", "error_msg", scalar="String")


CALL_MESSAGES = {key: tuple(parts) for key, parts in grouped(_calls()).items()}
"""The parts of messages, by the types of actions and services and what of these they are."""
