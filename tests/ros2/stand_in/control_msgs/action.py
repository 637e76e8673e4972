"""Actions of controllers, as control_msgs of Jazzy and Kilted has them."""

from fields import message

_MODULE = "control_msgs.action"
_POINT, _WHOLE = "trajectory_msgs/JointTrajectoryPoint", "trajectory_msgs/MultiDOFJointTrajectory"
_GRIPPED = {
    "position": "double",
    "effort": "double",
    "stalled": "boolean",
    "reached_goal": "boolean",
}


class FollowJointTrajectory:
    """A trajectory of joints."""

    Goal = message(
        _MODULE,
        "FollowJointTrajectory_Goal",
        trajectory="trajectory_msgs/JointTrajectory",
        multi_dof_trajectory=_WHOLE,
        path_tolerance="control_msgs/JointTolerance[]",
        component_path_tolerance="control_msgs/JointComponentTolerance[]",
        goal_tolerance="control_msgs/JointTolerance[]",
        component_goal_tolerance="control_msgs/JointComponentTolerance[]",
        goal_time_tolerance="builtin_interfaces/Duration",
    )
    Result = message(
        _MODULE, "FollowJointTrajectory_Result", error_code="int32", error_string="string"
    )
    Feedback = message(
        _MODULE,
        "FollowJointTrajectory_Feedback",
        header="std_msgs/Header",
        joint_names="string[]",
        desired=_POINT,
        actual=_POINT,
        error=_POINT,
    )


class GripperCommand:
    """A position with a largest effort."""

    Goal = message(_MODULE, "GripperCommand_Goal", command="control_msgs/GripperCommand")
    Result = message(_MODULE, "GripperCommand_Result", **_GRIPPED)
    Feedback = message(_MODULE, "GripperCommand_Feedback", **_GRIPPED)


class ParallelGripperCommand:
    """The state that joints are to have."""

    Goal = message(_MODULE, "ParallelGripperCommand_Goal", command="sensor_msgs/JointState")
    Result = message(
        _MODULE,
        "ParallelGripperCommand_Result",
        state="sensor_msgs/JointState",
        stalled="boolean",
        reached_goal="boolean",
    )
    Feedback = message(_MODULE, "ParallelGripperCommand_Feedback", state="sensor_msgs/JointState")
