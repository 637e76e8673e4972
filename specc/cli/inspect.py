"""Checking specifications one by one or side by side in several processes."""

from __future__ import annotations

import glob
import os
import re
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from specc.cli.interruption import is_caused_by_interrupt
from specc.diagnostics import Diagnostic
from specc.diagnostics.report import Finding, Report, report, resolve, shown_path
from specc.limits import MAX_BYTES, one_run
from specc.policy import Overrides, judge, settings_for
from specc.processes import cores, defer_signals, processes
from specc.refusal import reason_of
from specc.source import Place, Sources, real_path

if TYPE_CHECKING:
    from specc.pipeline import Result

PARALLEL_FROM = 4
"""Below this number of files starting processes costs more than it saves."""


@dataclass(frozen=True, slots=True)
class Inspection:
    """What checking one specification gave; `read` are the real paths of all its files."""

    path: str
    findings: tuple[Finding, ...]
    ignored: int
    used: frozenset[Place]
    read: frozenset[str]
    fault: Exception | None = None
    """The failure of specc itself, which is not a finding about the specification."""


class InspectionInterrupted(KeyboardInterrupt):
    """Ctrl-C, with the report about the files that were done."""

    def __init__(self, report: Report) -> None:
        super().__init__()
        self.report = report


class InspectionFailed(Exception):
    """A fault of specc in some files, with the report about all others."""

    def __init__(self, report: Report, path: str, fault: Exception) -> None:
        super().__init__(f"{shown_path(path)}: {fault}")
        self.report = report


def overrides_of(options: Namespace) -> Overrides:
    """What the command line says in place of the settings."""
    return Overrides(options.select, options.ignore, options.strict)


def inspect_all(arguments: Sequence[str], overrides: Overrides) -> Report:
    """The report about everything that the arguments mean, each file once.

    Raises:
        InspectionInterrupted: by Ctrl-C.
        InspectionFailed: a file could not be checked, by a fault of specc.
    """
    meant = find_targets(arguments)
    outcomes: list[Inspection] = []
    faults = resolve(meant.faults, Sources())
    try:
        _inspect_into(outcomes, meant.systems, overrides)
        read = frozenset().union(*(outcome.read for outcome in outcomes))
        alone = [path for path in meant.parts if os.path.realpath(path) not in read]
        parts: list[Inspection] = []
        try:
            _inspect_into(parts, alone, overrides)
        finally:
            outcomes += _without_duplicates(parts)
    except KeyboardInterrupt:
        done = [outcome.path for outcome in outcomes]
        if not done:
            raise
        raise InspectionInterrupted(_summed(faults, outcomes, done, whole=False)) from None
    failed = [outcome for outcome in outcomes if outcome.fault is not None]
    paths = [*meant.systems, *meant.parts]
    if not failed:
        return _summed(faults, outcomes, paths, whole=True)
    checked = [outcome.path for outcome in outcomes if outcome.fault is None]
    found = _summed(faults, outcomes, checked, whole=False)
    assert failed[0].fault is not None
    raise InspectionFailed(found, failed[0].path, failed[0].fault)


def _without_duplicates(parts: Sequence[Inspection]) -> Iterator[Inspection]:
    """The outcomes of parts, without what the parts that they use say of themselves."""
    own = {s for part in parts for s in map(_spot, part.findings) if s[0] == real_path(part.path)}
    for part in parts:
        theirs = {spot for spot in own if spot[0] != real_path(part.path)}
        left = tuple(item for item in part.findings if _spot(item) not in theirs)
        yield replace(part, findings=left)


def _spot(item: Finding) -> tuple[str, str, int, int]:
    span = item.primary.span
    return real_path(span.file), item.diagnostic.code, span.line, span.col


def _summed(
    faults: list[Finding], outcomes: Sequence[Inspection], paths: Sequence[str], whole: bool
) -> Report:
    """The report about all outcomes; if some are missing, what they might use is not judged."""
    used = frozenset().union(*(outcome.used for outcome in outcomes))
    findings = list(faults)
    for outcome in outcomes:
        findings += [item for item in outcome.findings if not _used_elsewhere(item, used, whole)]
    ignored = sum(outcome.ignored for outcome in outcomes)
    return replace(report(findings, paths), ignored=ignored)


def inspect(path: str, overrides: Overrides) -> Inspection:
    """Compile a specification and judge what was found."""
    from specc import pipeline

    with one_run():
        result = pipeline.check_spec(path)
        left = judge_findings(path, result, overrides)
    read = frozenset(real_path(source.path) for source in result.sources)
    return Inspection(path, tuple(left.findings), left.ignored, left.used, read)


def _inspected(path: str, overrides: Overrides) -> Inspection:
    """Like `inspect`; a fault of specc in one file does not keep the others from being checked."""
    try:
        return inspect(path, overrides)
    except Exception as error:
        if is_caused_by_interrupt(error) or "SPECC_TRACEBACK" in os.environ:
            raise
        fault = Exception(f"{type(error).__name__}: {error}")  # any other may not cross processes
        return Inspection(path, (), 0, frozenset(), frozenset(), fault)


@dataclass(frozen=True, slots=True)
class JudgedFindings:
    """Findings about a specification that are left, and faults of its settings.

    `used` are the comments that suppress others; what is `refused` has none of its code run.
    """

    findings: list[Finding]
    refused: bool
    ignored: int
    used: frozenset[Place]


def judge_findings(path: str, result: Result, overrides: Overrides) -> JudgedFindings:
    """What comments, settings and the command line leave of the findings."""
    known = Sources(result.sources)
    found = settings_for(os.path.dirname(path))
    if found.source is not None:
        known.add(found.source)
    settings = overrides.applied_to(found.settings)
    verdict = judge(result.diagnostics, known, settings, not result.is_part)
    findings = resolve((*found.diagnostics, *verdict.diagnostics), known)
    refused = verdict.refused or bool(found.diagnostics)
    return JudgedFindings(findings, refused, verdict.ignored, verdict.used)


def _inspect_into(outcomes: list[Inspection], paths: Sequence[str], overrides: Overrides) -> None:
    """Add the outcomes of files, in their order; those that are done also if interrupted."""
    job = partial(_inspected, overrides=overrides)
    workers = min(len(paths), cores())
    if len(paths) < PARALLEL_FROM or workers < 2:
        for path in paths:
            outcomes.append(job(path))
    else:
        _in_processes(outcomes, job, paths, workers)


def _in_processes(
    outcomes: list[Inspection], job: partial[Inspection], paths: Sequence[str], workers: int
) -> None:
    # What is imported before the fork is shared; every other way each process imports it again.
    from specc import pipeline  # noqa: F401  # imported for the processes that inherit it

    found: list[Inspection] = []
    with processes(workers, "fork") as pool:
        with defer_signals():
            jobs = [pool.submit(job, path) for path in paths]
        try:
            found = [one.result() for one in jobs]
        except KeyboardInterrupt:
            found = [one.result() for one in jobs if one.done() and one.exception() is None]
            raise
        finally:
            outcomes += found


def _used_elsewhere(item: Finding, used: Iterable[Place], whole: bool) -> bool:
    """Whether a comment that is unused here is, or may be, used for another specification."""
    return item.diagnostic.code == "W0901" and (not whole or item.diagnostic.primary in used)


# Which files the arguments of a command mean: files, directories and patterns.


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
