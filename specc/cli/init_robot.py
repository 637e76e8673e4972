"""`specc init --model` and `--ros2`: a specification of what the runtime finds out about a robot.

It reads the model of the robot, or looks at the graph of ROS 2.
"""

from __future__ import annotations

import os
import shlex
from argparse import Namespace
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from specc.cli import streams
from specc.cli.new_files import creating, refuse_existing
from specc.cli.rewrite import rewrite_file
from specc.diagnostics import Diagnostic
from specc.lang.packages import PACKAGES
from specc.mjcf import Model, read_model
from specc.pipeline import Result, check_spec
from specc.policy import allowed_paths
from specc.read import ANYWHERE, AllowedPaths, read_file
from specc.refusal import Refused
from specc.source import real_path
from specc.tools.fmt import LayoutError
from specc.tools.importers.writing import PEERS, SpecNames
from specc.tools.starting import (
    ModelFacts,
    Robot,
    added,
    bound,
    by_mocap,
    document,
    facts_of,
    grouped,
    left_out,
    not_held,
    receptors,
)
from specc.tools.starting.ros2 import LISTENED, Devices, RosGraph, graph_from, proposal

PLANTS = "plants"
_MOST_SHOWN = 5
_WAIT_S = 2.0
_MOST_TOPICS = 200


def write(options: Namespace) -> list[Path]:
    """Write a specification, and the model below `PLANTS` where it lies outside.

    Returns the files that were written, the specification first. Raises Refused, OSError.
    """
    if options.ros2 is not None:
        return _of_ros2(options)
    adds = options.agent is not None and os.path.isfile(options.directory)
    return _added(options) if adds else _new(options)


def _legal(wish: str) -> str:
    name = SpecNames(PEERS).new(wish)
    if name != wish:
        raise Refused(f"nothing can be called {wish!r}; {name} would do")
    return name


def _checked(spec: Path, text: str) -> Result:
    """What the compiler finds in a specification with this text, its model being in place."""
    return check_spec(str(spec), texts={real_path(str(spec)): text})


def _is_error(finding: Diagnostic) -> bool:
    return finding.severity == "error"


# From a model.


def _new(options: Namespace) -> list[Path]:
    """Write a new specification; the files that were written, the specification first."""
    path, folder = options.model, Path(options.directory)
    model = _model(path)
    system = SpecNames(PEERS | PACKAGES).new(_name(path, model))
    spec = folder / f"{system}.yaml"
    facts = facts_of(path)
    plant, copies = _plant(options, model, facts, spec)
    refuse_existing(copies)
    name = system if options.agent is None else _legal(options.agent)
    robot = _robot(name, facts, model, options)
    text = document(robot, system, plant, _command(path))
    with creating(spec) as new:
        new.write(copies)
        _refuse_errors(_checked(spec, text), ())
        new.write({spec: text})
    _warn(robot)
    return [spec, *copies]


def _warn(robot: Robot) -> None:
    if line := not_held(robot.facts):
        streams.print_message(f"specc: {line}")


def _refuse_errors(result: Result, before: Iterable[Diagnostic]) -> None:
    """Refuse a specification that has errors, other than those that were there `before`."""
    left = Counter((each.code, each.message) for each in result.diagnostics if _is_error(each))
    left -= Counter((each.code, each.message) for each in before if _is_error(each))
    if left:
        found = list(left)
        shown = "".join(f"\n  {code}: {message}" for code, message in found[:_MOST_SHOWN])
        more = f"\n  and {len(found) - _MOST_SHOWN} more" if len(found) > _MOST_SHOWN else ""
        raise Refused(
            "nothing was written: the specification would have errors; change the model, or say "
            f"with --group which actuators it is about{shown}{more}"
        )


def _command(path: str) -> str:
    return f"specc init --model {os.path.basename(path)}"


def _added(options: Namespace) -> list[Path]:
    """Add an agent to a specification; the files that were written."""
    path, spec = options.model, Path(options.directory)
    name = _legal(options.agent)
    read, before = read_file(str(spec)), check_spec(str(spec))
    if not isinstance(read.data, dict) or not read.ok or before.system is None:
        raise Refused(f"{spec} is not a specification that can be read; `specc validate` says more")
    # One that cannot be read is in the text alone.
    written = read.data.get("agents")
    if name in _agents(before) or (isinstance(written, dict) and name in written):
        raise Refused(f"there is an agent {name} already; give another --agent")
    model, facts = _model(path), facts_of(path)
    plant, copies = _same_plant(read.data, options, model, facts, spec)
    refuse_existing(copies)
    robot = _robot(name, facts, model, options, bound(before.system))
    try:
        text = added(read.source.text, read.data, robot, plant, _command(path))
    except LayoutError:
        raise Refused(_not_added(spec, name)) from None
    with creating(spec) as new:
        new.write(copies)
        after = _checked(spec, text)
        if not {*_agents(before), name} <= _agents(after):
            raise Refused(_not_added(spec, name))
        _refuse_errors(after, before.diagnostics)
        new.commit(partial(rewrite_file, str(spec), text))
    _warn(robot)
    return [spec, *copies]


def _agents(result: Result) -> set[str]:
    return {agent.name for agent in result.system.agents} if result.system else set()


def _not_added(spec: Path, name: str) -> str:
    return (
        f"{name} cannot be added to {spec}, which is unchanged: write its sections as blocks, "
        "without braces around all of them, and nothing after a line of `...`"
    )


def _same_plant(
    data: Mapping[str, Any], options: Namespace, model: Model, facts: ModelFacts, spec: Path
) -> tuple[str, dict[Path, str | Path]]:
    """See `_plant`; a specification has one plant, in which all its agents are."""
    path = options.model
    plant = data.get("plant")
    named = plant.get("model") if isinstance(plant, dict) else None
    if not plant:
        return _plant(options, model, facts, spec)
    is_same = isinstance(named, str) and real_path(path) == real_path(str(spec.parent / named))
    if not isinstance(named, str) or not os.path.exists(path) or not is_same:
        shown = named if isinstance(named, str) else "made by Python"
        raise Refused(
            f"the plant of {spec} is {shown}, and a system has one plant: put the robot into that "
            "model with <attach>, then name that file with --model"
        )
    return named, {}


def _model(path: str) -> Model:
    if not os.path.isfile(path):
        raise Refused(f"there is no model {path}")
    model = read_model(path, ANYWHERE)
    if model.missing:
        raise Refused(f"{path} names {model.missing[0]}, which is not there")
    return model


def _robot(
    name: str, facts: ModelFacts, model: Model, options: Namespace, taken: Collection[str] = ()
) -> Robot:
    """The robot, without what others have (`taken`); an agent has named groups only, if any."""
    wanted = {_legal(each): text for each, text in options.group.items()}
    groups = grouped(facts, wanted, taken, guess=not (wanted and options.agent))
    found, refused = receptors(facts, model, taken)
    refused = {**facts.refused, **refused}
    for line in left_out(refused):
        streams.print_message(f"specc: left out: {line}")
    for line in by_mocap(facts):
        streams.print_message(f"specc: {line}")
    if not groups:
        raise Refused(_nothing_held(facts))
    return Robot(name, facts, groups, found, refused)


def _nothing_held(facts: ModelFacts) -> str:
    """Why a model gives nothing to write, and what to do."""
    if facts.actuators:
        return "all actuators of the model are driven already; nothing was written"
    if facts.thrusters:
        why = (
            "it flies: its actuators push at sites, and only a controller of its attitude holds it"
        )
        return f"{why}; nothing was written. docs/your_robot.md shows a start under `A drone`"
    hint = "" if facts.refused else "; add `<actuator>` with a drive for each joint"
    return f"the model has no actuator that can be held; nothing was written{hint}"


def _name(path: str, model: Model) -> str:
    stem = Path(path).stem
    return (model.name or stem).lower() if stem in ("robot", "model", "scene") else stem.lower()


def _plant(
    options: Namespace, model: Model, facts: ModelFacts, spec: Path
) -> tuple[str, dict[Path, str | Path]]:
    """The model as the specification names it, and where copies of its files go.

    A model inside the project stays where it is. Of another one, the files that it uses are
    copied, in the same places to each other: those below its folder, and below `options.assets`.
    """
    path, reach = options.model, allowed_paths(str(spec))
    used = model.files.used(facts.files)
    if all(map(reach.contains, used)):
        return os.path.relpath(path, spec.parent), {}
    own = os.path.dirname(path)
    folders = (own, os.path.dirname(os.path.realpath(path)), *options.assets)
    copied = AllowedPaths(tuple(map(os.path.realpath, folders)))
    for each in used:
        if not copied.contains(each):
            folder = shlex.quote(os.path.dirname(os.path.realpath(each)))
            raise Refused(
                f"{path} uses {each}, which is not below its folder; nothing was written: to have "
                f"it copied, add --assets {folder}"
            )
        if os.path.realpath(os.path.abspath(each)) != os.path.realpath(each):
            raise Refused(
                f"{path} names {each} by way of a link and `..`; nothing was written: name the "
                "place without `..`"
            )
    for each in sorted({*model.files.possible, *model.files.unused} - {*used}):
        streams.print_message(f"specc: not copied, since MuJoCo does not open it: {each}")
    top = os.path.commonpath([os.path.dirname(os.path.abspath(each)) for each in used])
    plants = spec.parent / PLANTS
    places = {each: plants / os.path.relpath(os.path.abspath(each), top) for each in used}
    return places[path].relative_to(spec.parent).as_posix(), {p: Path(f) for f, p in places.items()}


# From the graph of ROS 2.


def _of_ros2(options: Namespace) -> list[Path]:
    """Write a specification for what there is on the graph; see `write`."""
    wish = Path(options.ros2)
    is_file = wish.suffix in (".yaml", ".yml")
    system = SpecNames(PEERS | PACKAGES).new(wish.stem if is_file else options.ros2)
    spec = Path(options.directory) / (wish if is_file else f"{system}.yaml")
    agent = _legal(options.agent or system)
    refuse_existing({spec: ""})
    wait_s = options.wait or _WAIT_S
    python = options.python or ""
    if os.sep in python:  # as runs find it that are started elsewhere
        python = os.path.abspath(python)
    devices = Devices(_graph(python, wait_s))
    for line in left_out({name: why for why, names in devices.left_out.items() for name in names}):
        streams.print_message(f"specc: left out: {line}")
    if not devices.every:
        raise Refused(_nothing(devices, wait_s))
    text = proposal(devices, system, agent, f"specc init --ros2 {wish.name}", python=python)
    if errors := list(filter(_is_error, _checked(spec, text).diagnostics)):
        raise Refused(
            "nothing was written: the specification would have errors, "
            f"{errors[0].code}: {errors[0].message}"
        )
    with creating(spec) as new:
        new.write({spec: text})
    return [spec]


def _graph(python: str, wait_s: float) -> RosGraph:
    looking = import_module("specc_runtime.ros2.looking")
    try:
        return graph_from(looking.graph_of(python or "python3", wait_s, LISTENED, _MOST_TOPICS))
    except looking.ERRORS as error:
        raise Refused(f"{error}; nothing was written") from None


def _nothing(devices: Devices, wait_s: float) -> str:
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    return (
        f"in {wait_s:g} s nothing was seen that goes with a device, of {len(devices.graph.topics)} "
        f"topics on the graph of ROS_DOMAIN_ID={domain}: start the robot, or look longer with "
        "--wait; nothing was written"
    )
