"""Devices behind ROS 2: all that is imported in the Python of the user's ROS.

Standard library and rclpy only, of Python 3.10 on. The device host loads `opening:devices`; what
the host itself imports is there, and nothing else of `specc_runtime` needs to be.
"""

LAST = -1
"""The number of a goal that is a safe output and outlives the run; others count from 1 on."""
OTHERS = "/others"
"""The name, among what the node reports, of those who send on topics that the run commands."""
WRONG = "/wrong"
"""The name, likewise, of what is known to be wrong and ends no run, by what it is about: why topics
whose first message is not awaited will not have one."""
PARAMETERS = "/parameters"
"""The name, likewise, of what others have asked constants to be: by their names the number of the
request, and the value. Under that name the node is told what they are, and the number of the last
request that is in it."""
DIAGNOSTICS = "/diagnostics"
"""The name, likewise, of the topic of that name among those that are published."""
DEFINED = "/defined"
"""The name, likewise, of the texts that define types of messages, by the types that were asked."""
