"""Which files the arguments of `specc validate` mean: files, directories and patterns."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from specc.diagnostics import Diagnostic
from specc.limits import MAX_BYTES
from specc.policy import settings_for
from specc.refusal import reason_of
from specc.source import Place

_SUFFIXES = (".yaml", ".yml")
_VERSION = re.compile(rb"^(?:\xef\xbb\xbf)?specc[ \t]*:", re.MULTILINE)
_SYSTEM = re.compile(rb"^system[ \t]*:", re.MULTILINE)
_MAGIC = re.compile(r"[*?[]")


@dataclass(frozen=True, slots=True)
class Targets:
    """Files to check, each once, in the order of the arguments.

    `parts` describe or define something for systems to use.
    """

    systems: tuple[str, ...]
    parts: tuple[str, ...]
    faults: tuple[Diagnostic, ...]


def find_targets(arguments: Iterable[str]) -> Targets:
    """Files that the arguments mean.

    A file is taken as it is. In a directory, and among what a pattern matches, only files with
    `specc:` are meant, less those that the settings exclude.
    """
    files: dict[str, str] = {}
    faults = []
    for argument in arguments:
        refused: list[OSError] = []
        found = list(_files(argument, refused))
        faults += [_unread(error) for error in refused]
        if not found and not refused:
            what = "directory has no specification" if os.path.isdir(argument) else ""
            message = f"this {what}" if what else "no specification matches this pattern"
            hint = "a specification is a .yaml file that begins with `specc: 1`"
            faults.append(Diagnostic("E0001", message, Place(argument), help=hint))
        for file in found:
            files.setdefault(os.path.realpath(file), file)
    parts = {file for file in files.values() if is_part(file)}
    systems = tuple(file for file in files.values() if file not in parts)
    return Targets(systems, tuple(file for file in files.values() if file in parts), tuple(faults))


def is_part(path: str) -> bool:
    """Whether a file is there for systems to use, and describes none."""
    text = _content(path) or b""
    return _VERSION.search(text) is not None and _SYSTEM.search(text) is None


def is_argument(path: str, arguments: Iterable[str]) -> bool:
    """Whether a file is among the arguments, matches one or lies in a directory that is one.

    What the settings exclude from a search is named only by its own path.
    """
    return any(_names(argument, path) for argument in arguments)


def _names(argument: str, path: str) -> bool:
    real = os.path.realpath(path)
    if os.path.isdir(argument):
        inside = Path(real).is_relative_to(os.path.realpath(argument))
        return inside and not settings_for(argument).settings.excludes(Path(path))
    if os.path.lexists(argument) or not _MAGIC.search(argument):
        return os.path.realpath(argument) == real
    return any(os.path.realpath(m) == real for m in glob.iglob(argument, recursive=True))


def _files(argument: str, refused: list[OSError]) -> Iterator[str]:
    if os.path.isdir(argument):
        below = _below(argument, refused)
        yield from _specifications(below, argument)
    elif not os.path.lexists(argument) and _MAGIC.search(argument):
        matches = map(Path, glob.iglob(argument, recursive=True))
        yield from _specifications(matches, _fixed_part(argument))
    else:
        yield argument


def _below(directory: str, refused: list[OSError]) -> Iterator[Path]:
    """Files in a directory, at any depth, without what is hidden; `refused` are folders."""
    for folder, names, files in os.walk(directory, onerror=refused.append):
        names[:] = [name for name in names if not name.startswith(".")]
        yield from (Path(folder, file) for file in files if not file.startswith("."))


def _specifications(paths: Iterable[Path], root: str) -> Iterator[str]:
    settings = settings_for(root).settings
    for path in sorted(paths):
        if path.suffix not in _SUFFIXES or settings.excludes(path):
            continue
        text = _content(str(path))
        if text is None or _VERSION.search(text):
            yield str(path)


def _fixed_part(pattern: str) -> str:
    """The directory before the first part of a pattern that is not to be taken literally."""
    head = pattern[: match.start()] if (match := _MAGIC.search(pattern)) else pattern
    return os.path.dirname(head) or "."


def _unread(error: OSError) -> Diagnostic:
    """The finding about a folder that cannot be looked into."""
    message = f"the directory cannot be read: {reason_of(error)}"
    return Diagnostic("E0003", message, Place(str(error.filename)), help="check its permissions")


def _content(path: str) -> bytes | None:
    """As much of a file as a specification may have; None if permission to read it is missing."""
    try:
        if not os.path.isfile(path):
            return b""
        with open(path, "rb") as file:
            return file.read(MAX_BYTES)
    except PermissionError:
        return None
    except (OSError, ValueError):
        return b""
