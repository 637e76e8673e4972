"""`specc run`: generated code in this process; the runtime is imported when it is needed."""

from __future__ import annotations

import os
import traceback
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc import output
from specc.atomic_files import temporary_folder
from specc.checks.plant import without_plant
from specc.cli import interruption
from specc.cli.inspect import JudgedFindings, judge_findings, overrides_of
from specc.cli.recorded_spec import recorded_package, recorded_texts, resumed_constants
from specc.cli.streams import print_report
from specc.diagnostics import Diagnostic
from specc.diagnostics.report import report, resolve
from specc.source import Place, Sources

if TYPE_CHECKING:
    from specc.pipeline import Result


def run(options: Namespace) -> int:
    """Generate code into a temporary directory and simulate it."""
    from specc import pipeline

    if options.resume:
        options.set = resumed_constants(options)
    built = pipeline.build(
        options.spec,
        options.set,
        stop_when=options.stop_when,
        publish=tuple(options.publish),
        is_read=False,
        tests_all_rows=options.real_time,
    )
    left = judge_for_run(options, built.result)
    findings = left.findings
    if left.refused:
        return print_report(report(findings, [options.spec])) or 1
    with temporary_folder() as scratch:
        directory = Path(scratch, "generated", built.system)
        findings += resolve(output.write(directory, built.files), Sources())
        if findings and (code := print_report(report(findings, [options.spec]))):
            return code
        options.past = None
        if options.resume:
            options.past = recorded_package(options, built, Path(scratch, "recorded"))
        return launch(directory, options, built.result.sources)


# What a run needs that a specification can otherwise do without: a plant, and a task to count.


def judge_for_run(options: Namespace, result: Result) -> JudgedFindings:
    """What is left of the findings about a specification; refused if it cannot be run as asked."""
    left = judge_findings(options.spec, result, overrides_of(options))
    if left.refused or not result.can("run"):
        return replace(left, refused=True)
    unmet = list(_missing(result, options.spec, counts=options.cycles is not None))
    codes = {found.code for found in unmet}
    findings = [found for found in left.findings if found.diagnostic.code not in codes]
    findings += resolve(unmet, result.sources)
    return replace(left, findings=findings, refused=bool(unmet))


def _missing(result: Result, path: str, *, counts: bool) -> Iterator[Diagnostic]:
    """O0501 without a plant behind devices, O0503 where cycles are to be counted without a task."""
    system, place = result.system, Place(path, ("system",), "key")
    if system is None:
        return
    if system.plant is None:
        yield from without_plant(system, place)
    if counts and system.task is None:
        yield Diagnostic(
            "O0503",
            "nothing says what a run counts: there is no task",
            place,
            help="add `task:` with the transition that ends a cycle, or say `--duration`",
        )


def launch(directory: Path, found: Namespace, sources: Sources) -> int:
    """Exit code of a run of the code in `directory`; `found` is what was asked on the command line.

    Raises:
        SystemExit: the runtime ended the process by itself.
    """
    options = import_module("specc_runtime.options").chosen(
        found,
        directory=directory,
        base=Path(os.path.dirname(found.spec)),
        built_with=found.set,
        texts=recorded_texts(sources) if found.record or found.resume else {},
    )
    runtime = import_module("specc_runtime.main")
    try:
        code = int(runtime.run(options) or 0)
        # While the runtime is imported, signals are heard by the command.
        return interruption.exit_code() if code == interruption.INTERRUPTED else code
    except Exception:  # noqa: BLE001 - operators are the user's own: their traceback mends them
        traceback.print_exc()
        return 1
