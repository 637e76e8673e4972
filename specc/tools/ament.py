"""A system as a package of ROS 2, of the build type `ament_python`: colcon builds it.

Beside the generated code it has what that reads: modules that lie beside the specification, and the
files that this names. So it is the same wherever it is built.
"""

from __future__ import annotations

import ast
import glob
import os
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath

from specc.analysis.ros2 import MessageTypeMismatch, published_value
from specc.diagnostics import Diagnostic
from specc.emit import fill, format_files
from specc.lower.names import in_docstring, literal, one_line
from specc.lower.nodes import number
from specc.mjcf.model import ModelError
from specc.mjcf.reader import read_model
from specc.model.bindings import DIAGNOSTICS, Ros2
from specc.model.system import System
from specc.model.types import Real
from specc.model.units import DIMENSIONLESS
from specc.output import OutputFiles
from specc.pipeline import Build
from specc.policy import allowed_paths
from specc.read import AllowedPaths
from specc.source import Place
from specc.tools.sweep.sweeping import inputs_of

_NAME = re.compile(r"(?!.*__)[a-z][a-z0-9_]*[a-z0-9]")
"""Of a package: what `ros2 pkg create` takes, and colcon without a warning."""
_FILES = "files"
"""The folder in the module of what runs read."""
_ALWAYS = ("launch", "launch_ros", "rclpy")
"""Packages that the launch file and the node need."""
_META = {
    "version": "0.0.0",
    "maintainer": "whoever maintains the specification",
    "email": "nobody@example.com",
    "license": "that of the specification",
}
"""What a package has to say and no specification does."""


@dataclass(frozen=True, slots=True)
class AmentPackage:
    """The files of a package, by their paths in it; none if there are `faults`."""

    files: OutputFiles
    faults: tuple[Diagnostic, ...] = ()


def ament_package(spec: str, built: Build) -> AmentPackage:
    """The package of what was built of the specification at `spec`.

    Faults: it cannot be one (E0095), or a link leads out of the project (E0021). Raises OSError.
    """
    system = built.result.system
    assert system is not None, "it was built"
    ros2 = None if system.plant is None else system.plant.ros2
    place = Place(spec, ("system",))
    if ros2 is None:
        message = "only a plant behind ROS 2 can be a package of ROS 2"
        where = Place(spec, ("plant",)) if system.plant else place
        hint = "build it without --ament, or say `ros2: {node: NAME}` in `plant`"
        return AmentPackage({}, (Diagnostic("E0095", message, where, help=hint),))
    if not _NAME.fullmatch(system.name):
        message = f"`{system.name}` cannot be the name of a package of ROS 2"
        hint = "small letters, digits and single underscores between them, as in `bin_cell`"
        return AmentPackage({}, (Diagnostic("E0095", message, place, help=hint),))
    reach = allowed_paths(spec)
    base = os.path.dirname(spec) or "."
    modules = [os.path.join(base, path) for path in _modules_beside(base, built, system)]
    paths = [*modules, *_files_of_models(base, system, reach)]
    named = [os.path.join(base, path) for _, path in system.files]
    if outside := [path for path in (*paths, *named) if not reach.contains(path)]:
        return AmentPackage({}, tuple(map(reach.link_finding, outside)))
    inputs = inputs_of(spec, built.result.sources, system, paths)
    module = f"{system.name}_agents"
    data = {f"{_FILES}/{PurePath(path).as_posix()}": raw for path, raw in inputs.files.items()}
    own_base = os.path.normpath(os.path.join(_FILES, inputs.base))
    if data and not any(name.startswith(f"{own_base}/") for name in data):
        data[f"{own_base}/.keep"] = b""  # paths of files begin in this folder
    files: dict[str, str | bytes] = {f"{module}/{name}": f for name, f in built.files.items()}
    files |= {f"{module}/{name}": raw for name, raw in data.items()}
    files |= _texts(spec, system, ros2, module, own_base, data)
    return AmentPackage(files)


def _texts(
    spec: str, system: System, ros2: Ros2, module: str, base: str, data: Iterable[str]
) -> dict[str, str]:
    """The files that make a package of a module with `data`."""
    name = system.name
    marker, launch_file = f"resource/{name}", f"launch/{name}.launch.py"
    namespace, _, node = ros2.node.rpartition("/")
    title, file = one_line(system.title or name), PurePath(spec).name
    installed = {
        "share/ament_index/resource_index/packages": marker,
        f"share/{name}": "package.xml",
        f"share/{name}/launch": launch_file,
    }
    parameters = [*_parameters(system)]
    config = f"config/{name}.yaml"
    if parameters:
        installed[f"share/{name}/config"] = config
    parts = {
        **_META,
        **{f"{key}_literal": literal(value) for key, value in _META.items()},
        "name": name,
        "name_literal": literal(name),
        "title": title,
        "title_literal": literal(title),
        "spec": in_docstring(file),
        "spec_in_comment": re.sub("-(?=-)", "- ", one_line(file)),
        "module_literal": literal(module),
        "base_literal": literal(base),
        "entry_point": literal(f"{name} = {module}.main:main"),
        "package_data": [literal(glob.escape(path)) for path in sorted(data)],
        "data_files": [(literal(folder), literal(path)) for folder, path in installed.items()],
        "node_literal": literal(node),
        "namespace_literal": literal(namespace),
        "parameters": parameters,
        "depends": sorted({*_ALWAYS, *_message_packages(system, ros2)} - {name}),
    }
    places = {
        "package.xml": "package.xml",
        "setup.cfg": "setup.cfg",
        "setup.py": "setup.py",
        "main.py": f"{module}/main.py",
        "node.launch.py": launch_file,
        **({"parameters.yaml": config} if parameters else {}),
    }
    texts = {template: fill(f"ament/{template}.j2", parts) for template in places}
    # In their places, the formatter would take `launch` for a module of this package.
    texts |= format_files({name: text for name, text in texts.items() if name.endswith(".py")})
    return {marker: "", **{places[template]: text for template, text in texts.items()}}


def _parameters(system: System) -> Iterator[dict[str, str]]:
    """The constants that may change: name, value in SI units, and what is said of them."""
    for constant in system.constants:
        if constant.initial is not None:
            type_ = constant.value.type
            value, *bounds = (
                number(each, type_).text
                for each in (constant.initial.value, *(constant.bounds or ()))
            )
            unit = ""
            if isinstance(type_, Real) and type_.unit != DIMENSIONLESS:
                unit = f" {type_.unit}"
            words = one_line(f"{constant.title or constant.name}, {' to '.join(bounds)}{unit}")
            yield {"name": constant.name, "value": value, "words": words}


def _message_packages(system: System, ros2: Ros2) -> Iterator[str]:
    """The packages of ROS that messages and transforms are of."""
    assert system.plant is not None, "it has a node"
    for binding in system.plant.bindings:
        if binding.message:
            yield binding.message.split("/")[0]
        if binding.tf:
            yield from ("tf2_msgs", "tf2_ros")
    for each in system.plant.published:
        if each.name == DIAGNOSTICS:
            yield "diagnostic_msgs"
        found = published_value(each, system)
        if not isinstance(found, MessageTypeMismatch):
            yield from (found.message.split("/")[0], "std_msgs")
    if ros2.use_sim_time:
        yield "rosgraph_msgs"


def _files_of_models(base: str, system: System, reach: AllowedPaths) -> Iterator[str]:
    """What the MJCF models are made of that the specification names for its operators."""
    for _, path in system.files:
        if path.endswith(".xml"):
            try:
                yield from read_model(os.path.join(base, path), reach).files.possible
            except ModelError:  # another kind of XML
                continue


# Modules beside the specification.


def _modules_beside(base: str, built: Build, system: System) -> list[str]:
    """Paths below `base` of what generated code imports from there, and of what that imports."""
    task = system.task
    by_name = (task.judge, task.scene) if task else ()
    waiting = [path.partition(":")[0] for path in by_name if path]
    for text in built.files.values():
        waiting += _imported(text, "")
    seen: set[str] = set()
    while waiting:
        for path in _files_of(base, waiting.pop()):
            if path not in seen:
                seen.add(path)
                package = os.path.dirname(path).replace(os.sep, ".")
                waiting += _imported(Path(base, path).read_bytes(), package)
    return sorted(seen)


def _imported(text: str | bytes, package: str) -> Iterator[str]:
    """Names of modules that the text of a module of a package may import.

    Nothing of what Python does not read: it says so when the package runs.
    """
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return
    around = package.split(".") if package else []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level <= len(around):
            above = around[: len(around) - node.level + 1] if node.level else []
            parts = [*above, *filter(None, [node.module])]
            yield from (".".join([*parts, alias.name]) for alias in node.names)


def _files_of(base: str, module: str) -> Iterator[str]:
    """The files below `base` that Python reads to import a module: packages come first.

    What Python itself has and the runtime come from elsewhere, whatever lies there.
    """
    parts = module.split(".")
    if parts[0] in sys.stdlib_module_names or parts[0] == "specc_runtime":
        return
    for count in range(1, len(parts) + 1):
        path = os.path.join(*parts[:count])
        candidates = (os.path.join(path, "__init__.py"), f"{path}.py")
        found = next((c for c in candidates if os.path.isfile(os.path.join(base, c))), None)
        if found is not None:
            yield found
        if not os.path.isdir(os.path.join(base, path)):
            return
