"""`specc init`: starts a specification that validates and runs at once, from a skeleton."""

from __future__ import annotations

import os
import shlex
from argparse import Namespace
from pathlib import Path

from specc.cli import streams
from specc.cli.placing import placing, reason
from specc.diagnostics import nearest
from specc.resources import specs_dir


def init(options: Namespace) -> int:
    """Copy a skeleton into a directory, created if it does not exist; never overwrites a file.

    With a model, the specification is written from that; with ROS 2, from its graph.
    """
    if refusal := _misplaced(options):
        streams.say(f"specc: {refusal}")
        return 2
    if options.model is not None:
        from specc.cli import modelled

        return modelled.init(options)
    if options.ros2 is not None:
        from specc.cli import graphed

        return graphed.init(options)
    directory, name = options.directory, options.skeleton or "joint"
    target = Path(directory)
    if name not in names() or not directory or (os.path.exists(target) and not target.is_dir()):
        streams.say(f"specc: {_refusal(directory, name)}")
        return 2
    source = specs_dir() / "skeletons" / name
    # The specification is the first, and so comes last.
    files = sorted(filter(Path.is_file, source.rglob("*")), key=lambda path: path.suffix != ".yaml")
    places = {target / path.relative_to(source): path for path in files}
    try:
        with placing() as new:
            new.put(places)
    except OSError as error:
        streams.say(f"specc: {reason(error)}; nothing was written")
        return 2
    for place in places:
        streams.show(f"{place}\n")
    spec = next(place for place in places if place.suffix == ".yaml")
    named = shlex.quote(str(spec))
    streams.show(f"\nspecc status {named}\nspecc run {named} --cycles 1\n")
    return 0


def _misplaced(options: Namespace) -> str:
    """Why options do not go together; empty if they do."""
    if options.ros2 is None and (options.python or options.wait):
        return f"{'--python' if options.python else '--wait'} is about ROS 2; add --ros2"
    if options.group and options.model is None:
        return "--group is about a model; add --model FILE.xml"
    if options.agent and options.model is None and options.ros2 is None:
        return "--agent is about a model or ROS 2; add --model FILE.xml, or --ros2"
    return ""


def _refusal(directory: str, name: str) -> str:
    """Why nothing can be started."""
    known = names()
    if name not in known:
        close = nearest(name, known)
        meant = f"did you mean {' or '.join(close)}? " if close else ""
        return f"no skeleton {name!r}; {meant}there are {', '.join(known)}"
    if not directory:
        return "the directory has no name; leave it out to use this one"
    return f"{directory} is a file; name a directory, which is created if it does not exist"


def names() -> list[str]:
    """The skeletons that there are."""
    return sorted(path.name for path in (specs_dir() / "skeletons").iterdir() if path.is_dir())
