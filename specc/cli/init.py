"""`specc init`: starts a specification that validates and runs at once.

It is a skeleton, or made of what the runtime finds out about a robot: from its model, or on the
graph of ROS 2.
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

from specc.atomic_files import remove_stale
from specc.cli import streams
from specc.cli.files import AlreadyExists, creating, refuse_existing, rewrite_file
from specc.diagnostics import Diagnostic, nearest
from specc.lang.packages import PACKAGES
from specc.mjcf import Model, read_model
from specc.pipeline import Result, check_spec
from specc.policy import allowed_paths
from specc.read import ANYWHERE, AllowedPaths, read_file
from specc.refusal import Refused
from specc.resources import specs_dir
from specc.source import real_path
from specc.tools.fmt import LayoutError
from specc.tools.importers.writing import PEERS, SpecNames
from specc.tools.starting import (
    ModelFacts,
    Robot,
    actuator_groups,
    bound_parts,
    drift_warning,
    mocap_warnings,
    omissions,
    read_facts,
    receptors,
    specification,
    specification_with_agent,
)
from specc.tools.starting.ros2 import LISTENED, Devices, graph_from, proposal

PLANTS = "plants"
"""The folder, beside a specification, of models that are copied."""
_MOST_SHOWN = 5
_WAIT_S = 2.0
_MOST_TOPICS = 200


def init(options: Namespace) -> int:
    """Write a specification into a directory, created if it does not exist, and say how to go on.

    Never overwrites a file.
    """
    target = Path(options.directory)
    try:
        if refusal := _misplaced_option(options):
            raise Refused(refusal)
        remove_stale(os.path.abspath(target.parent if target.is_file() else target))
        if options.ros2 is not None:
            places = _from_ros2(options)
        elif options.model is None:
            places = _from_skeleton(options)
        elif options.agent is not None and target.is_file():
            places = _add_agent(options)
        else:
            places = _from_model(options)
    except OSError as error:
        why = str(error) if isinstance(error, AlreadyExists) else f"cannot write: {error}"
        raise Refused(f"{why}; nothing was written") from error
    streams.print_output("".join(f"{place}\n" for place in places))
    name = shlex.quote(str(places[0]))
    cycles = "" if options.model is not None else " --cycles 1"
    tested = "" if options.ros2 is not None else f"specc test {name}\n"
    streams.print_output(f"\nspecc status {name}\nspecc run {name}{cycles}\n{tested}")
    return 0


def _misplaced_option(options: Namespace) -> str:
    """Why options do not go together, or name what is not there; empty if all is well."""
    if not options.directory:
        return "the directory has no name; leave it out to use this one"
    if options.ros2 is None and (options.python or options.wait):
        return f"{'--python' if options.python else '--wait'} is about ROS 2; add --ros2"
    for option in ("group", "assets"):
        if getattr(options, option) and options.model is None:
            return f"--{option} is about a model; add --model FILE.xml"
    if options.agent and options.model is None and options.ros2 is None:
        return "--agent is about a model or ROS 2; add --model FILE.xml, or --ros2"
    missing = [folder for folder in options.assets if not os.path.isdir(folder)]
    return f"there is no folder {missing[0]!r} for --assets" if missing else ""


# Each of these writes files and returns them, the specification first. Raises Refused, OSError.


def _from_skeleton(options: Namespace) -> list[Path]:
    folder, name = Path(options.directory), options.skeleton or "joint"
    if name not in (known := skeletons()):
        close = nearest(name, known)
        hint = f"did you mean {' or '.join(close)}? " if close else ""
        raise Refused(f"no skeleton {name!r}; {hint}there are {', '.join(known)}")
    if os.path.exists(folder) and not folder.is_dir():
        words = "name a directory, which is created if it does not exist"
        raise Refused(f"{options.directory} is a file; {words}")
    source = specs_dir() / "skeletons" / name
    # The specification is the first, and so comes last.
    files = sorted(filter(Path.is_file, source.rglob("*")), key=lambda path: path.suffix != ".yaml")
    places = {folder / path.relative_to(source): path for path in files}
    with creating(next(iter(places))) as new:
        new.write(places)
    return list(places)


def skeletons() -> list[str]:
    """The names of the skeletons."""
    return sorted(path.name for path in (specs_dir() / "skeletons").iterdir() if path.is_dir())


def _from_model(options: Namespace) -> list[Path]:
    path, model = options.model, _model(options.model)
    stem = Path(path).stem
    is_generic = stem in ("robot", "model", "scene")
    system = SpecNames(PEERS | PACKAGES).new(((is_generic and model.name) or stem).lower())
    spec = Path(options.directory) / f"{system}.yaml"
    facts = read_facts(path)
    plant, copies = _plant(options, model, facts, spec)
    refuse_existing(copies)
    name = system if options.agent is None else _legal(options.agent)
    robot = _robot(name, facts, model, options)
    text = specification(robot, system, plant, _command(path))
    with creating(spec) as new:
        new.write(copies)
        _refuse_errors(_checked(spec, text), ())
        new.write({spec: text})
    _warn(robot)
    return [spec, *copies]


def _add_agent(options: Namespace) -> list[Path]:
    path, spec = options.model, Path(options.directory)
    name = _legal(options.agent)
    document, before = read_file(str(spec)), check_spec(str(spec))
    data = document.data
    if not isinstance(data, dict) or not document.ok or before.system is None:
        raise Refused(f"{spec} is not a specification that can be read; `specc validate` says more")
    # An agent that cannot be read is in the text alone.
    written = data.get("agents")
    if name in _agents(before) or (isinstance(written, dict) and name in written):
        raise Refused(f"there is an agent {name} already; give another --agent")
    model, facts = _model(path), read_facts(path)
    plant, copies = _same_plant(data, options, model, facts, spec)
    refuse_existing(copies)
    robot = _robot(name, facts, model, options, bound_parts(before.system))
    failure = Refused(
        f"{name} cannot be added to {spec}, which is unchanged: write its sections as blocks, "
        "without braces around all of them, and nothing after a line of `...`"
    )
    try:
        text = specification_with_agent(document.source.text, data, robot, plant, _command(path))
    except LayoutError:
        raise failure from None
    with creating(spec) as new:
        new.write(copies)
        after = _checked(spec, text)
        if not {*_agents(before), name} <= _agents(after):
            raise failure
        _refuse_errors(after, before.diagnostics)
        new.commit(partial(rewrite_file, str(spec), text.encode()))
    _warn(robot)
    return [spec, *copies]


def _from_ros2(options: Namespace) -> list[Path]:
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
    looking = import_module("specc_runtime.ros2.looking")
    try:
        graph = looking.graph_of(python or "python3", wait_s, LISTENED, _MOST_TOPICS)
        devices = Devices(graph_from(graph))
    except looking.ERRORS as error:
        raise Refused(f"{error}; nothing was written") from None
    for line in omissions({name: why for why, names in devices.left_out.items() for name in names}):
        streams.print_message(f"specc: left out: {line}")
    if not devices.every:
        domain = os.environ.get("ROS_DOMAIN_ID", "0")
        topics = len(devices.graph.topics)
        raise Refused(
            f"in {wait_s:g} s nothing was seen that goes with a device, of {topics} topics on the "
            f"graph of ROS_DOMAIN_ID={domain}: start the robot, or look longer with --wait; "
            "nothing was written"
        )
    text = proposal(devices, system, agent, f"specc init --ros2 {wish.name}", python=python)
    if errors := list(filter(_is_error, _checked(spec, text).diagnostics)):
        raise Refused(
            "nothing was written: the specification would have errors, "
            f"{errors[0].code}: {errors[0].message}"
        )
    with creating(spec) as new:
        new.write({spec: text})
    return [spec]


def _legal(wish: str) -> str:
    name = SpecNames(PEERS).new(wish)
    if name != wish:
        raise Refused(f"nothing can be called {wish!r}; {name} would do")
    return name


def _command(path: str) -> str:
    return f"specc init --model {os.path.basename(path)}"


def _checked(spec: Path, text: str) -> Result:
    """What the compiler finds in a specification with this text, its model being in place."""
    return check_spec(str(spec), texts={real_path(str(spec)): text})


def _is_error(finding: Diagnostic) -> bool:
    return finding.severity == "error"


def _refuse_errors(result: Result, before: Iterable[Diagnostic]) -> None:
    """Refuse a specification that has errors, other than those that were there `before`."""
    new = Counter((each.code, each.message) for each in result.diagnostics if _is_error(each))
    new -= Counter((each.code, each.message) for each in before if _is_error(each))
    if new:
        lines = "".join(f"\n  {code}: {message}" for code, message in list(new)[:_MOST_SHOWN])
        more = f"\n  and {len(new) - _MOST_SHOWN} more" if len(new) > _MOST_SHOWN else ""
        raise Refused(
            "nothing was written: the specification would have errors; change the model, or say "
            f"with --group which actuators it is about{lines}{more}"
        )


def _warn(robot: Robot) -> None:
    if line := drift_warning(robot.facts):
        streams.print_message(f"specc: {line}")


def _agents(result: Result) -> set[str]:
    return {agent.name for agent in result.system.agents} if result.system else set()


def _same_plant(
    data: Mapping[str, Any], options: Namespace, model: Model, facts: ModelFacts, spec: Path
) -> tuple[str, dict[Path, str | Path]]:
    """See `_plant`; a specification has one plant, in which all its agents are."""
    path = options.model
    plant = data.get("plant")
    if not plant:
        return _plant(options, model, facts, spec)
    name = plant.get("model") if isinstance(plant, dict) else None
    shown = name if isinstance(name, str) else "made by Python"
    is_known = shown == name and os.path.exists(path)
    if is_known and real_path(path) == real_path(str(spec.parent / shown)):
        return shown, {}
    raise Refused(
        f"the plant of {spec} is {shown}, and a system has one plant: put the robot into that "
        "model with <attach>, then name that file with --model"
    )


def _model(path: str) -> Model:
    if not os.path.isfile(path):
        raise Refused(f"there is no model {path}")
    model = read_model(path, ANYWHERE)
    if model.missing:
        raise Refused(f"{path} names {model.missing[0]}, which is not there")
    return model


def _robot(
    name: str,
    facts: ModelFacts,
    model: Model,
    options: Namespace,
    in_use: Collection[str] = (),
) -> Robot:
    """The robot, without what other agents have; an agent has named groups only, if any."""
    wanted = {_legal(each): text for each, text in options.group.items()}
    groups = actuator_groups(facts, wanted, in_use, guess=not (wanted and options.agent))
    found, refused = receptors(facts, model, in_use)
    for line in omissions({**facts.refused, **refused}):
        streams.print_message(f"specc: left out: {line}")
    for line in mocap_warnings(facts):
        streams.print_message(f"specc: {line}")
    if not groups:
        raise Refused(_no_group(facts))
    return Robot(name, facts, groups, found, {**facts.refused, **refused})


def _no_group(facts: ModelFacts) -> str:
    """Why a model gives nothing to write, and what to do."""
    if facts.actuators:
        return "all actuators of the model are driven already; nothing was written"
    if facts.thrusters:
        why = "its actuators push at sites, and only a controller of its attitude holds it"
        example = "docs/your_robot.md shows a start under `A drone`"
        return f"it flies: {why}; nothing was written. {example}"
    hint = "" if facts.refused else "; add `<actuator>` with a drive for each joint"
    return f"the model has no actuator that can be held; nothing was written{hint}"


def _plant(
    options: Namespace, model: Model, facts: ModelFacts, spec: Path
) -> tuple[str, dict[Path, str | Path]]:
    """The model as the specification names it, and where copies of its files go.

    A model inside the project stays where it is. Of another one, the files that it uses are
    copied, in the same places to each other: those below its folder, and below `options.assets`.
    """
    path, allowed = options.model, allowed_paths(str(spec))
    used = model.files.used(facts.files)
    if all(map(allowed.contains, used)):
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
