"""`specc explore`: what can go wrong between the machines of a system, with recordings of it."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc.atomic_files import sync, temporary_folder
from specc.cli import streams
from specc.cli.recordings import call_runtime, recorded_texts, write_package
from specc.diagnostics.report import Report, report
from specc.lang.show import show
from specc.model.requirement import horizon_s
from specc.refusal import Refused, reason_of

if TYPE_CHECKING:
    from specc.pipeline import Build, Result
    from specc.policy import Overrides
    from specc.tools.explore.explorer import Exploration
    from specc.tools.explore.findings import TracedFinding

VERSION = 1


def run_explore(options: Namespace) -> int:
    """Explore and print what was found; 1 if every run gets into it."""
    from specc import pipeline
    from specc.cli import inspect
    from specc.tools.explore.explorer import explore

    built = pipeline.build(options.spec, is_read=False) if options.traces else None
    result = built.result if built else pipeline.compile_spec(options.spec)
    if not result.ok or result.system is None:
        return streams.print_findings(result, options.spec, options.format) or 1
    found = explore(result.proofs, options.budget)
    traces = _record_all(found, built, options.spec, Path(options.traces)) if built else []
    interrupted = found.broken_off == "interrupted" or any(each.is_interrupted for each in traces)
    findings = judged_report(found, result, options.spec, inspect.overrides_of(options))
    if options.format == "json":
        text = _as_json(result.system.name, found, traces, interrupted=interrupted)
        streams.print_output(text, "json")
        code = streams.exit_code(findings)
    else:
        streams.print_output(_as_text(found, traces, options.budget))
        code = streams.print_report(findings)
    if interrupted:
        raise KeyboardInterrupt
    return code


def judged_report(found: Exploration, result: Result, spec: str, overrides: Overrides) -> Report:
    """The report about what was explored, as the settings want it."""
    from specc.cli import inspect

    explored = tuple(finding.diagnostic for finding in found.findings)
    # Other findings are left aside, and so are the comments about them.
    only_explored = replace(result, diagnostics=explored, is_part=True)
    judged = inspect.judge_findings(spec, only_explored, overrides)
    return replace(report(judged.findings, [spec]), ignored=judged.ignored)


def _as_text(found: Exploration, traces: Sequence[Recorded], budget: int) -> str:
    lines = [each.summary() for each in found.slices]
    lines += [f"{', '.join(names)}: not explored" for names in found.not_begun]
    if found.without_decisions:
        lines.append(f"{', '.join(found.without_decisions)}: nothing to decide")
    for name, axiom, verdict in found.assumptions:
        lines.append(f"{name}: assumption `{show(axiom.that)}`: {verdict}")
    for required in found.requirements:
        name = f"{required.requirement.name} `{required.requirement.that}`".strip()
        lines.append(f"requirement {name}: {required.summary()}")
    but = f"; {found.dead_ends}" if found.dead_ends else ""
    if found.is_incomplete:
        lines.append(
            f"not everything was explored in {budget} steps: --budget allows for more{but}"
        )
    elif not found.broken_off:
        lines.append(f"all in all: {found.status}{but}")
    for finding, trace in zip(found.with_traces, traces, strict=bool(traces)):
        outcome = trace.file or f"its trace is not recorded: {trace.lacks}"
        lines.append(f"{finding.code}, {finding.message}: {outcome}")
    return "".join(f"{line}\n" for line in lines)


def _as_json(
    system: str, found: Exploration, traces: Sequence[Recorded], *, interrupted: bool
) -> str:
    """An object with `version`, `system`, `slices`, `findings` and what holds of what is asked."""
    slices = [
        {
            "machines": list(each.names),
            "alike": list(each.equal_machines),
            "complete": each.complete,
            "status": each.status,
            "not_followed": list(each.widened),
            "not_judged": [
                {
                    "subsystem": name,
                    "state": state,
                    "conditions": [c.strip("`") for c in conditions],
                }
                for name, state, conditions in each.undecided_conditions
            ],
            "states": each.configurations,
            "steps": each.steps,
            "time": "counted" if each.counts_time or not each.is_timed else "any",
        }
        for each in found.slices
    ]
    assumptions = [
        {"subsystem": name, "that": show(axiom.that), "verdict": verdict}
        for name, axiom, verdict in found.assumptions
    ]
    requirements = [
        {
            "name": r.requirement.name,
            "that": r.requirement.that,
            "verdict": r.verdict,
            "asked": r.is_triggered,
            "until_a_step_fails": r.may_end_early,
            "answer_cannot_come": r.is_dead_end,
            "rests_on": list(r.assumptions),
            "given": list(r.given),
            "refused": r.refusal,
            "missing": list(r.missing),
            **_recording(r.finding, found, traces),
        }
        for r in found.requirements
    ]
    findings = [
        _finding(finding) | _recording(finding, found, traces) for finding in found.findings
    ]
    return streams.as_json(
        VERSION,
        system,
        status=found.status,
        slices=slices,
        assumptions=assumptions,
        requirements=requirements,
        interrupted=interrupted,
        findings=findings,
    )


def _recording(
    finding: TracedFinding | None, found: Exploration, traces: Sequence[Recorded]
) -> dict[str, Any]:
    """The recording of a trace, if recordings are wanted."""
    identities = [each.identity for each in found.with_traces]
    if not traces or finding is None or finding.identity not in identities:
        return {}
    trace = traces[identities.index(finding.identity)]
    return {"recording": trace.file or None, "lacks": trace.lacks}


def _finding(finding: TracedFinding) -> dict[str, Any]:
    steps = [
        {
            "time_s": float(step.time_s),
            "subsystem": step.walker.name,
            "from": step.transition.source,
            "to": step.transition.target,
            "row": step.transition.row,
            "sent": [f"y.{peer}.{name}" for (peer, name), _ in step.transition.sent],
        }
        for step in finding.trace.steps
    ]
    return {
        "code": finding.code,
        "message": finding.message,
        "decided": finding.trace.is_decided,
        "confirmed": finding.is_confirmed,
        "rests_on": list(finding.trace.choices),
        "trace": steps,
    }


# Recordings of traces; the runtime makes them of the generated code.


_INTERRUPTED = "interrupted"
AFTER = 10
"""Periods of the slowest machine that a recording goes on for when the trace is over."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """The recording of a trace, or why there is none."""

    file: str = ""
    lacks: str = ""

    @property
    def is_interrupted(self) -> bool:
        """Whether Ctrl-C came before it was made."""
        return self.lacks == _INTERRUPTED


def _record_all(found: Exploration, built: Build, spec: str, directory: Path) -> list[Recorded]:
    """Record the traces of `found.with_traces` in a directory, each in a file of its own.

    The directory is made if it is not there; it does not stay if nothing is written into it.

    Raises:
        Refused: a file cannot be written, or what writes them is not installed.
    """
    if not found.with_traces:
        return []
    created = [each for each in (directory, *directory.parents) if not each.exists()]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with temporary_folder(directory) as scratch:
            return list(_record_each(found, built, spec, scratch))
    except OSError as error:
        raise Refused(f"cannot write to {directory}: {reason_of(error)}") from error
    finally:
        with suppress(OSError):  # there is something in it
            for each in created:
                each.rmdir()


def _record_each(found: Exploration, built: Build, spec: str, scratch: Path) -> Iterator[Recorded]:
    findings, resting = found.with_traces, len(found.with_traces) - len(found.findings)
    package, base = write_package(built, scratch / "generated"), Path(os.path.dirname(spec))
    try:
        rehearsal = call_runtime("rehearsal", "Rehearsal", package, base)
    except Refused as refused:  # by the user's own modules
        yield from [Recorded(lacks=str(refused))] * len(findings)
        return
    texts = recorded_texts(built.result.sources)
    for number, finding in enumerate(findings, 1):
        file = scratch / f"{number}-{finding.code}.mcap"
        try:
            options = {"record": file, "texts": texts}
            shared = resting if number > len(found.findings) else 1
            lacks = _record(finding, built, rehearsal, options, shared)
        except KeyboardInterrupt:
            yield from [Recorded(lacks=_INTERRUPTED)] * (len(findings) - number + 1)
            return
        if not lacks:
            sync(file)
            file = file.replace(scratch.parent / file.name)
        yield Recorded(lacks=lacks) if lacks else Recorded(str(file))


def _record(
    finding: TracedFinding, built: Build, rehearsal: Any, options: dict[str, Any], shared: int
) -> str:
    """Record a run that goes as the trace of a finding; says why if there is none."""
    from specc.tools.explore.concrete import NotConcreteError, find_reports

    assert built.result.system is not None
    way = finding.trace
    try:
        inputs = find_reports(way, built.result.system, rehearsal, shared)
    except NotConcreteError as error:
        return str(error)
    slowest = max(rehearsal.ticks[step.walker.name] for step in way.steps)
    # A monitor has to see that what is required does not come.
    every = built.result.system.run_requirements
    required = [r for r in every if (r.that, r.place) == finding.identity[1:]]
    ahead_s = max((float(horizon_s(each.formula)) for each in required), default=0.0)
    after_s = max(AFTER * slowest * rehearsal.tick_s, 2 * ahead_s)
    duration_s = float(way.time_s) + after_s
    verdicts = call_runtime("rehearsal", "record", rehearsal, inputs, duration_s, options)
    for requirement, verdict in zip(every, verdicts, strict=True):
        if requirement in required and verdict != "violated":
            return f"in the run that follows it the requirement is {verdict}"
    return ""
