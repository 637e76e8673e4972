"""In the Python of a ROS: messages of every type become plain data and the same messages again."""

from __future__ import annotations

import importlib
import inspect
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

RUNTIME = Path(__file__).parents[2] / "runtime" / "specc_runtime"
spec = spec_from_file_location(
    "specc_runtime", RUNTIME / "__init__.py", submodule_search_locations=[str(RUNTIME)]
)
assert spec is not None and spec.loader is not None
sys.modules["specc_runtime"] = module_from_spec(spec)
spec.loader.exec_module(sys.modules["specc_runtime"])

PACKAGES = "builtin_interfaces std_msgs geometry_msgs sensor_msgs trajectory_msgs test_msgs"


def types(package: str) -> list[Any]:
    found = vars(importlib.import_module(f"{package}.msg")).values()
    return [cls for cls in found if inspect.isclass(cls) and hasattr(cls, "SLOT_TYPES")]


def main() -> None:
    from specc_runtime.hosting.devices import DeviceError
    from specc_runtime.ros2.host.plain import fill, interface, interface_name, plain

    count = 0
    for package in PACKAGES.split():
        for cls in types(package):
            assert interface(interface_name(cls)) is cls
            for message in (cls(), *examples(cls)):
                assert fill(cls(), plain(message)) == message, interface_name(cls)
            count += 1
    array = interface("std_msgs/Float64MultiArray")
    assert fill(array(), {"data": [1, 2.5]}) == array(data=[1.0, 2.5])
    for name, data, said in (
        ("Float64", {"dato": 1.0}, "has no field `dato`"),
        ("Float64", {"data": "x"}, "`data` is double"),
        ("Float64MultiArray", {"data": [1.0, True]}, "`data` is sequence<double>"),
        ("Float64MultiArray", {"data": [1.0, 10**400]}, "`data` is sequence<double>"),
        ("Float64MultiArray", {"data": 1.0}, "`data` is sequence<double>"),
    ):
        try:
            fill(interface(f"std_msgs/{name}")(), data)
        except DeviceError as error:
            assert said in str(error), error
        else:
            raise AssertionError(said)
    print(count, "types")


def examples(cls: Any) -> list[Any]:
    """Messages in which lists and bytes are."""
    if cls.__name__ == "JointState":
        return [cls(name=["a", "b"], position=[1.0, 2.0])]
    if cls.__name__ == "Image":
        return [cls(data=[1, 2, 255], encoding="rgb8")]
    if cls.__name__ == "JointTrajectory":
        from trajectory_msgs.msg import JointTrajectoryPoint

        point = JointTrajectoryPoint(positions=[1.0, 2.0])
        return [cls(joint_names=["a", "b"], points=[point, point])]
    return []


main()
