"""What is imported in the Python of ROS keeps to Python 3.10, and to what is there."""

from __future__ import annotations

import ast
import sys

import pytest

from tests.house.tree import Module, modules

HOST = [
    m for m in modules("runtime", "specc_runtime") if m.name.startswith("specc_runtime.ros2.host")
]
THEIRS = {"rcl_interfaces", "rclpy", "tf2_ros"}
ALLOWED = ("specc_runtime.hosting.devices", "specc_runtime.ros2.host")


@pytest.mark.parametrize("module", HOST, ids=lambda module: module.name)
def test_a_module_of_the_node_needs_only_python_and_ros(module: Module) -> None:
    for name in module.imports():
        package = name.split(".")[0]
        known = package in sys.stdlib_module_names or package in THEIRS
        assert known or name.startswith(ALLOWED), name


@pytest.mark.parametrize("module", HOST, ids=lambda module: module.name)
def test_a_module_of_the_node_is_python_3_10(module: Module) -> None:
    ast.parse(module.path.read_text(encoding="utf-8"), feature_version=(3, 10))
