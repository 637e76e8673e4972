"""`specc init`: starts a specification that validates and runs at once, from a skeleton."""

from __future__ import annotations

import os
import shlex
from argparse import Namespace
from pathlib import Path

from specc.atomic_files import remove_stale
from specc.cli import streams
from specc.cli.new_files import creating, write_failure
from specc.diagnostics import nearest
from specc.refusal import Refused
from specc.resources import specs_dir


def init(options: Namespace) -> int:
    """Write a specification into a directory, created if it does not exist, and say how to go on.

    It is a skeleton, or made from a model or from what ROS 2 has. Never overwrites a file.
    """
    try:
        places = _written(options)
    except OSError as error:
        raise Refused(write_failure(error)) from error
    for place in places:
        streams.print_output(f"{place}\n")
    named = shlex.quote(str(places[0]))
    cycles = "" if options.model is not None else " --cycles 1"
    streams.print_output(f"\nspecc status {named}\nspecc run {named}{cycles}\n")
    return 0


def _written(options: Namespace) -> list[Path]:
    """Write the files; the specification comes first. Raises Refused, OSError."""
    if refusal := _misplaced(options):
        raise Refused(refusal)
    target = Path(options.directory)
    remove_stale(os.path.abspath(target.parent if target.is_file() else target))
    if options.model is not None or options.ros2 is not None:
        from specc.cli import init_robot

        return init_robot.write(options)
    directory, name = options.directory, options.skeleton or "joint"
    if name not in names() or (os.path.exists(target) and not target.is_dir()):
        raise Refused(_refusal(directory, name))
    source = specs_dir() / "skeletons" / name
    # The specification is the first, and so comes last.
    files = sorted(filter(Path.is_file, source.rglob("*")), key=lambda path: path.suffix != ".yaml")
    places = {target / path.relative_to(source): path for path in files}
    with creating(next(iter(places))) as new:
        new.write(places)
    return list(places)


def _misplaced(options: Namespace) -> str:
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


def _refusal(directory: str, name: str) -> str:
    """Why nothing can be started."""
    known = names()
    if name not in known:
        close = nearest(name, known)
        meant = f"did you mean {' or '.join(close)}? " if close else ""
        return f"no skeleton {name!r}; {meant}there are {', '.join(known)}"
    return f"{directory} is a file; name a directory, which is created if it does not exist"


def names() -> list[str]:
    """The skeletons that there are."""
    return sorted(path.name for path in (specs_dir() / "skeletons").iterdir() if path.is_dir())
