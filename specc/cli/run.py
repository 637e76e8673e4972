"""`specc run`: generated code in this process; the runtime is imported when it is needed."""

from __future__ import annotations

import os
import traceback
from argparse import Namespace
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc import output
from specc.atomic_files import temporary_folder
from specc.checks.plant import without_plant
from specc.cli import interruption
from specc.cli.inspect import JudgedFindings, judge_findings, overrides_of
from specc.cli.recordings import recorded_package, recorded_texts, resumed_constants
from specc.cli.streams import print_report
from specc.diagnostics import Diagnostic
from specc.diagnostics.report import report, resolve
from specc.source import Place, Sources

if TYPE_CHECKING:
    from specc.cli.page import PageRuns
    from specc.pipeline import Result


def run(options: Namespace) -> int:
    """Generate code into a temporary directory and simulate it."""
    if options.ui is None:
        return _run(options, None)
    from specc.cli.page import PageRuns

    with temporary_folder() as folder, PageRuns(options, folder) as runs:
        return runs.all(lambda chosen: _run(chosen, runs))


def _run(options: Namespace, runs: PageRuns | None) -> int:
    """Build and simulate; `runs` show it."""
    from specc import pipeline

    if options.scenario is not None:
        _take_scenario(options)
    if options.resume:
        options.set = resumed_constants(options)
    built = pipeline.build(
        options.spec,
        options.set,
        stop_when=options.stop_when,
        publish=tuple(options.publish),
        scenario=options.scenario,
        is_read=False,
        tests_all_rows=options.real_time,
    )
    judged = judge_for_run(options, built.result)
    findings = judged.findings
    if judged.refused:
        if runs is not None:
            runs.refuse(report(findings, []).findings)
        return print_report(report(findings, [options.spec])) or 1
    with temporary_folder() as scratch:
        directory = Path(scratch, "generated", built.system)
        findings += resolve(output.write(directory, built.files), Sources())
        if findings and (code := print_report(report(findings, [options.spec]))):
            return code
        options.past = None
        if options.resume:
            options.past = recorded_package(options, built, Path(scratch, "recorded"))
        return launch(directory, options, built.result.sources, runs)


def _take_scenario(options: Namespace) -> None:
    """Let a run be as its scenario says, unless the command line says otherwise.

    Raises Refused if there is no such scenario.
    """
    from specc import pipeline

    result = pipeline.read_spec(options.spec)
    scenario = result.scenario(options.scenario)
    if scenario is None:
        return  # the errors of the specification are reported
    options.set = dict(scenario.settings) | options.set
    if options.duration_s is None and options.cycles is None:
        options.duration_s, options.cycles = scenario.duration_s, scenario.cycles


def judge_for_run(options: Namespace, result: Result) -> JudgedFindings:
    """What is left of the findings about a specification; refused if it cannot be run as asked.

    A run needs what a specification can otherwise do without: a plant behind devices (O0501), and a
    task where cycles are to be counted (O0503).
    """
    judged = judge_findings(options.spec, result, overrides_of(options))
    if judged.refused or not result.can("run"):
        return replace(judged, refused=True)
    system, place = result.system, Place(options.spec, ("system",), "key")
    missing: list[Diagnostic] = []
    if system is not None and system.plant is None:
        missing += without_plant(system, place)
    if system is not None and system.task is None and options.cycles is not None:
        message = "nothing says what a run counts: there is no task"
        hint = "add `task:` with the transition that ends a cycle, or say `--duration`"
        missing.append(Diagnostic("O0503", message, place, help=hint))
    codes = {diagnostic.code for diagnostic in missing}
    findings = [finding for finding in judged.findings if finding.diagnostic.code not in codes]
    findings += resolve(missing, result.sources)
    return replace(judged, findings=findings, refused=bool(missing))


def launch(
    directory: Path, options: Namespace, sources: Sources, runs: PageRuns | None = None
) -> int:
    """Exit code of a run of the code in `directory`.

    Raises:
        SystemExit: the runtime ended the process by itself.
    """
    page = None if runs is None else runs.launch(options)
    is_recorded = options.record or options.resume or page is not None
    chosen = import_module("specc_runtime.options").chosen(
        options,
        directory=directory,
        base=Path(os.path.dirname(options.spec)),
        built_with=options.set,
        texts=recorded_texts(sources) if is_recorded else {},
    )
    runtime = import_module("specc_runtime.main")
    try:
        code = int(runtime.run(chosen, page) or 0)
        # While the runtime is imported, signals are heard by the command.
        return interruption.exit_code() if code == interruption.INTERRUPTED else code
    except Exception:  # noqa: BLE001 - operators are the user's own: their traceback mends them
        traceback.print_exc()
        return 1
