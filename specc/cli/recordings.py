"""`specc replay` and `specc recover`, and what other commands ask of recordings of runs.

The runtime reads recordings. A file decides nothing about which code runs.
"""

from __future__ import annotations

import json
import os
import shlex
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc import output
from specc.atomic_files import temporary_folder
from specc.cli import streams
from specc.diagnostics import blocks
from specc.diagnostics.phrases import join_some, truncate
from specc.refusal import Refused, missing_package, reason_of
from specc.resources import is_library_part
from specc.source import COMMAND_LINE, Sources, beside, real_path, relative_path

if TYPE_CHECKING:
    from specc.model.system import Subsystem
    from specc.pipeline import Build, Result
    from specc.source import Place

SAME, DIFFERS, LOST = 0, 1, 3
_LONGEST, _LONGEST_VALUE, _LONGEST_REASON = 200, 2000, 1000
"""Of a name, a value and a reason from a file that are shown."""
_MOST_VALUES = 10_000
"""Constants that are set for a run."""
_MOST_NAMED = 3
"""Faults or names of a recorded specification that a message lists."""
_NO_FILE = "E0208"
"""A specification names a file that is not there."""


def call_runtime(module: str, function: str, *arguments: Any) -> Any:
    """What the runtime gives; raises Refused for what it cannot use."""
    try:
        return getattr(import_module(f"specc_runtime.{module}"), function)(*arguments)
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    except Exception as error:
        if type(error).__name__ not in ("Unusable", "UsageError", "StepFailed", "OutputLost"):
            raise
        raise Refused(truncate(str(error), _LONGEST_REASON)) from error


def loss_words(reading: Any) -> list[str]:
    """What of a recording is not there any more, in words."""
    words = [f"damaged parts left out: {reading.damaged}"] if reading.damaged else []
    return words + ([f"it was cut after {reading.last_s:.3f} s"] if reading.cut else [])


def print_losses(reading: Any) -> int:
    """Say what of a recording is not there any more; the exit code."""
    if words := loss_words(reading):
        streams.print_message(f"specc: {reading.path}: {'; '.join(words)}")
    return LOST if words else SAME


def missing_spec(file: str, about: Any, command: Sequence[str]) -> Refused:
    """Why nothing is done without a specification: the file must not choose whose code runs."""
    if not (spec := spec_here(about)):
        name = truncate(str(about.get("spec", "")), _LONGEST) or "no file"
        return Refused(f"{file} is of {name}, which is not here; say --spec")
    words = shlex.join([*command, f"--spec={spec}"])
    return Refused(
        f"{file} is of {spec}; no recording decides which specification runs, so name it: {words}"
    )


def spec_here(about: Any) -> str:
    """The file with the specification of a recording, if it is in the current folder; or empty."""
    spec = str(about.get("spec", ""))
    try:
        inside = Path(os.path.realpath(spec)).is_relative_to(os.path.realpath("."))
        is_here = bool(spec) and inside and Path(spec).is_file()
    except (OSError, ValueError):  # what no file is called
        is_here = False
    return spec if is_here else ""


def recorded_constants(about: Any) -> dict[str, str]:
    """Constants that were set for the run."""
    try:
        values = json.loads(about.get("set", "{}"))
        if len(values) <= _MOST_VALUES and all(isinstance(text, str) for text in values.values()):
            return dict(values)
    except (ValueError, AttributeError, RecursionError):
        pass
    raise Refused("the recording does not say which constants were set")


def constants_for(file: object, about: Any, spec: str) -> dict[str, str]:
    """Constants that were set for the run, to compile the user's specification with.

    Raises Refused if the recording is of another system.
    """
    from specc import pipeline

    recorded = about.get("system", "")
    system = pipeline.read_spec(spec).system
    if recorded and system and system.name not in ("", recorded):
        name = truncate(recorded, _LONGEST)
        raise Refused(f"{file} is a recording of {name}, and {spec} describes {system.name}")
    return recorded_constants(about)


def as_recorded(result: Result, about: Any) -> Result:
    """A specification as the recorded run had it: in its scenario, if that is still there."""
    scenarios = result.system.scenarios if result.system else ()
    name = about.get("scenario", "")
    return result.in_scenario(name) if name in {each.name for each in scenarios} else result


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
    until = f"{saved.messages} messages until {saved.last_s:.3f} s"
    streams.print_message(f"specc: {out}: {until}; {words}")
    return SAME


# `specc replay`.


def replay(options: Namespace) -> int:
    """Compare the steps of a recording with those of the specification as it is now."""
    from specc import pipeline

    file, spec = Path(options.file), options.spec
    about = call_runtime("recording.replay", "about", file)
    if not spec:
        raise missing_spec(options.file, about, ["specc", "replay", options.file])
    skips = call_runtime("recording.messages", "followed_the_clock", about)
    result = pipeline.compile_spec(spec, constants_for(file, about, spec))
    if not result.ok or result.system is None:
        return streams.print_findings(result, spec) or DIFFERS
    built = pipeline.generated(
        as_recorded(result, about), spec, is_read=False, tests_all_rows=skips
    )
    result = built.result
    if not built.files or result.system is None:
        return streams.print_findings(result, spec) or DIFFERS
    names = [s.qualified_name for s in result.system.subsystems]
    only = options.subsystem or ""
    if only and only not in names:
        raise Refused(f"there is no subsystem {only}; there are {', '.join(names)}")
    with temporary_folder() as scratch:
        package = write_package(built, scratch / "generated")
        base = Path(os.path.dirname(spec))
        reading = call_runtime("recording.reading", "RecordFile", file)
        outcomes, watch = call_runtime(
            "recording.replay", "replay", package, base, file, only, options.until, reading
        )
    code = _print_outcomes(outcomes, result, options.check)
    requirements = [] if watch is None else watch.as_data()
    if watch is not None:
        call_runtime("progress.summary", "show_requirements", requirements)
        code = max(code, DIFFERS if watch.violated else SAME)
    code = code or print_losses(reading)
    is_judged = any(each["verdict"] != "unknown" for each in requirements)
    if is_judged or any(outcome.steps or outcome.difference for outcome in outcomes):
        return code
    raise Refused(f"nothing in {options.file} can be compared with {spec}")


def write_package(built: Build, folder: Path) -> Path:
    """Write generated code below a folder. Raises Refused."""
    package = folder / built.system
    for diagnostic in output.write(package, built.files):
        raise Refused(diagnostic.message)
    return package


def _print_outcomes(outcomes: Sequence[Any], result: Result, checks: bool) -> int:
    """Print the differences, the earliest first, then what is the same; the exit code."""
    differences = sorted(
        (o.difference for o in outcomes if o.difference), key=lambda d: (d.time_s, d.subsystem)
    )
    lines = [line for difference in differences for line in _lines(difference, result)]
    same = [o for o in outcomes if not o.difference and not o.unknown]
    unknown = [o for o in outcomes if o.unknown]
    for outcome in unknown:
        words = f"{outcome.steps} steps are the same, then it cannot be compared"
        name = truncate(outcome.subsystem, _LONGEST)
        lines.append(f"{name}: {words}: {truncate(outcome.unknown, _LONGEST_REASON)}")
    for outcome in same:
        words = f"{outcome.steps} steps are the same"
        for begin_s, end_s in outcome.gaps:
            words += f"; lost from {begin_s:g} s, compared again from {end_s:g} s"
        if outcome.left_out:
            words += f"; not recorded: {', '.join(sorted(outcome.left_out))}"
        lines.append(f"{outcome.subsystem}: {words}")
    streams.print_output("".join(f"{line}\n" for line in lines))
    is_partial = unknown or any(outcome.left_out for outcome in same)
    return DIFFERS if differences or (checks and is_partial) else SAME


def _lines(difference: Any, result: Result) -> Iterator[str]:
    d = difference
    state, what = truncate(d.state, _LONGEST), truncate(d.what, _LONGEST)
    where = f"in {state}" if state else "in its first period"
    yield f"{d.subsystem} differs first at {d.time_s:g} s (stamp {d.stamp}), {where}: {what}"
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
    yield from (("row", row.place) for row in subsystem.transitions if row.label == d.row)
    states = {state.name: state.behaviour for state in subsystem.states}
    if d.condition and d.state in states:
        ends = [c for _, c in states[d.state].endings]
        rows = [r.condition for r in subsystem.transitions if r.source == d.state]
        for condition in (*ends, *rows):
            if condition.name == d.condition:
                yield f"condition {condition.name}", condition.place
    assignments = states[d.behaviour].assignments if d.behaviour in states else ()
    yield from ((d.what, each.place) for each in assignments if each.target == d.what)
    if not d.state:
        yield from ((d.what, each.place) for each in subsystem.memory if each.name == d.what)


# The specification in a recording, as code: for a run that goes on from it with another one.


def recorded_spec(
    texts: Mapping[str, str], values: Mapping[str, str], file: str = "the file"
) -> Result:
    """The specification in a recording, as data; no other file is read. Raises Refused."""
    from specc import pipeline

    if not texts:
        raise Refused(f"there is no specification in {file}")
    spec = next(iter(texts))
    result = pipeline.read_texts(spec, texts_by_path(texts, spec), values)
    # Files that it names are not read, so it does not matter from where this is called.
    wrong = (d for d in result.diagnostics if blocks(d.code, "build") and d.code != _NO_FILE)
    errors = [d.message for d in wrong]
    if errors or result.system is None:
        what = truncate(join_some(errors, _MOST_NAMED, "; "), _LONGEST_REASON)
        raise Refused(f"the specification in {file} cannot be read: {what}")
    return result


def recorded_texts(sources: Sources) -> dict[str, str]:
    """The files of a specification, as a recording has them.

    They are named as they are found from here; if some are elsewhere, from the folder of them all.
    """
    texts = {
        s.path if is_library_part(s.path) else os.path.abspath(s.path): s.text
        for s in sources
        if s.path not in COMMAND_LINE
    }
    own = [path for path in texts if not is_library_part(path)]
    here = os.path.join(os.getcwd(), "")
    are_here = all(path.startswith(here) for path in own)
    root = here if are_here else os.path.commonpath(map(os.path.dirname, own))
    # A recording cannot hold bytes of a name that are no UTF-8: they are written out.
    names = (relative_path(path, root).encode("utf-8", "surrogateescape") for path in texts)
    decoded = (name.decode("utf-8", "backslashreplace") for name in names)
    return dict(zip(decoded, texts.values(), strict=True))


def texts_by_path(texts: Mapping[str, str], spec: str) -> dict[str, str]:
    """The recorded texts by where they would be, if the first one were that of `spec`."""
    first = os.path.dirname(next(iter(texts), ""))
    others = {
        real_path(beside(spec, relative_path(name, first or "."))): text
        for name, text in list(texts.items())[1:]
    }
    return others | {real_path(spec): text for text in list(texts.values())[:1]}


def resumed_constants(options: Namespace) -> dict[str, str]:
    """What a run sets that goes on: what was set for the recorded one, unless `--set` says more.

    Names that the specification does not have are reported and left out. Raises Refused.
    """
    from specc import pipeline

    about, _ = call_runtime("recording.messages", "recorded", Path(options.resume[0]))
    recorded = {n: text for n, text in recorded_constants(about).items() if n not in options.set}
    if not recorded:
        return dict(options.set)
    result = pipeline.read_spec(options.spec)
    unknown = [name for name in recorded if result.system and name not in result.units]
    if unknown:
        names = join_some(unknown, _MOST_NAMED)
        words = f"{options.spec} has no {names}, which the recorded run has set"
        streams.print_message(f"specc: --from: {words}")
    return {n: text for n, text in recorded.items() if n not in unknown} | dict(options.set)


def recorded_package(options: Namespace, built: Build, scratch: Path) -> Path | None:
    """Code of what was recorded, if that is not what was `built`; None where it cannot be run.

    The specification in the file may name no Python that the one at hand does not name, as the same
    part, by the same name, with the same signature. Raises Refused for a file that cannot be used.
    """
    about, texts = call_runtime("recording.messages", "recorded", Path(options.resume[0]))
    values, own = recorded_constants(about), recorded_texts(built.result.sources)
    if [*texts.values()] == [*own.values()] and values == dict(options.set):
        return None
    try:
        return _package(options.spec, values, texts, built, scratch)
    except Refused as refused:
        words = f"the recorded specification cannot be run: {refused}"
        streams.print_message(f"specc: --from: {words}")
        return None


def _package(
    spec: str, values: Mapping[str, str], texts: Mapping[str, str], built: Build, scratch: Path
) -> Path:
    """Compile the recorded texts into `scratch`; the folder of the code. Raises Refused."""
    from specc import pipeline
    from specc.lower.code import named_code

    result = pipeline.compile_spec(spec, values, texts_by_path(texts, spec))
    if not result.ok or result.system is None or built.result.system is None:
        errors = [d.message for d in result.diagnostics if blocks(d.code, "build")]
        raise Refused("it has errors: " + "; ".join(errors[:_MOST_NAMED]))
    known = named_code(built.result.system)
    if foreign := named_code(result.system) - known:
        modules, names = {each.python for each in known}, {str(each) for each in known}
        # Code from modules that the specification names as well comes last.
        words = [
            f"{each} with another type of that name" if str(each) in names else str(each)
            for each in sorted(foreign, key=lambda code: (code.python in modules, str(code)))
        ]
        raise Refused(f"it names {join_some(words, _MOST_NAMED, '; ')}; {spec} does not")
    recorded = pipeline.generated(result, spec, is_read=False)
    if not recorded.files:
        raise Refused(recorded.result.diagnostics[-1].message)
    return write_package(recorded, scratch)
