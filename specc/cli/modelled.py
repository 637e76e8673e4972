"""`specc init --model`: a specification from the model of a robot, which the runtime reads."""

from __future__ import annotations

import os
import shlex
from argparse import Namespace
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from specc.cli import streams
from specc.cli.rewrite import rewrite
from specc.mjcf import Model, ModelError, read_model
from specc.policy import reach_of
from specc.read import ANYWHERE, read_file
from specc.tools.importers.writing import PEERS, SpecNames
from specc.tools.starting import (
    Facts,
    NoFacts,
    NoGroup,
    NotAdded,
    Robot,
    added,
    bound,
    document,
    facts_of,
    grouped,
    left_out,
    receptors,
)

PLANTS = "plants"
_MOST_SHOWN = 5


class Refused(Exception):
    """Nothing is written; the message says why."""


def init(options: Namespace) -> int:
    """Write a specification for a model, and the model beside it where it lies outside."""
    try:
        adds = options.agent is not None and Path(options.directory).is_file()
        written = _added(options) if adds else _write(_files(options))
    except Refused as refused:
        streams.say(f"specc: {refused}")
        return 2
    for place in written[:_MOST_SHOWN]:
        streams.show(f"{place}\n")
    if len(written) > _MOST_SHOWN:
        streams.show(f"and {len(written) - _MOST_SHOWN} more files below {PLANTS}\n")
    named = shlex.quote(str(written[0]))
    streams.show(f"\nspecc status {named}\nspecc run {named}\n")
    return 0


def _files(options: Namespace) -> dict[Path, str | Path]:
    """Where to write, and texts, or files to copy; the specification comes first."""
    path, folder = options.model, Path(options.directory)
    model = _model(path)
    facts = _facts(path)
    system = SpecNames(PEERS).new(_name(path, model))
    name = system if options.agent is None else _legal(options.agent)
    robot = _robot(name, facts, model, options)
    spec = folder / f"{system}.yaml"
    plant, copies = _plant(path, model, spec)
    return {spec: document(robot, system, plant, _command(path)), **copies}


def _command(path: str) -> str:
    return f"specc init --model {os.path.basename(path)}"


def _legal(wish: str) -> str:
    name = SpecNames(PEERS).new(wish)
    if name != wish:
        raise Refused(f"nothing can be called {wish!r}; {name} would do")
    return name


def _added(options: Namespace) -> list[Path]:
    """Add an agent to a specification; the files that were written."""
    path, spec = options.model, Path(options.directory)
    name = _legal(options.agent)
    read = read_file(str(spec))
    if not isinstance(read.data, dict) or any(d.severity == "error" for d in read.diagnostics):
        raise Refused(f"{spec} is not a specification that can be read; `specc validate` says more")
    model = _model(path)
    plant, copies = _same_plant(read.data, path, model, spec)
    robot = _robot(name, _facts(path), model, options, bound(read.data))
    try:
        text = added(read.source.text, read.data, robot, plant, _command(path))
    except NotAdded as error:
        raise Refused(str(error)) from None
    written = _write(copies)
    try:
        rewrite(str(spec), text)
    except OSError as error:
        for place in written:
            place.unlink(missing_ok=True)
        raise Refused(f"cannot write: {error}; nothing was left behind") from None
    return [spec, *written]


def _same_plant(
    data: Mapping[str, Any], path: str, model: Model, spec: Path
) -> tuple[str, dict[Path, str | Path]]:
    """See `_plant`; a specification has one plant, in which all its agents are."""
    plant = data.get("plant")
    named = plant.get("model") if isinstance(plant, dict) else None
    if not plant:
        return _plant(path, model, spec)
    if not isinstance(named, str) or not os.path.exists(path) or not _is_same(path, spec, named):
        shown = named if isinstance(named, str) else "made by Python"
        raise Refused(
            f"the plant of {spec} is {shown}, and a system has one plant: put the robot into that "
            "model with <attach>, then name that file with --model"
        )
    return named, {}


def _is_same(path: str, spec: Path, named: str) -> bool:
    return os.path.realpath(path) == os.path.realpath(spec.parent / named)


def _model(path: str) -> Model:
    if not os.path.isfile(path):
        raise Refused(f"there is no model {path}")
    try:
        model = read_model(path, ANYWHERE)
    except ModelError as error:
        raise Refused(str(error)) from None
    if model.missing:
        raise Refused(f"{path} names {model.missing[0]}, which is not there")
    return model


def _facts(path: str) -> Facts:
    try:
        return facts_of(path)
    except NoFacts as error:
        raise Refused(str(error)) from None


def _robot(
    name: str, facts: Facts, model: Model, options: Namespace, taken: Collection[str] = ()
) -> Robot:
    """The robot, without what others have (`taken`); an agent has named groups only, if any."""
    wanted = options.group.items()
    items = {_legal(each): [item.strip() for item in text.split(",")] for each, text in wanted}
    try:
        groups = grouped(facts, items, taken, guess=not (items and options.agent))
    except NoGroup as error:
        raise Refused(f"--group: {error}") from None
    found, refused = receptors(facts, model, taken)
    refused = {**facts.refused, **refused}
    for line in left_out(refused):
        streams.say(f"specc: left out: {line}")
    if not groups:
        raise Refused("the model has no actuator that can be held; nothing was written")
    return Robot(name, facts, model, groups, found, refused)


def _name(path: str, model: Model) -> str:
    stem = Path(path).stem
    return (model.name or stem).lower() if stem in ("robot", "model", "scene") else stem.lower()


def _plant(path: str, model: Model, spec: Path) -> tuple[str, dict[Path, str | Path]]:
    """The model as the specification names it, and where copies of its files go.

    A model inside the project stays where it is. Of another one, all files that it names are
    copied, in the same places to each other.
    """
    reach = reach_of(str(spec))
    if all(map(reach.holds, model.files)):
        return os.path.relpath(path, spec.parent), {}
    real = [os.path.realpath(each) for each in model.files]
    top = os.path.commonpath([os.path.dirname(each) for each in real])
    places = {each: spec.parent / PLANTS / os.path.relpath(each, top) for each in real}
    own = places[os.path.realpath(path)]
    return own.relative_to(spec.parent).as_posix(), {p: Path(f) for f, p in places.items()}


def _write(files: Mapping[Path, str | Path]) -> list[Path]:
    """Write new files, all or none; see the errors of `_files`."""
    taken = [str(place) for place in files if place.exists() or place.is_symlink()]
    if taken:
        verb = "exists" if len(taken) == 1 else "exist"
        raise Refused(f"{', '.join(taken[:3])} {verb} already; nothing was written")
    written: list[Path] = []
    try:
        for place, content in files.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            data = content.encode() if isinstance(content, str) else content.read_bytes()
            with place.open("xb") as stream:
                written.append(place)
                stream.write(data)
    except OSError as error:
        for place in written:
            place.unlink(missing_ok=True)
        raise Refused(f"cannot write: {error}; nothing was left behind") from None
    return written
