"""The action of navigation, as nav2_msgs of Jazzy and Kilted has it."""

from fields import message

_MODULE = "nav2_msgs.action"


class NavigateToPose:
    """A pose to go to."""

    Goal = message(
        _MODULE, "NavigateToPose_Goal", pose="geometry_msgs/PoseStamped", behavior_tree="string"
    )
    Result = message(_MODULE, "NavigateToPose_Result", error_code="uint16", error_msg="string")
    Feedback = message(
        _MODULE,
        "NavigateToPose_Feedback",
        current_pose="geometry_msgs/PoseStamped",
        navigation_time="builtin_interfaces/Duration",
        estimated_time_remaining="builtin_interfaces/Duration",
        number_of_recoveries="int16",
        distance_remaining="float",
    )
