"""Bags of ROS 2: runs written as bags, and bags that specifications are run on."""
