"""Devices behind ROS 2: all that is imported in the Python of the user's ROS.

Standard library and rclpy only, of Python 3.10 on. The device host loads `opening:devices`; what
the host itself imports is there, and nothing else of `specc_runtime` needs to be.
"""

LAST = -1
"""The number of a goal that is a safe output and outlives the run; others count from 1 on."""
OTHERS = "/others"
"""The name, among what the node reports, of those who send on topics that the run commands."""
WRONG = "/wrong"
"""The name, likewise, of why topics whose first message is not awaited will not have one."""
