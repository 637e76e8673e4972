"""Checking specifications one by one or side by side in several processes."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from specc.cli.interruption import is_caused_by_interrupt
from specc.cli.targets import find_targets
from specc.diagnostics.report import Finding, Report, report, resolve, shown_path
from specc.limits import one_run
from specc.parallel import cores, processes
from specc.policy import Overrides, clear_cache, judge, settings_for
from specc.signals import defer_signals
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


def inspect_and_fix(arguments: Sequence[str], overrides: Overrides) -> Report:
    """Like `inspect_all`, after the repairs that findings carry were made in the files named."""
    from specc.cli.rewrite import ROUNDS, apply_repairs, print_unapplied, unwritable

    found = inspect_all(arguments, overrides)
    earlier = set[str]()
    for _ in range(ROUNDS):
        try:
            if not apply_repairs(found.findings, arguments, earlier):
                break
        except OSError as error:
            findings = [*found.findings, *resolve([unwritable(error)], Sources())]
            return replace(report(findings, ()), checked=found.checked, ignored=found.ignored)
        clear_cache()
        found = inspect_all(arguments, overrides)
    print_unapplied(found.findings, arguments)
    return found


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
