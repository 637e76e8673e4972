"""`specc replay` and `specc recover`: recordings of runs; the runtime reads them."""

from __future__ import annotations

import json
import os
import shlex
from argparse import Namespace
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc import output
from specc.atomic_files import temporary_folder
from specc.cli import streams
from specc.diagnostics.phrases import truncate
from specc.refusal import Refused, missing_package, reason_of

if TYPE_CHECKING:
    from specc.model.system import Subsystem
    from specc.pipeline import Result
    from specc.source import Place

SAME, DIFFERS, LOST = 0, 1, 3
_LONGEST, _LONGEST_VALUE, _LONGEST_REASON = 200, 2000, 1000
"""Of a name, a value and a reason from a file that are told."""
_MOST_VALUES = 10_000
"""Constants that are set for a run."""


def recover(options: Namespace) -> int:
    """Make a clean file with an index of a recording that was cut; 2 if there is none in it."""
    out = Path(options.out or options.file)
    try:
        saved = call_runtime("recording.reading", "Recovered", Path(options.file), out)
    except OSError as error:
        raise Refused(f"cannot write {out}: {reason_of(error)}") from error
    words = "it had been cut" if saved.cut else "it was whole"
    if saved.damaged:
        words = f"damaged parts left out: {saved.damaged}"
    streams.print_message(
        f"specc: {out}: {saved.messages} messages until {saved.last_s:.3f} s; {words}"
    )
    return SAME


def replay(options: Namespace) -> int:
    """Compare the steps of a recording with those of the specification as it is now."""
    from specc import pipeline

    told, spec = call_runtime("recording.replay", "about", Path(options.file)), options.spec
    if not spec:
        raise missing_spec(options.file, told, ["specc", "replay", options.file])
    skips = call_runtime("recording.messages", "followed_the_clock", told)
    built = pipeline.build(spec, recorded_constants(told), is_read=False, tests_all_rows=skips)
    result = built.result
    if not result.ok or result.system is None:
        return streams.print_findings(result, spec) or DIFFERS
    names = [s.qualified_name for s in result.system.subsystems]
    if options.subsystem and options.subsystem not in names:
        raise Refused(f"there is no subsystem {options.subsystem}; there are {', '.join(names)}")
    with temporary_folder() as scratch:
        package = Path(scratch, "generated", built.system)
        for diagnostic in output.write(package, built.files):
            raise Refused(diagnostic.message)
        base, file = Path(os.path.dirname(spec)), Path(options.file)
        only = options.subsystem or ""
        reading = call_runtime("recording.reading", "RecordFile", file)
        outcomes, watch = call_runtime(
            "recording.replay", "replay", package, base, file, only, options.until, reading
        )
    code = _tell(outcomes, result, options)
    if watch is not None:
        code = max(code, _required(watch))
    code = code or print_losses(reading)
    judged = watch is not None and any(r["verdict"] != "unknown" for r in watch.as_data())
    if judged or any(outcome.steps or outcome.difference for outcome in outcomes):
        return code
    raise Refused(f"nothing in {options.file} can be compared with {spec}")


def print_losses(reading: Any) -> int:
    """Say what of a recording is not there any more; the exit code."""
    words = [f"damaged parts left out: {reading.damaged}"] if reading.damaged else []
    words += [f"it was cut after {reading.last_s:.3f} s"] if reading.cut else []
    if words:
        streams.print_message(f"specc: {reading.path}: {'; '.join(words)}")
    return LOST if words else SAME


def _required(watch: Any) -> int:
    """Print what became of the requirements in the recorded run."""
    found = watch.as_data()
    call_runtime("progress.summary", "show_requirements", found)
    return DIFFERS if watch.violated else SAME


def _tell(outcomes: Sequence[Any], result: Result, options: Namespace) -> int:
    """Print what came of it, the earliest difference first."""
    found = sorted(
        (o.difference for o in outcomes if o.difference), key=lambda d: (d.time_s, d.subsystem)
    )
    for difference in found:
        streams.print_output("\n".join(_lines(difference, result)) + "\n")
    same = [o for o in outcomes if not o.difference and not o.unknown]
    unknown = [o for o in outcomes if o.unknown]
    for outcome in unknown:
        words = f"{outcome.steps} steps are the same, then it cannot be compared"
        name, why = (
            truncate(outcome.subsystem, _LONGEST),
            truncate(outcome.unknown, _LONGEST_REASON),
        )
        streams.print_output(f"{name}: {words}: {why}\n")
    for outcome in same:
        words = f"{outcome.steps} steps are the same"
        for begin_s, end_s in outcome.gaps:
            words += f"; lost from {begin_s:g} s, compared again from {end_s:g} s"
        if outcome.left_out:
            words += f"; not recorded: {', '.join(sorted(outcome.left_out))}"
        streams.print_output(f"{outcome.subsystem}: {words}\n")
    missing = unknown or any(outcome.left_out for outcome in same)
    return DIFFERS if found or (options.check and missing) else SAME


def _lines(difference: Any, result: Result) -> Iterator[str]:
    d = difference
    state, what = truncate(d.state, _LONGEST), truncate(d.what, _LONGEST)
    began = f"in {state}" if state else "in its first period"
    yield f"{d.subsystem} differs first at {d.time_s:g} s (stamp {d.stamp}), {began}: {what}"
    yield f"  recorded: {truncate(d.recorded, _LONGEST_VALUE)}"
    yield f"  now:      {truncate(d.now, _LONGEST_VALUE)}"
    assert result.system is not None
    subsystem = next(s for s in result.system.subsystems if s.qualified_name == d.subsystem)
    for what, place in _places(subsystem, d):
        span = result.sources.span(place)
        text = result.sources.line(span.file, span.line).strip()
        yield f"  {what}: {span.file}:{span.line}: {text}"


def _places(subsystem: Subsystem, difference: Any) -> Iterator[tuple[str, Place]]:
    """What in the specification is responsible: the row, and the condition or the assignment."""
    d = difference
    for row in subsystem.transitions:
        if row.label == d.row:
            yield "row", row.place
    state = next((s for s in subsystem.states if s.name == d.state), None)
    if d.condition and state is not None:
        ends = [c for _, c in state.behaviour.endings]
        asked = [r.condition for r in subsystem.transitions if r.source == d.state]
        yield from (
            (f"condition {c.name}", c.place) for c in (*ends, *asked) if c.name == d.condition
        )
    ran = next((s for s in subsystem.states if s.name == d.behaviour), None)
    if ran is not None:
        for assignment in ran.behaviour.assignments:
            if assignment.target == d.what:
                yield d.what, assignment.place
    for item in subsystem.memory:
        if item.name == d.what and not d.state:
            yield d.what, item.place


def missing_spec(file: str, told: Any, command: Sequence[str]) -> Refused:
    """Why nothing is done without a specification: the file must not choose whose code runs."""
    spec = str(told.get("spec", ""))
    try:
        inside = Path(os.path.realpath(spec)).is_relative_to(os.path.realpath("."))
        is_here = bool(spec) and inside and Path(spec).is_file()
    except (OSError, ValueError):  # what no file is called
        is_here = False
    if not is_here:
        return Refused(
            f"{file} is of {truncate(spec, _LONGEST) or 'no file'}, which is not here; say --spec"
        )
    words = shlex.join([*command, f"--spec={spec}"])
    return Refused(
        f"{file} is of {spec}; no recording decides which specification runs, so name it: {words}"
    )


def recorded_constants(told: Any) -> dict[str, str]:
    """Constants that were set for the run."""
    try:
        values = json.loads(told.get("set", "{}"))
        if len(values) <= _MOST_VALUES and all(isinstance(text, str) for text in values.values()):
            return dict(values)
    except (ValueError, AttributeError, RecursionError):
        pass
    raise Refused("the recording does not say which constants were set")


def call_runtime(module: str, function: str, *arguments: Any) -> Any:
    """What the runtime gives; raises Refused for what it cannot use."""
    try:
        made = getattr(import_module(f"specc_runtime.{module}"), function)
        return made(*arguments)
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    except Exception as error:
        if type(error).__name__ not in ("Unusable", "UsageError", "StepFailed", "OutputLost"):
            raise
        raise Refused(truncate(str(error), _LONGEST_REASON)) from error
