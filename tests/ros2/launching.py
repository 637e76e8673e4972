"""What `ros2 launch` does with a launch file of a package; of `launch` there are no wheels.

The names stand for those of `launch` and `launch_ros` that such files use.
"""

from __future__ import annotations

import runpy
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

Context = dict[str, str]


@dataclass(frozen=True)
class LaunchDescription:
    entities: Sequence[Any]


@dataclass(frozen=True)
class DeclareLaunchArgument:
    name: str
    default_value: str
    description: str

    def visit(self, context: Context) -> list[Any]:
        context.setdefault(self.name, self.default_value)
        return []


@dataclass(frozen=True)
class OpaqueFunction:
    function: Callable[[Context], list[Any]]

    def visit(self, context: Context) -> list[Any]:
        return self.function(context)


@dataclass(frozen=True)
class LaunchConfiguration:
    name: str

    def perform(self, context: Context) -> str:
        return context[self.name]


@dataclass(frozen=True)
class Node:
    package: str
    executable: str
    name: str
    namespace: str
    arguments: Sequence[str] = ()
    ros_arguments: Sequence[str] | None = None
    parameters: Sequence[str] | None = None
    output: str = "log"

    def command(self, prefix: Path) -> list[str]:
        """As `launch_ros` writes it: what it says itself comes last, behind a flag of its own."""
        program = str(prefix / "lib" / self.package / self.executable)
        own = ["-r", f"__node:={self.name}"]
        if self.namespace:
            own += ["-r", f"__ns:=/{self.namespace.removeprefix('/')}"]
        own += [word for file in self.parameters or () for word in ("--params-file", file)]
        given = ["--ros-args", *self.ros_arguments] if self.ros_arguments else []
        return [program, *self.arguments, *given, "--ros-args", *own]


MODULES = {
    "launch": {"LaunchContext": dict, "LaunchDescription": LaunchDescription},
    "launch.actions": {
        "DeclareLaunchArgument": DeclareLaunchArgument,
        "OpaqueFunction": OpaqueFunction,
    },
    "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration},
    "launch_ros": {},
    "launch_ros.actions": {"Node": Node},
}


def launched(file: Path, prefix: Path, **arguments: str) -> list[list[str]]:
    """The command lines that a launch file starts, of a package that is installed there."""
    modules = {}
    for name, members in MODULES.items():
        modules[name] = ModuleType(name)
        modules[name].__dict__.update(members)
    with patch.dict(sys.modules, modules):
        description = runpy.run_path(str(file))["generate_launch_description"]()
        waiting, nodes = [*description.entities], []
        while waiting:
            entity = waiting.pop(0)
            if isinstance(entity, Node):
                nodes.append(entity)
            else:
                waiting[:0] = entity.visit(arguments)
    return [node.command(prefix) for node in nodes]
