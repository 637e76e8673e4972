"""The commands that only call the compiler or a tool: they print what it made or found."""

from __future__ import annotations

import os
from argparse import Namespace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc.cli import inspect, streams
from specc.diagnostics import Diagnostic, nearest
from specc.diagnostics.report import Finding, report, resolve
from specc.refusal import Refused, missing_package, reason_of
from specc.source import Place, Sources, real_path

if TYPE_CHECKING:
    from specc.read import AllowedPaths


def validate(options: Namespace) -> int:
    """Report what is wrong with specifications."""
    look = inspect.inspect_and_fix if options.fix else inspect.inspect_all
    try:
        found = look(options.specs, inspect.overrides_of(options))
    except (inspect.InspectionInterrupted, inspect.InspectionFailed) as ended:
        streams.print_report(ended.report, options.format)
        raise
    return streams.print_report(found, options.format)


def build(options: Namespace) -> int:
    """Write, or with `--check` compare, the generated code of specifications."""
    from specc import output, pipeline

    findings: list[Finding] = []
    built_from: dict[Path, str] = {}
    stopped = False
    for path in options.specs:
        built = pipeline.build(path, tests_all_rows=options.real_time)
        left = inspect.judge_findings(path, built.result, inspect.overrides_of(options))
        findings += left.findings
        stopped |= not built.result.ok
        if built.result.ok and not left.refused:
            directory = Path(options.out or _beside(path), built.system)
            first = built_from.setdefault(directory, path)
            if real_path(first) != real_path(path):
                put = [_taken(directory, first, path)]
            elif options.check:
                put = output.stale(directory, built.files)
            else:
                put = output.write(directory, built.files, _writable(path, options.out))
            findings += resolve(put, Sources())
    code = streams.print_report(report(findings, options.specs), options.format) or int(stopped)
    if not code and not options.check and options.format == "text":
        streams.print_message("\n".join(f"built {directory}" for directory in built_from))
    return code


def _beside(spec: str) -> str:
    """Where code goes by default: a folder of the project, as it is found from here."""
    from specc.policy import project_of

    out = os.path.join(project_of(spec), "generated")
    return os.path.relpath(out) if Path(out).is_relative_to(Path.cwd()) else out


def _taken(directory: Path, first: str, path: str) -> Diagnostic:
    message = f"the system of {first} goes here, so that of {path}, which has the same name, cannot"
    hint = "give one of them another name, or build it by itself with another --out"
    return Diagnostic("E0091", message, Place(str(directory)), help=hint)


def _writable(spec: str, out: str | None) -> AllowedPaths:
    """Where a build may write: links below the working directory must not lead out of it."""
    from specc.policy import allowed_paths
    from specc.read import AllowedPaths

    project = allowed_paths(spec).folders
    if out is None:
        return AllowedPaths(project)
    here = Path.cwd()
    named = here if Path(os.path.abspath(out)).is_relative_to(here) else Path(out)
    return AllowedPaths((os.path.realpath(named), *project))


def diff(options: Namespace) -> int:
    """Print how two specifications differ; 0 if they mean the same, 1 if not or with errors."""
    from specc import pipeline
    from specc.tools.diff import compare

    results = [pipeline.read_spec(path) for path in (options.old, options.new)]
    findings = [f for r in results for f in resolve(r.diagnostics, r.sources)]
    wrong = [finding for finding in findings if _hides_meaning(finding.diagnostic)]
    old, new = (result.system for result in results)
    if wrong or old is None or new is None:
        return streams.print_report(report(wrong, [options.old, options.new]), options.format)
    comparison = compare(old, new)
    render = getattr(import_module("specc.tools.diff.render"), f"as_{options.format}")
    streams.print_output(render(comparison, options.old, options.new), options.format)
    return 1 if comparison.differences else 0


def _hides_meaning(diagnostic: Diagnostic) -> bool:
    """Whether what is found leaves open what the specification means: a name may be a slip."""
    return diagnostic.severity == "error" or diagnostic.code == "O0205"


def explain(options: Namespace) -> int:
    """Print the entry of a code, or the list of all codes."""
    from specc.diagnostics.code import all_codes, explanation, overview

    codes = all_codes()
    if options.code is None:
        streams.print_output(overview(codes))
        return 0
    entry = codes.get(options.code.upper())
    if entry is None:
        close = " or ".join(f"`{code}`" for code in nearest(options.code, codes))
        hint = f"did you mean {close}?" if close else "`specc explain` lists all codes"
        raise Refused(f"no code is called `{options.code}`; {hint}")
    streams.print_output(explanation(entry))
    return 0


def schema(options: Namespace) -> int:
    """Print the JSON Schema of specification files, for editors."""
    import json

    from specc.schema.files import json_schema

    streams.print_output(json.dumps(json_schema(), indent=2) + "\n", "json")
    return 0


def lsp(options: Namespace) -> int:
    """Serve an editor over standard input and output."""
    try:
        from specc.tools.lsp.server import serve
    except ModuleNotFoundError as error:
        raise missing_package(error, "pygls", "lsprotocol") from error
    return serve()


def run_import(options: Namespace) -> int:
    """Import, print or write the specification, and report what is not in it."""
    from specc.tools.importers import import_fabric, import_scxml

    if options.source == "fabric":
        made = import_fabric(
            options.files, name=options.name, period=options.period, wires=options.connect
        )
    else:
        made = import_scxml(options.files[0], name=options.name, period=options.period)
    code = streams.print_report(report(resolve(made.diagnostics, made.sources), options.files))
    if not made.text:
        return code
    if options.out and os.path.realpath(options.out) in map(os.path.realpath, options.files):
        raise Refused(f"{options.out} is what is imported; name another file with --out")
    if options.out is None:
        streams.print_output(made.text)
    else:
        _save(made.text, options.out, options.force)
    return 0


def _save(text: str, out: str, force: bool) -> None:
    """Write a specification; one that is there may have been completed by hand, so it stays."""
    from specc.atomic_files import write_atomically
    from specc.cli.rewrite import rewrite_file

    if not Path(out).name:
        raise Refused(f"--out `{out}` names no file")
    if os.path.lexists(out) and not force:
        raise Refused(f"{out} is there already; `--force` replaces it")
    try:
        if os.path.exists(out):
            rewrite_file(out, text)
        else:
            write_atomically(Path(out), text)
    except OSError as error:
        raise Refused(f"{out} cannot be written: {reason_of(error)}") from error
