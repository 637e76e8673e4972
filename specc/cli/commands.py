"""What each command does: calls the compiler, prints what it found, gives the exit code."""

from __future__ import annotations

import json
import os
from argparse import Namespace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc.cli import streams
from specc.cli.streams import exit_code, tell
from specc.diagnostics import nearest
from specc.diagnostics.report import Finding, Report, report, resolve
from specc.source import Sources

if TYPE_CHECKING:
    from specc.diagnostics.render.visible import Form
    from specc.policy import Overrides
    from specc.read import Reach

# What the formats of reports are written in.
_FORMS: dict[str, Form] = {"json": "json", "sarif": "json", "github": "commands", "junit": "xml"}


def validate(options: Namespace) -> int:
    """Report what is wrong with specifications."""
    from specc.cli import inspect

    look = inspect.inspect_and_mend if options.fix else inspect.inspect_all
    try:
        found = look(options.specs, _overrides(options))
    except (inspect.InspectionInterrupted, inspect.InspectionFailed) as ended:
        _publish(ended.report, options.format)
        raise
    return _publish(found, options.format)


def build(options: Namespace) -> int:
    """Write, or with `--check` compare, the generated code of specifications."""
    from specc import output, pipeline
    from specc.cli.inspect import judged

    findings: list[Finding] = []
    stopped = False
    for path in options.specs:
        built = pipeline.build(path)
        found, refused = judged(path, built.result, _overrides(options))
        findings += found
        stopped |= not built.result.ok
        if built.result.ok and not refused:
            directory = Path(options.out, built.system)
            if options.check:
                put = output.stale(directory, built.files)
            else:
                put = output.write(directory, built.files, _writable(path, options.out))
            findings += resolve(put, Sources())
    return _publish(report(findings, options.specs), options.format) or int(stopped)


def _writable(spec: str, out: str) -> Reach:
    """Where a build may write: links below the working directory must not lead out of it."""
    from specc.policy import reach_of
    from specc.read import Reach

    here = Path.cwd()
    named = here if Path(os.path.abspath(out)).is_relative_to(here) else Path(out)
    return Reach((os.path.realpath(named), *reach_of(spec).folders))


def run(options: Namespace) -> int:
    """Generate code into a temporary directory and simulate it."""
    from tempfile import TemporaryDirectory

    from specc import output, pipeline
    from specc.cli.inspect import judged
    from specc.cli.run import launch, missing

    built = pipeline.build(options.spec, options.set)
    findings, refused = judged(options.spec, built.result, _overrides(options))
    if refused or not built.result.can("run"):
        return _publish(report(findings, [options.spec]), "text") or 1
    unmet = list(missing(built.result, options.spec, counts=options.cycles is not None))
    if unmet:
        codes = {found.code for found in unmet}
        findings = [found for found in findings if found.diagnostic.code not in codes]
        findings += resolve(unmet, built.result.sources)
        return _publish(report(findings, [options.spec]), "text") or 1
    with TemporaryDirectory(prefix="specc-") as scratch:
        directory = Path(scratch, "generated", built.system)
        findings += resolve(output.write(directory, built.files), Sources())
        if findings and (code := _publish(report(findings, [options.spec]), "text")):
            return code
        return launch(directory, options)


def fmt(options: Namespace) -> int:
    """Put files into the canonical layout."""
    from specc.cli.rewrite import run

    findings, files, differs = run(options)
    code = _publish(report(findings, files), "text") if findings else 0
    return code or int(differs and options.check)


def status(options: Namespace) -> int:
    """Print how far a specification has come along the procedure of section 3."""
    from specc import pipeline
    from specc.cli.status import as_json, as_text, progress

    result = pipeline.compile_spec(options.spec)
    if result.system is None:
        return _publish(report(resolve(result.diagnostics, result.sources), [options.spec]), "text")
    name, found = result.system.name, progress(result.system, result.diagnostics)
    as_asked = (
        as_json(name, found) if options.format == "json" else as_text(name or options.spec, found)
    )
    streams.show(as_asked, options.format)
    return 0


def init(options: Namespace) -> int:
    """Start a specification from a skeleton."""
    from specc.cli.skeletons import start

    return start(options.directory, options.skeleton)


def explain(options: Namespace) -> int:
    """Print the entry of a code, or the list of all codes."""
    from specc.diagnostics.code import all_codes, explanation, overview

    codes = all_codes()
    if options.code is None:
        streams.show(overview(codes))
        return 0
    entry = codes.get(options.code.upper())
    if entry is None:
        close = " or ".join(f"`{code}`" for code in nearest(options.code, codes))
        hint = f"did you mean {close}?" if close else "`specc explain` lists all codes"
        streams.say(f"specc: no code is called `{options.code}`; {hint}")
        return 2
    streams.show(explanation(entry))
    return 0


def ages(options: Namespace) -> int:
    """Print how old values are where they are read."""
    from specc.cli.ages import run_ages

    return run_ages(options)


def diff(options: Namespace) -> int:
    """Say how two specifications differ in meaning."""
    from specc.cli.differing import run_diff

    return run_diff(options)


def witness(options: Namespace) -> int:
    """Write tests that run into the errors that proofs found."""
    from specc.cli.witness import run_witness

    return run_witness(options)


def import_(options: Namespace) -> int:
    """Make a specification of files of another tool."""
    from specc.cli.importing import run_import

    return run_import(options)


def schema(options: Namespace) -> int:
    """Print the JSON Schema of specification files, for editors."""
    from specc import pipeline

    streams.show(json.dumps(pipeline.json_schema(), indent=2) + "\n", "json")
    return 0


def lsp(options: Namespace) -> int:
    """Serve an editor over standard input and output."""
    try:
        from specc.tools.lsp.server import serve
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("pygls", "lsprotocol"):
            raise
        streams.say("specc: pygls is not installed; `pip install 'specc[editor]'`")
        return 2
    return serve()


def _overrides(options: Namespace) -> Overrides:
    from specc.policy import Overrides

    return Overrides(options.select, options.ignore, options.strict)


def _publish(found: Report, form: str) -> int:
    """Print a report and give the exit code that it stands for."""
    if form == "text":
        return tell(found)
    # Each format is imported only when it is asked for.
    renderer = import_module(f"specc.diagnostics.render.{form}")
    streams.show(renderer.render(found), _FORMS[form])
    return exit_code(found)
