"""Devices behind ROS 2: topics and what their messages are in a specification.

`host` is imported in the Python of the user's ROS, all else in that of the agent, without ROS.
"""
