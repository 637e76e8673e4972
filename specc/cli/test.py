"""`specc test`: specifications are validated and explored, and the runs of their scenarios made."""

from __future__ import annotations

import os
import shlex
from argparse import Namespace
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from specc.atomic_files import temporary_folder, write_atomically
from specc.cli import inspect, streams
from specc.cli.explore import judged_report
from specc.cli.progress import RunProgress
from specc.cli.recordings import recorded_texts
from specc.cli.run import judge_for_run
from specc.diagnostics.phrases import counted, join_some, join_words
from specc.diagnostics.report import Report, report, resolve, shown_path
from specc.processes import cores
from specc.refusal import Refused, reason_of
from specc.source import Sources
from specc.tools.scenarios.judging import ScenarioResult, reasons_by_seeds, seeds_in_words
from specc.tools.scenarios.results import (
    Case,
    EarlierTest,
    as_junit,
    cases_of,
    digest_of,
    earlier_test,
    other_results,
    remove_results,
    write_results,
)
from specc.tools.scenarios.running import RunSettings, ScenarioRefusedError, ScenarioRuns

if TYPE_CHECKING:
    from specc.model.scenario import Scenario
    from specc.pipeline import Result

_OUT = "specc-test"
_WAIT_S = 0.2
_REASONS, _SEEDS = 4, 8
"""Reasons of a scenario that are shown, and seeds of one."""


@dataclass(eq=False)
class _Test:
    """The test of one specification."""

    spec: str
    folder: Path
    """For results and recordings."""
    earlier: EarlierTest | None = None
    """What of an earlier test is to be run again; None for all."""
    digest: str = ""
    """Of the texts of the specification, once it was read."""
    cases: list[Case] = field(default_factory=list)
    runs: ScenarioRuns | None = None
    scenarios: list[Scenario] = field(default_factory=list)
    """Those that are run."""
    names: list[str] = field(default_factory=list)
    """Of all scenarios."""
    is_shown: bool = False
    is_unreadable: bool = False

    @property
    def results(self) -> list[ScenarioResult]:
        if self.runs is not None:
            return self.runs.results
        return [ScenarioResult(scenario, ()) for scenario in self.scenarios]

    @property
    def specification(self) -> str:
        """Its name in results."""
        return os.path.relpath(self.spec)

    @property
    def is_failed(self) -> bool:
        is_case_failed = any(failure for _, failure in self.cases)
        return is_case_failed or any(result.is_failed for result in self.results)


def run_test(options: Namespace) -> int:
    """Validate, explore and run all scenarios; tell of each whether it passes.

    0 if all is well, 1 if something fails, 2 for wrong usage or an unreadable file, 130 after
    Ctrl-C, with the results of the runs that were over.
    """
    targets = inspect.find_targets(options.specs)
    if targets.faults:
        return streams.print_report(report(resolve(targets.faults, Sources()), []))
    out, systems = Path(options.out or _OUT), targets.systems
    _refuse_places(out, options.junit)
    tests = [_Test(spec, _folder(out, spec, systems)) for spec in systems]
    if not tests:
        raise Refused("there is no system to test, only parts for systems to use")
    _choose(tests, options)
    try:
        _carry_out(tests, options)
    except OSError as error:
        if error.filename is None:
            raise
        raise Refused(f"{error.filename}: {reason_of(error)}") from error
    if any(test.is_unreadable for test in tests):
        return streams.USAGE_ERROR
    return int(any(test.is_failed for test in tests))


def _refuse_places(out: Path, junit: str | None) -> None:
    """Raise Refused where results cannot be written, before runs are made for them."""
    if os.path.lexists(out) and not out.is_dir():
        raise Refused(f"{out} is no folder; name another one with --out")
    if junit == "":
        raise Refused("--junit names no file")
    if junit is not None and not Path(junit).parent.is_dir():
        raise Refused(f"{junit} cannot be written: there is no folder {Path(junit).parent}")
    if junit is not None and Path(junit).is_dir():
        raise Refused(f"{junit} is a folder; name a file with --junit")


def _folder(out: Path, spec: str, systems: Sequence[str]) -> Path:
    """The folder for the results of a specification, one of its own where there are several."""
    if len(systems) == 1:
        return out
    paths = [os.path.abspath(path) for path in systems]
    root = os.path.commonpath([os.path.dirname(path) for path in paths])
    return out / Path(os.path.relpath(os.path.abspath(spec), root)).with_suffix("")


def _choose(tests: Sequence[_Test], options: Namespace) -> None:
    """Note which scenarios did not pass before, if only these are to be run."""
    if options.last_failed:
        earlier = [earlier_test(test.folder, test.specification) for test in tests]
        if any(each.names or each.is_unknown for each in earlier):
            for test, each in zip(tests, earlier, strict=True):
                test.earlier = each
        else:
            streams.print_message("specc: nothing is known of scenarios that failed; all are run")


def _carry_out(tests: Sequence[_Test], options: Namespace) -> None:
    jobs = options.jobs or cores()
    with ExitStack() as stack:
        scratch = stack.enter_context(temporary_folder())
        executor = stack.enter_context(ThreadPoolExecutor(jobs))
        stack.callback(_close, tests)
        try:
            for number, test in enumerate(tests):
                _begin(test, options, executor, scratch / str(number))
                if options.fail_fast and test.is_failed:
                    break
            _finish(tests, options)
        finally:
            for test in tests:
                if test.runs is not None and not test.is_shown:
                    _show(test)
            _write(tests, options)


def _close(tests: Sequence[_Test]) -> None:
    for test in tests:
        if test.runs is not None:
            test.runs.close()


def _begin(test: _Test, options: Namespace, executor: ThreadPoolExecutor, scratch: Path) -> None:
    """Validate a specification, begin with the runs of its scenarios, and explore it meanwhile."""
    from specc import pipeline

    spec = test.spec
    result = pipeline.compile_spec(spec)
    judged = inspect.judge_findings(spec, result, inspect.overrides_of(options))
    found = replace(report(judged.findings, [spec]), ignored=judged.ignored)
    if found.findings:
        streams.print_report(found)
    is_sound = result.ok and not judged.refused and result.system is not None
    test.is_unreadable = streams.exit_code(found) == streams.USAGE_ERROR
    test.cases.append(("validate", "" if is_sound else _failure(found)))
    streams.print_output(f"{spec}: {'valid' if is_sound else 'INVALID'}\n")
    if not is_sound or result.system is None:
        return
    if not result.system.scenarios:
        streams.print_output(f"{spec}: no scenarios\n")
    test.digest = digest_of(recorded_texts(result.sources).values())
    test.names = [each.name for each in result.system.scenarios]
    _compare_with_earlier(test)
    test.scenarios = [each for each in result.system.scenarios if _is_chosen(each, test, options)]
    if test.scenarios:
        _begin_runs(test, result, options, executor, scratch)
    if options.budget:
        _explore(test, result, options)


def _compare_with_earlier(test: _Test) -> None:
    """Say what of an earlier test is run again; all scenarios if what failed is not there."""
    if test.earlier is None or not (test.earlier.names or test.earlier.is_unknown):
        return
    left = test.earlier.names.intersection(test.names)
    words = f"run again: {counted(len(left), 'scenario')}"
    if test.earlier.is_unknown:
        words = "all scenarios are run, since the specification could not be used the last time"
    elif not left:
        words = "all scenarios are run, since those that did not pass are not there any more"
    elif test.earlier.digest != test.digest:
        words += "; the specification has changed since"
    if test.earlier.is_unknown or not left:
        test.earlier = None
    streams.print_message(f"specc: {test.spec}: {words}")


def _is_chosen(scenario: Scenario, test: _Test, options: Namespace) -> bool:
    is_named = not options.names or any(text in scenario.name for text in options.names)
    return is_named and (test.earlier is None or scenario.name in test.earlier.names)


def _begin_runs(
    test: _Test,
    result: Result,
    options: Namespace,
    executor: ThreadPoolExecutor,
    scratch: Path,
) -> None:
    judged = judge_for_run(_as_run(options, test.spec), result)
    if judged.refused:
        found = report(judged.findings, [test.spec])
        streams.print_report(found)
        test.cases.append(("run", _failure(found)))
        return
    texts = recorded_texts(result.sources)
    settings = RunSettings(options.limit, test.folder, options.recordings, texts)
    try:
        test.runs = ScenarioRuns(test.spec, result, test.scenarios, executor, scratch, settings)
    except ScenarioRefusedError as refused:
        findings = resolve(refused.result.diagnostics, refused.result.sources)
        found = report(findings, [test.spec])
        name = refused.scenario.name
        streams.print_message(f"specc: {test.spec}: scenario {name} cannot be run:")
        streams.print_report(found)
        test.cases.append((name, _failure(found)))


def _as_run(options: Namespace, spec: str) -> Namespace:
    """The options of a run of a specification: scenarios say what else a run is like."""
    policy = {name: getattr(options, name) for name in ("select", "ignore", "strict")}
    return Namespace(spec=spec, cycles=None, **policy)


def _explore(test: _Test, result: Result, options: Namespace) -> None:
    from specc.tools.explore.explorer import explore

    found = explore(result.proofs, options.budget)
    if found.broken_off == "interrupted":
        raise KeyboardInterrupt
    judged = judged_report(found, result, test.spec, inspect.overrides_of(options))
    if judged.findings:
        streams.print_report(judged)
    failure = _failure(judged) if streams.exit_code(judged) else ""
    test.cases.append(("explore", failure))
    words = "not everything was explored" if found.is_incomplete else found.status
    streams.print_output(f"{test.spec}: explored: {words}\n")


def _failure(found: Report) -> str:
    """The messages of the errors of a report."""
    errors = [each for each in found.findings if each.diagnostic.severity == "error"]
    return "\n".join(each.diagnostic.message for each in errors or found.findings) or "refused"


def _finish(tests: Sequence[_Test], options: Namespace) -> None:
    """Wait for all runs, and tell of each specification when they are over."""
    running = [test for test in tests if test.runs is not None]
    if options.names and not any(test.scenarios for test in tests):
        names = join_words((repr(name) for name in options.names), "or")
        known = [name for test in tests for name in test.names]
        hint = f"; there are {join_some(known, _SEEDS)}" if known else ""
        raise Refused(f"no scenario has {names} in its name{hint}")
    progress = RunProgress(sum(test.runs.count for test in running if test.runs), 0)
    try:
        for test in running:
            assert test.runs is not None
            while not test.runs.collect(_WAIT_S):
                progress.update(sum(each.runs.done for each in running if each.runs))
                if options.fail_fast and test.is_failed:
                    test.runs.stop()
            progress.close()
            _show(test)
            if options.fail_fast and test.is_failed:
                return
    finally:
        progress.close()


# What is told.


def _show(test: _Test) -> None:
    """A line for each scenario, and why runs of it failed."""
    test.is_shown = True
    width = max((len(each.name) for each in test.scenarios), default=0)
    begun = [result for result in test.results if result.runs]
    for result in begun:
        streams.print_output("".join(f"{line}\n" for line in _lines(result, test, width)))
    if missing := len(test.scenarios) - len(begun):
        streams.print_output(f"{counted(missing, 'scenario')} not run\n")


def _lines(result: ScenarioResult, test: _Test, width: int) -> Iterator[str]:
    name, count, estimate = result.scenario.name, len(result.runs), result.estimate
    verdict = "passed" if result.is_passed else "FAILED" if result.is_failed else "cut"
    line = f"{verdict:6}  {name:{width}}  "
    line += f"{result.passes} of {count}"
    if estimate and count > 1 and estimate.low is not None and estimate.high is not None:
        line += f" (95 %: {estimate.low:.0%} to {estimate.high:.0%})"
    if result.is_failed and result.required < len(result.scenario.seeds):
        line += f", {result.required} have to pass"
    if count < len(result.scenario.seeds):
        line += f", of {len(result.scenario.seeds)} seeds"
    yield line + (f"; {result.remark}" if result.remark else "")
    reasons = reasons_by_seeds([run for run in result.runs if not run.is_passed])
    for reason, runs in reasons[:_REASONS]:
        yield f"  {seeds_in_words(runs, _SEEDS)}: {reason}"
    if len(reasons) > _REASONS:
        yield f"  and {counted(len(reasons) - _REASONS, 'other reason')}"
    failed = next((run for run in result.runs if not run.is_passed), None)
    if failed is not None:
        words = ["specc", "run", test.spec, "--scenario", name, "--seed", str(failed.seed)]
        yield f"  again: {shlex.join(words)}"
    recorded = next((run for run in result.runs if run.recording), None)
    if recorded is not None:
        file = str(test.folder / recorded.recording)
        yield f"  see:   {shlex.join(['specc', 'view', file, '--spec', test.spec])}"


def _write(tests: Sequence[_Test], options: Namespace) -> None:
    """Write the results of specifications; of those that pass only where it was asked for."""
    for test in tests:
        results, run = test.results, {scenario.name for scenario in test.scenarios}
        others = other_results(test.folder, test.specification, run, test.names)
        is_passed = all(result.is_passed for result in results)
        has_news = not is_passed and any(result.runs for result in results)
        if results and is_passed:
            remove_results(test.folder, test.specification, run)
        if not test.digest and len(tests) > 1:
            # `--last-failed`, which may know of failures in others, runs it whole.
            write_results(test.folder, test.specification, "", ())
        elif results and (options.out or has_news or (others and is_passed)):
            file = write_results(test.folder, test.specification, test.digest, results, others)
            streams.print_output(f"{shown_path(str(file))}\n")
    is_failed = any(result.is_failed for test in tests for result in test.results)
    if is_failed and options.recordings and find_spec("mcap") is None:
        words = "mcap, of specc[record], is not installed"
        streams.print_message(f"specc: failures are not recorded: {words}")
    if options.junit:
        suites = [(test.spec, _cases(test)) for test in tests]
        write_atomically(Path(options.junit), as_junit(suites))


def _cases(test: _Test) -> list[Case]:
    """What JUnit shows of a specification; a scenario that was refused has its case already."""
    cases = test.cases or [("validate", None)]
    names = {name for name, _ in cases}
    return [*cases, *cases_of([each for each in test.results if each.scenario.name not in names])]
