"""The command line of a run."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal

RendererName = Literal["auto", "gl", "raycast"]
ImagesName = Literal["small", "full", "none"]


CYCLE_LIMIT_S = 120.0
"""Simulated time after which a cycle is given up, unless another is asked for."""


class UsageError(Exception):
    """The run cannot begin as asked; the message says why and what would help."""


@dataclass(frozen=True, slots=True)
class Options:
    """What was asked for; cycles and limits are None where nothing was said."""

    directory: Path
    base: Path = Path()
    seed: int = 0
    cycles: int | None = None
    duration_s: float | None = None
    endless: bool = False
    """Whether a run without cycles and a duration goes on until it is stopped."""
    cycle_limit_s: float | None = None
    camera: str = "overview"
    report: Path | None = None
    video: Path | None = None
    fps: float | None = None
    size: tuple[int, int] | None = None
    """Width and height of a film in pixels."""
    geom_groups: tuple[int, ...] | None = None
    viewer: bool = False
    keys: bool = False
    """Whether the keys of the terminal operate the panel."""
    renderer: RendererName = "auto"
    inline: bool = False
    real_time: bool = False
    speed: float | None = None
    """Seconds of simulated time in one of the clock, at most."""
    apart: tuple[str, ...] = ()
    """Subsystems that compute in processes of their own, whatever time the run is in."""
    quiet: bool = False
    check_operators: bool = False
    resume: tuple[Path, float] | None = None
    """A recording and the simulated time from which the run goes on."""
    past: Path | None = None
    """The package of the recorded specification, where it is another one."""
    record: Path | None = None
    snapshots: Path | None = None
    """A file for what a run can be started again from, where it is not recorded."""
    profile: Literal["ros2"] | None = None
    """Whether the recording is a bag of ROS 2."""
    bag: Path | None = None
    """A bag whose messages the run gets, instead of those of a node."""
    record_exact: bool = False
    record_images: ImagesName | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    """The specification, first, and the files that it uses: names and texts, for recordings."""
    built_with: Mapping[str, str] = field(default_factory=dict)
    """Constants and the texts of their values that the code was built with instead of its own."""
    spec: str = ""
    """The specification, as it was named; empty where only the package is known."""
    ros_args: tuple[str, ...] = ()
    """What the node of a plant behind ROS 2 gets: remappings, namespace, parameters."""
    scenario: str | None = None
    """The scenario of which the run is one, for recordings."""

    def named_absolutely(self) -> Options:
        """The same files, whatever the folder of the process becomes."""
        paths: dict[str, Any] = {
            part.name: value.absolute()
            for part in fields(self)
            if isinstance(value := getattr(self, part.name), Path)
        }
        if self.resume is not None:
            paths["resume"] = self.resume[0].absolute(), self.resume[1]
        return replace(self, **paths)


def parse(arguments: Sequence[str] | None) -> Options:
    """Options of the arguments, by default the process's own. Raises SystemExit like argparse."""
    parser = argparse.ArgumentParser(
        prog="python -m specc_runtime", description="Run a generated system.", allow_abbrev=False
    )
    add = parser.add_argument
    add("directory", metavar="DIR", type=Path, help="the generated package")
    add("--base", metavar="SPECDIR", type=Path, default=Path(), help="where the spec's files are")
    add_arguments(parser)
    add("--quiet", action="store_true", help="no progress, no summary")
    return chosen(parser.parse_args(arguments))


def parse_program(name: str, arguments: Sequence[str] | None, **known: Any) -> Options:
    """Options of a program that knows its package, as `known`. Raises SystemExit like argparse."""
    words = "Run the agents until they are stopped, or as long as --cycles or --duration say."
    parser = argparse.ArgumentParser(prog=name, description=words, allow_abbrev=False)
    add_arguments(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress, no summary")
    return chosen(parser.parse_args(arguments), endless=True, **known)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a run to a parser; they do not depend on who builds the package."""
    # A run that goes on has the seed of the recorded one. A text, since argparse takes a default
    # for what is not said only if it is the same object.
    seed_or_past = parser.add_mutually_exclusive_group().add_argument
    words = "seed of the random numbers (default: 0)"
    seed_or_past("--seed", metavar="N", type=_whole_number, default="0", help=words)
    words = "go on from a recording, with its seed"
    seed_or_past("--from", metavar="FILE.mcap@S", type=_moment, dest="resume", help=words)
    add_extent(parser)
    add = parser.add_argument
    add("--report", metavar="FILE.json", type=Path, help="write what happened")
    add("--record", metavar="FILE.mcap", type=Path, help="record every step")
    words = "record a bag instead: the topics in CDR, states and their causes as texts"
    add("--profile", choices=("ros2",), help=words)
    add("--record-exact", action="store_true", help="all as it is, to replay all of it")
    words = "images in a recording for looking (default: small)"
    add("--record-images", choices=("small", "full", "none"), help=words)
    add(
        "--video",
        metavar="FILE.mp4",
        type=Path,
        help="film the scene (FILE.webp for pages); slow, see --fps and --size",
    )
    add(
        "--camera",
        metavar="NAME",
        default="overview",
        help="camera of the film (default: %(default)s)",
    )
    words = "pictures a second of the film (default: 25, of FILE.webp 10)"
    add("--fps", metavar="N", type=_rate, help=words)
    words = "pixels of the film (default: 640x480, of FILE.webp 400x300)"
    add("--size", metavar="WxH", type=_size, help=words)
    words = "groups of geoms that the film shows (default: 0,1,2)"
    add("--geom-groups", metavar="N,N", type=_groups, help=words)
    add("--viewer", action="store_true", help="show the scene in a window")
    words = "the keys of the terminal operate the panel; not faster than --speed 1"
    add("--keys", action="store_true", help=words)
    pace = parser.add_mutually_exclusive_group().add_argument
    words = "follow the clock: skip periods that are over"
    pace("--real-time", action="store_true", help=words)
    words = "simulated seconds in one of the clock, at most (default: as fast as it goes)"
    pace("--speed", metavar="X", type=_speed, help=words)
    add("--inline", action="store_true", help="no worker threads; the records are the same")
    words = "the rest is for the node behind ROS 2: -r OLD:=NEW, -r __ns:=/left, -p NAME:=VALUE"
    rest = argparse.REMAINDER
    add("--ros-args", nargs=rest, default=(), help=words)


def add_extent(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what is run, and not what is seen of it."""
    add = parser.add_argument
    add("--cycles", metavar="N", type=_count, help="number of cycles of the task")
    add("--duration", metavar="S", type=_seconds, dest="duration_s", help="simulated time (s)")
    add(
        "--cycle-limit",
        metavar="S",
        type=_seconds,
        dest="cycle_limit_s",
        help=f"simulated seconds after which a cycle is given up (default: {CYCLE_LIMIT_S:g})",
    )
    add(
        "--renderer",
        choices=("auto", "gl", "raycast"),
        default="auto",
        help="renderer of the cameras",
    )
    add("--check-operators", action="store_true", help="call each operator twice and compare")


def chosen(found: argparse.Namespace, **others: Any) -> Options:
    """The options that a parser found, with `others` that it does not know."""
    names = {part.name for part in fields(Options)}
    found.ros_args = tuple(found.ros_args)
    return Options(
        **{name: value for name, value in vars(found).items() if name in names}, **others
    )


def _moment(text: str) -> tuple[Path, float]:
    file, at, seconds = text.rpartition("@")
    if not (file and at):
        raise argparse.ArgumentTypeError(f"{text!r} is not FILE.mcap@SECONDS")
    return Path(file), _seconds(seconds)


def _whole_number(text: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number, 0 or more")
    return int(text)


def _count(text: str) -> int:
    number = _whole_number(text)
    if number == 0:
        raise argparse.ArgumentTypeError("at least 1 is needed")
    return number


_MOST_FPS, _SIZES_PX = 240, (16, 4096)
_GROUPS = range(6)


def _rate(text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        rate = math.nan
    if not 0.01 <= rate <= _MOST_FPS:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 0.01 to {_MOST_FPS}")
    return rate


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 1e-3 <= speed <= 1e3:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 0.001 to 1000")
    return speed


def _size(text: str) -> tuple[int, int]:
    width, by, height = text.partition("x")
    low, high = _SIZES_PX
    if not by or not all(low <= (n := _whole_number(part)) <= high and n % 2 == 0
                         for part in (width, height)):  # fmt: skip
        words = f"{text!r} is not WIDTHxHEIGHT, both even and from {low} to {high}"
        raise argparse.ArgumentTypeError(words)
    return int(width), int(height)


def _groups(text: str) -> tuple[int, ...]:
    parts = text.split(",")
    if not all(part in map(str, _GROUPS) for part in parts):
        raise argparse.ArgumentTypeError(f"{text!r} is not numbers from 0 to 5: 0,1,2")
    return tuple(sorted(set(map(int, parts))))


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not (math.isfinite(seconds) and seconds > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number of seconds")
    return seconds
