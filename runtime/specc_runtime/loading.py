"""Finding what a run needs by name: the generated system, its plant, the scene and the judge."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

from specc_runtime.examination import examine, refusal, shortcomings
from specc_runtime.extras import remedy
from specc_runtime.faults import Fault, JudgeFailed, PlantFailed, SceneFailed, StepFailed
from specc_runtime.forms import Layout
from specc_runtime.options import Options, UsageError
from specc_runtime.plants.errors import PlantError
from specc_runtime.system import System


def load_system(
    directory: str | Path, base: str | Path = ".", *, check_operators: bool = False
) -> System:
    """The system of a generated package, at its beginning, with files relative to `base`.

    `base` is the folder of the specification, where modules that are nowhere else are looked for,
    but for an empty text.
    `check_operators` has every call of an operator examined (see `specc_runtime.examination`).

    Raises UsageError when there is no such package or a file that it names is missing, StepFailed
    when a constant cannot be computed.
    """
    package = Path(directory).resolve()
    if not (package / "system.py").is_file():
        raise UsageError(f"{directory} is not a generated system: it has no system.py")
    _BESIDE.put(os.path.realpath(base) if str(base) else "")
    module = _import(package)
    if check_operators:
        inside = f"{module.__package__}."
        for part in [m for name, m in sys.modules.items() if name.startswith(inside)]:
            examine(part)
    try:
        system = module.build(str(base))
    except OSError as error:
        raise UsageError(f"{error.filename or base}: {error.strerror or error}") from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # operators may raise anything
        raise _construction_failed(error, module.__name__) from error
    if not isinstance(system, System):
        raise UsageError(f"{directory}: build() does not return a system")
    return system


def timed(options: Options, system: System) -> Options:
    """The options, in real time where the plant keeps its own time; raises UsageError.

    A run that is operated by keys goes on as the clock does.
    """
    if options.bag is not None:
        if (plant := system.plant) and plant.ros2 is not None and plant.is_simulated:
            raise UsageError("--bag: a bag has topics, and nothing of what a simulation gives")
        return options  # which has its own time
    if system.plant is None or system.plant.ros2 is None:
        if options.ros_args:
            raise UsageError("--ros-args: the plant is not behind ROS 2, so there is no node")
        is_free = options.speed is None and not options.real_time
        return replace(options, speed=1.0) if options.keys and is_free else options
    _check_parameters(options.ros_args, [constant.name for constant in system.live])
    for option, value in (("--speed", options.speed), ("--from", options.resume)):
        if value is not None:
            raise UsageError(f"{option}: a robot behind ROS 2 goes on as the clock does")
    for option, wanted in (("--video", options.video), ("--viewer", options.viewer)):
        if wanted and not system.plant.is_simulated:  # before the robot is asked for anything
            raise UsageError(f"{option}: a robot behind ROS 2 cannot be drawn; try rviz")
    return replace(options, real_time=True)


def _check_parameters(ros_args: Sequence[str], live: Sequence[str]) -> None:
    """Raises UsageError if `-p` names what is no parameter of the node."""
    for option, text in pairwise(ros_args):
        name = text.partition(":=")[0].rpartition(":")[2]
        if option in ("-p", "--param") and name not in live:
            known = ", ".join(live) or "none"
            raise UsageError(
                f"--ros-args {option} {text}: {name} is no constant that may change; there are: "
                f"{known}. --set gives constants their values, and `use_sim_time` stands in the "
                "specification"
            )


class _Beside:
    """The folder of one specification, last on the path, so that it shadows no other module."""

    def __init__(self) -> None:
        self._folder = ""
        self._before = frozenset[str]()

    def put(self, folder: str) -> None:
        """Look here for modules, and no more beside an earlier specification."""
        if folder == self._folder in sys.path:
            return
        if self._folder and self._folder in sys.path:  # Python itself may look into ""
            sys.path.remove(self._folder)
            # Another specification may have modules of the same names beside it.
            for name in [n for n in sys.modules if n not in self._before and self._holds(n)]:
                del sys.modules[name]
        self._folder = ""
        if folder and folder not in map(os.path.realpath, sys.path):
            self._folder, self._before = folder, frozenset(sys.modules)
            sys.path.append(folder)

    def _holds(self, name: str) -> bool:
        spec = getattr(sys.modules.get(name.partition(".")[0]), "__spec__", None)
        places = (spec.submodule_search_locations or [spec.origin or ""]) if spec else []
        return any(os.path.dirname(place) == self._folder for place in places)


_BESIDE = _Beside()


def load_layouts(system: System) -> Mapping[str, Layout]:
    """How the values of each subsystem look in recordings.

    Raises UsageError for a package that does not say so, or whose codecs cannot be loaded.
    """
    package = type(system.subsystems[0].subsystem).__module__.rpartition(".")[0]
    try:
        layouts: Mapping[str, Layout] = import_module(f"{package}.layouts").LAYOUTS
    except (Exception, SystemExit) as error:  # modules of codecs may raise anything
        raise UsageError(f"cannot load how values are recorded: {_reason(error)}") from error
    return layouts


def made(role: str, path: str, protocol: type, but: str = "", /, **arguments: Any) -> Any:
    """What `module:name` makes of the arguments, which are given by position.

    Raises UsageError, with the role and the path, if there is no such name, it cannot be called so,
    or the result cannot be called as the protocol says, `but` one method; the fault of the role if
    it raises.
    """
    named = f"the {role} {path!r}"
    make = _named(path, named)
    if not callable(make):
        raise UsageError(f"{named} cannot be called")
    if why := refusal(make, tuple(arguments)):
        raise UsageError(f"{named} {why}")
    try:
        thing = make(*arguments.values())
    except (PlantError, UsageError, KeyboardInterrupt):
        raise
    except BaseException as error:  # the user's own code may raise anything
        raise _failed(role, path, error) from error
    if lacking := shortcomings(thing, protocol, but):
        raise UsageError(f"{named} {'; '.join(lacking)}")
    return thing


def is_simulated(path: str) -> bool:
    """Whether the plant at `module:name` says that it is `simulated`; raises UsageError."""
    return bool(getattr(_named(path, f"the plant {path!r}"), "simulated", False))


def _failed(role: str, path: str, error: BaseException) -> Fault:
    if role == "plant":
        return PlantFailed(error)
    return SceneFailed(path, error) if role == "scene" else JudgeFailed(path, error)


def _named(path: str, named: str) -> Any:
    """The object at `module:name`."""
    module_name, _, name = path.partition(":")
    try:
        return getattr(import_module(module_name), name)
    except AttributeError as error:
        raise UsageError(f"cannot load {named}: {error}") from error
    except (Exception, SystemExit) as error:  # the user's own module may raise anything
        raise UsageError(f"cannot load {named}: {_reason(error)}") from error


def _construction_failed(error: BaseException, system: str) -> StepFailed:
    """The fault of a subsystem of the module `system` whose constants could not be computed."""
    package = system.rpartition(".")[0]
    for frame, _ in reversed(list(traceback.walk_tb(error.__traceback__))):
        module = str(frame.f_globals.get("__name__", ""))
        if module.startswith(f"{package}.") and module != system:
            name = getattr(frame.f_locals.get("self"), "name", "")
            return StepFailed(name, "", error, module)
    return StepFailed("", "", error)


def _reason(error: BaseException) -> str:
    """What is wrong with the user's own modules, and what would help."""
    if isinstance(error, ModuleNotFoundError):
        return remedy(error)
    if isinstance(error, ImportError | SyntaxError):
        return str(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"


def _import(package: Path) -> ModuleType:
    """The module `system` of a package, which gets a name that no module of anybody else has."""
    if not package.name.isidentifier():
        raise UsageError(f"{package} cannot be imported: {package.name!r} is not a name")
    name = f"generated_{package.name}"
    for known in [m for m in list(sys.modules) if m == name or m.startswith(f"{name}.")]:
        del sys.modules[known]
    spec = ModuleSpec(name, None, is_package=True)
    spec.submodule_search_locations = [str(package)]
    sys.modules[name] = module_from_spec(spec)
    try:
        return import_module(f"{name}.system")
    except (Exception, SystemExit) as error:  # modules of operators may raise anything
        raise UsageError(
            f"cannot import the operators of {package.name}: {_reason(error)}"
        ) from error
