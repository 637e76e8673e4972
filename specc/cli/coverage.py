"""`specc coverage`: what recorded runs tried of their specification, and what none of them did."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc.cli import streams
from specc.cli.recordings import (
    call_runtime,
    constants_for,
    print_losses,
    recorded_constants,
    recorded_spec,
    recorded_texts,
)
from specc.diagnostics import Diagnostic, merge_duplicates
from specc.diagnostics.phrases import counted, join_some, truncate
from specc.diagnostics.report import Report, brief, report, resolve, shown_path
from specc.refusal import Refused
from specc.tools.coverage import KINDS, Coverage, CoverageItem, ForeignRunError, Share, total
from specc.tools.coverage.gaps import UNKNOWN, Reach, gap_findings, ignored_gaps, reach_of
from specc.tools.coverage.same import differences

if TYPE_CHECKING:
    from specc.model.system import System
    from specc.pipeline import Result

VERSION = 1
_LONGEST, _MOST_NAMED = 1000, 3


@dataclass(slots=True)
class _Run:
    """A recording: its metadata, the texts of its specification, and what its machines did."""

    file: str
    about: Mapping[str, str]
    texts: Mapping[str, str]
    reading: Any
    passages: Any = field(repr=False)


def coverage(options: Namespace) -> int:
    """Count what the runs tried; 1 if it is less than `--fail-under`, 3 for a damaged file."""
    first, *_ = runs = [_run(file) for file in _files(options.files)]
    if options.spec:
        result = _given(first, options.spec)
    else:
        result = recorded_spec(first.texts, recorded_constants(first.about), first.file)
    if not result.ok and options.spec:
        return streams.print_findings(result, options.spec, options.format)
    if result.system is None:
        return 1
    _check_same(runs, result, options.spec or first.file)
    found = _counted(runs, result.system)
    findings = gap_findings(found, _reach(found, result, options))
    left_out = ignored_gaps(findings, result.sources)
    shown = {item: each for item, each in findings.items() if item not in left_out}
    agents = [agent.name for agent in result.system.agents]
    merged = merge_duplicates(shown.values(), agents)
    gaps = report(resolve(merged, result.sources), [options.spec or next(iter(runs[0].texts))])
    if options.format == "text":
        streams.print_output(_as_text(found, runs, left_out))
        streams.print_output(_gap_lines(gaps, found, options))
    elif options.format == "json":
        streams.print_output(_as_json(found, runs, result, findings, left_out), "json")
    else:
        streams.print_report(gaps, options.format)
    return _exit_code(runs, total(found.shares(left_out).values()), options.fail_under)


def _files(words: Sequence[str]) -> list[str]:
    """The recordings that are named, each once; of a folder those in it. Raises Refused."""
    found: dict[str, str] = {}
    for word in words:
        files = [word]
        if os.path.isdir(word):
            files = sorted(map(str, Path(word).glob("*.mcap")))
            if not files:
                raise Refused(f"{word} has no recordings, *.mcap; `specc run --record` makes them")
        for file in files:
            found.setdefault(os.path.realpath(file), file)
    return [*found.values()]


def _run(file: str) -> _Run:
    path = Path(file)
    about, texts = call_runtime("recording.messages", "recorded", path)
    reading = call_runtime("recording.reading", "RecordFile", path)
    passages = call_runtime("recording.passages", "passages", path, reading)
    return _Run(file, about, texts, reading, passages)


def _check_same(runs: Sequence[_Run], result: Result, name: str) -> None:
    """Raises Refused for recordings of other specifications than that one."""
    assert result.system is not None
    own = recorded_texts(result.sources)
    known = {tuple(own.values())}
    for run in runs:
        if (texts := tuple(run.texts.values())) in known:
            continue
        words = f"{run.file} is a recording of another specification than {name}"
        old, new = (recorded_spec(each, {}, run.file).system for each in (run.texts, own))
        assert old is not None and new is not None
        if old.name != new.name:
            raise Refused(f"{words}: of {truncate(old.name, _LONGEST)}, not {new.name}")
        if found := differences(old, new):
            what = truncate(join_some(found, _MOST_NAMED), _LONGEST)
            raise Refused(f"{words}: they differ in {what}; count them apart, or record it anew")
        known.add(texts)


def _counted(runs: Sequence[_Run], system: System) -> Coverage:
    """What all runs tried. Raises Refused for one that is of another system."""
    found = Coverage(system)
    for run in runs:
        try:
            found.add(run.passages.counts, run.passages.report)
        except ForeignRunError as error:
            words = truncate(str(error), _LONGEST)
            words = f"{run.file}: {words}, which the specification in {runs[0].file} does not have"
            raise Refused(words) from None
    return found


def _given(run: _Run, spec: str) -> Result:
    """The user's specification. Raises Refused."""
    from specc import pipeline

    return pipeline.compile_spec(spec, constants_for(run.file, run.about, spec))


def _reach(found: Coverage, result: Result, options: Namespace) -> Reach:
    """What exploring says of rows, if some were taken in no run and the specification is given."""
    if not options.budget or not options.spec or all(i.kind != "row" for i in found.gaps):
        return UNKNOWN
    from specc.tools.explore.explorer import explore

    explored = explore(result.proofs, options.budget)
    if explored.broken_off == "interrupted":
        raise KeyboardInterrupt
    return reach_of(explored)


def _exit_code(runs: Sequence[_Run], share: Share, least: float | None) -> int:
    code = max(int(print_losses(run.reading)) for run in runs)
    if least is not None and 100 * share.covered < least * share.of:
        words = f"{share.percent:.1f} % is less than the {least:g} % of --fail-under"
        streams.print_message(f"specc: {words}")
        code = code or 1
    return code


def _as_text(found: Coverage, runs: Sequence[_Run], left_out: Collection[CoverageItem]) -> str:
    """A table of the machines, and what counts for all of them."""
    shares = found.shares(left_out)
    of_kind = {kind: total(s for (k, _), s in shares.items() if k == kind) for kind in KINDS}
    kinds, none = KINDS[:4], Share(0, 0)
    rows = [["", *(f"{kind}s" for kind in kinds)]]
    for name in found.machines:
        rows.append([name, *(str(shares.get((kind, name), none)) for kind in kinds)])
    if len(found.machines) > 1:
        rows.append(["all", *(str(of_kind[kind]) for kind in kinds)])
    time_s = sum(run.passages.end_s for run in runs)
    lines = [f"{counted(len(runs), 'run')}, {time_s:.6g} s\n", streams.format_table(rows)]
    for kind in KINDS[4:]:
        if of_kind[kind].of:
            lines.append(f"{kind}s: {of_kind[kind]}\n")
    share = total(shares.values())
    but = f", but for {counted(len(left_out), 'gap')} left out by comments" if left_out else ""
    lines.append(f"all in all: {share.percent:.1f} % ({share}){but}\n")
    return "".join(lines)


def _gap_lines(gaps: Report, found: Coverage, options: Namespace) -> str:
    lines = [f"{gap.diagnostic.code} {brief(gap)}\n" for gap in gaps.shown]
    if gaps.not_shown:
        lines.append(f"{counted(gaps.not_shown, 'more gap')} not shown\n")
    if not options.spec and any(item.kind == "row" for item in found.gaps):
        lines.append("which rows can be taken at all is explored with --spec SPEC\n")
    return "".join(lines)


def _as_json(
    found: Coverage,
    runs: Sequence[_Run],
    result: Result,
    findings: Mapping[CoverageItem, Diagnostic],
    left_out: Collection[CoverageItem],
) -> str:
    """An object with what is covered, and each item with its count, place and gap."""

    def share(each: Share) -> dict[str, Any]:
        return {"covered": each.covered, "of": each.of, "percent": each.percent}

    def items() -> Iterator[dict[str, Any]]:
        for item, count in found.counts.items():
            span = result.sources.span(item.place)
            finding = findings.get(item)
            yield {
                "kind": item.kind,
                "subsystem": item.subsystem or None,
                "name": item.name,
                **({} if item.truth is None else {"truth": item.truth}),
                "count": count,
                "file": shown_path(span.file),
                "line": span.line,
                "gap": finding and {"code": finding.code, "message": finding.message},
                "ignored": item in left_out,
            }

    shares = found.shares(left_out)
    assert result.system is not None
    return streams.as_json(
        VERSION,
        result.system.name,
        runs=[{"file": run.file, "simulated_s": run.passages.end_s} for run in runs],
        all=share(total(shares.values())),
        kinds={
            f"{kind}s": share(total(s for (k, _), s in shares.items() if k == kind))
            for kind in KINDS
        },
        items=list(items()),
    )
