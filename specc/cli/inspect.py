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
    findings: tuple[Finding, ...] = ()
    ignored: int = 0
    used: frozenset[Place] = frozenset()
    read: frozenset[str] = frozenset()
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
    targets = find_targets(arguments)
    outcomes: list[Inspection] = []
    faults = resolve(targets.faults, Sources())
    try:
        _inspect_into(outcomes, targets.systems, overrides)
        read = frozenset().union(*(outcome.read for outcome in outcomes))
        unused = [path for path in targets.parts if os.path.realpath(path) not in read]
        parts: list[Inspection] = []
        try:
            _inspect_into(parts, unused, overrides)
        finally:
            outcomes += _without_duplicates(parts)
    except KeyboardInterrupt:
        done = [outcome.path for outcome in outcomes]
        if not done:
            raise
        raise InspectionInterrupted(_merged(faults, outcomes, done, is_whole=False)) from None
    for outcome in outcomes:
        if outcome.fault is not None:
            checked = [each.path for each in outcomes if each.fault is None]
            found = _merged(faults, outcomes, checked, is_whole=False)
            raise InspectionFailed(found, outcome.path, outcome.fault)
    return _merged(faults, outcomes, [*targets.systems, *targets.parts], is_whole=True)


def _without_duplicates(parts: Sequence[Inspection]) -> Iterator[Inspection]:
    """The outcomes of parts, without findings about the parts that they use."""
    own = {spot for part in parts for spot in map(_spot, part.findings) if _is_of(spot, part)}
    for part in parts:
        others = {spot for spot in own if not _is_of(spot, part)}
        yield replace(part, findings=tuple(f for f in part.findings if _spot(f) not in others))


def _spot(item: Finding) -> tuple[str, str, int, int]:
    span = item.primary.span
    return real_path(span.file), item.diagnostic.code, span.line, span.col


def _is_of(spot: tuple[str, str, int, int], part: Inspection) -> bool:
    return spot[0] == real_path(part.path)


def _merged(
    faults: list[Finding], outcomes: Sequence[Inspection], paths: Sequence[str], *, is_whole: bool
) -> Report:
    """The report about all outcomes; if some are missing, what they might use is not judged."""
    used = frozenset().union(*(outcome.used for outcome in outcomes))
    findings = list(faults)
    for finding in (finding for outcome in outcomes for finding in outcome.findings):
        # A comment that is unused here may be used for another specification.
        is_open = not is_whole or finding.diagnostic.primary in used
        if not (finding.diagnostic.code == "W0901" and is_open):
            findings.append(finding)
    ignored = sum(outcome.ignored for outcome in outcomes)
    return replace(report(findings, paths), ignored=ignored)


def inspect(path: str, overrides: Overrides) -> Inspection:
    """Compile a specification and judge what was found."""
    from specc import pipeline

    with one_run():
        result = pipeline.check_spec(path)
        judged = judge_findings(path, result, overrides)
    read = frozenset(real_path(source.path) for source in result.sources)
    return Inspection(path, tuple(judged.findings), judged.ignored, judged.used, read)


def _try_inspect(path: str, overrides: Overrides) -> Inspection:
    """Like `inspect`; a fault of specc in one file does not keep the others from being checked."""
    try:
        return inspect(path, overrides)
    except Exception as error:
        if is_caused_by_interrupt(error) or "SPECC_TRACEBACK" in os.environ:
            raise
        # Any other exception may not cross processes.
        return Inspection(path, fault=Exception(f"{type(error).__name__}: {error}"))


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
    sources = Sources(result.sources)
    found = settings_for(os.path.dirname(path))
    if found.source is not None:
        sources.add(found.source)
    settings = overrides.applied_to(found.settings)
    verdict = judge(result.diagnostics, sources, settings, not result.is_part)
    findings = resolve((*found.diagnostics, *verdict.diagnostics), sources)
    refused = verdict.refused or bool(found.diagnostics)
    return JudgedFindings(findings, refused, verdict.ignored, verdict.used)


def _inspect_into(outcomes: list[Inspection], paths: Sequence[str], overrides: Overrides) -> None:
    """Add the outcomes of files, in their order; those that are done also if interrupted."""
    job = partial(_try_inspect, overrides=overrides)
    workers = min(len(paths), cores())
    if len(paths) < PARALLEL_FROM or workers < 2:
        for path in paths:
            outcomes.append(job(path))
        return
    # What is imported before the fork is shared; every other way each process imports it again.
    from specc import pipeline  # noqa: F401  # imported for the processes that inherit it

    with processes(workers, "fork") as pool:
        with defer_signals():
            jobs = [pool.submit(job, path) for path in paths]
        try:
            found = [one.result() for one in jobs]
        except KeyboardInterrupt:
            outcomes += [one.result() for one in jobs if one.done() and one.exception() is None]
            raise
        outcomes += found


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
        errors: list[OSError] = []
        found = list(_files(argument, errors))
        for error in errors:
            message = f"the directory cannot be read: {reason_of(error)}"
            place, hint = Place(str(error.filename)), "check its permissions"
            faults.append(Diagnostic("E0001", message, place, help=hint))
        if not found and not errors:
            message = "no specification matches this pattern"
            if os.path.isdir(argument):
                message = "this directory has no specification"
            hint = "a specification is a .yaml file that begins with `specc: 1`"
            faults.append(Diagnostic("E0001", message, Place(argument), help=hint))
        for file in found:
            files.setdefault(os.path.realpath(file), file)
    parts = {file: is_part(file) for file in files.values()}
    systems = tuple(file for file in parts if not parts[file])
    return Targets(systems, tuple(file for file in parts if parts[file]), tuple(faults))


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
    if _is_pattern(argument):
        return any(os.path.realpath(m) == real for m in glob.iglob(argument, recursive=True))
    return os.path.realpath(argument) == real


def _is_pattern(argument: str) -> bool:
    return not os.path.lexists(argument) and _MAGIC.search(argument) is not None


def _files(argument: str, errors: list[OSError]) -> Iterator[str]:
    """Files of an argument, and errors about folders; what is hidden is passed over."""
    paths: list[Path] = []
    if os.path.isdir(argument):
        root = argument
        for folder, names, files in os.walk(argument, onerror=errors.append):
            names[:] = [name for name in names if not name.startswith(".")]
            paths += [Path(folder, file) for file in files if not file.startswith(".")]
    elif _is_pattern(argument):
        root = os.path.dirname(_MAGIC.split(argument)[0]) or "."
        paths += map(Path, glob.iglob(argument, recursive=True))
    else:
        yield argument
        return
    settings = settings_for(root).settings
    for path in sorted(paths):
        if path.suffix in _SUFFIXES and not settings.excludes(path):
            text = _content(str(path))
            if text is None or _VERSION.search(text):
                yield str(path)


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
