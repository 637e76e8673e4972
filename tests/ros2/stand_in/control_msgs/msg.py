"""Parts of goals, as control_msgs of Jazzy and Kilted has them."""

from fields import message

_MODULE = "control_msgs.msg"

GripperCommand = message(_MODULE, "GripperCommand", position="double", max_effort="double")
JointTolerance = message(
    _MODULE,
    "JointTolerance",
    name="string",
    position="double",
    velocity="double",
    acceleration="double",
)
JointComponentTolerance = message(
    _MODULE,
    "JointComponentTolerance",
    joint_name="string",
    component="uint16",
    position="double",
    velocity="double",
    acceleration="double",
)
