"""The command line of a run."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal


class UsageError(Exception):
    """The run cannot begin as asked; the message says why and what would help."""


@dataclass(frozen=True, slots=True)
class Options:
    """What was asked for. `cycles` and `duration_s` are None where nothing was said."""

    directory: Path
    base: Path = Path()
    seed: int = 0
    cycles: int | None = None
    duration_s: float | None = None
    report: Path | None = None
    video: Path | None = None
    viewer: bool = False
    renderer: Literal["auto", "gl", "raycast"] = "auto"
    inline: bool = False
    quiet: bool = False


def parse(arguments: Sequence[str] | None) -> Options:
    """Options of the arguments, by default the process's own. Raises SystemExit like argparse."""
    parser = argparse.ArgumentParser(
        prog="python -m specc_runtime", description="Run a generated system.", allow_abbrev=False
    )
    add = parser.add_argument
    add("directory", metavar="DIR", type=Path, help="the generated package")
    add("--base", metavar="SPECDIR", type=Path, default=Path(), help="where the spec's files are")
    add("--seed", metavar="N", type=_whole_number, default=0, help="of the random numbers")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--cycles", metavar="N", type=_count, help="cycles of the task")
    length.add_argument(
        "--duration", metavar="S", type=_seconds, dest="duration_s", help="simulated seconds"
    )
    add("--report", metavar="FILE.json", type=Path, help="write what happened")
    add("--video", metavar="FILE.mp4", type=Path, help="record the scene")
    add("--viewer", action="store_true", help="show the scene in a window")
    add("--renderer", choices=("auto", "gl", "raycast"), default="auto", help="of the cameras")
    add("--inline", action="store_true", help="no worker threads; the records are the same")
    add("--quiet", action="store_true", help="no progress, no summary")
    return Options(**vars(parser.parse_args(arguments)))


def _whole_number(text: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number, 0 or more")
    return int(text)


def _count(text: str) -> int:
    number = _whole_number(text)
    if number == 0:
        raise argparse.ArgumentTypeError("at least 1 is needed")
    return number


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not (math.isfinite(seconds) and seconds > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number of seconds")
    return seconds
