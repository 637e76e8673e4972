"""The commands that only call the compiler or a tool: they print what it made or found."""

from __future__ import annotations

import difflib
import os
import textwrap
from argparse import Namespace
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc.cli import fix, inspect, streams
from specc.cli.files import rewrite_file, write_output
from specc.diagnostics import Diagnostic, nearest
from specc.diagnostics.report import Finding, report, resolve, shown_path
from specc.policy import allowed_paths, project_of
from specc.read import AllowedPaths, read_file, refuse_other_yaml
from specc.refusal import Refused, missing_package, reason_of
from specc.resources import LIBRARY, library_parts
from specc.source import Place, Sources, real_path

if TYPE_CHECKING:
    from specc.output import OutputFiles
    from specc.pipeline import Build
    from specc.tools.ament import AmentPackage

_WIDTH = 100


def validate(options: Namespace) -> int:
    """Report what is wrong with specifications."""
    look = fix.inspect_and_fix if options.fix else inspect.inspect_all
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
    has_errors = False
    if options.ament is not None and len(options.specs) > 1:
        raise Refused("`--ament` makes one package: name one specification")
    for path in options.specs:
        built = pipeline.build(path, tests_all_rows=options.real_time)
        judged = inspect.judge_findings(path, built.result, inspect.overrides_of(options))
        findings += judged.findings
        has_errors |= not built.result.ok
        if built.result.ok and not judged.refused:
            directory = Path(options.out or _default_output(path), built.system)
            files: OutputFiles = built.files
            if is_package := options.ament is not None:
                directory, package = Path(options.ament), _package_of(path, built)
                files = package.files
                findings += resolve(package.faults, built.result.sources)
            first = built_from.setdefault(directory, path)
            if not files:
                continue
            if real_path(first) != real_path(path):
                faults = [_same_directory(directory, first, path)]
            elif options.check:
                faults = output.stale(directory, files, is_shared=is_package)
            else:
                allowed = _writable_paths(path, options.ament or options.out)
                faults = output.write(directory, files, allowed, is_shared=is_package)
            findings += resolve(faults, Sources())
    code = streams.print_report(report(findings, options.specs), options.format) or int(has_errors)
    if not code and not options.check and options.format == "text":
        streams.print_message("\n".join(f"built {directory}" for directory in built_from))
    return code


def _package_of(spec: str, built: Build) -> AmentPackage:
    """The package of ROS 2; raises Refused if a file that belongs to it cannot be read."""
    from specc.tools.ament import ament_package

    try:
        return ament_package(spec, built)
    except OSError as error:
        raise Refused(f"{error.filename} cannot be read: {reason_of(error)}") from error


def _default_output(spec: str) -> str:
    """Where code goes by default: a folder of the project, as it is found from here."""
    out = os.path.join(project_of(spec), "generated")
    return os.path.relpath(out) if Path(out).is_relative_to(Path.cwd()) else out


def _same_directory(directory: Path, first: str, path: str) -> Diagnostic:
    message = f"the system of {first} goes here, so that of {path}, which has the same name, cannot"
    hint = "give one of them another name, or build it by itself with another --out"
    return Diagnostic("E0091", message, Place(str(directory)), help=hint)


def _writable_paths(spec: str, out: str | None) -> AllowedPaths:
    """The folders that a build may write into; a link below the working directory stays in it."""
    project = allowed_paths(spec).folders
    if out is None:
        return AllowedPaths(project)
    here = Path.cwd()
    folder = here if Path(os.path.abspath(out)).is_relative_to(here) else Path(out)
    return AllowedPaths((os.path.realpath(folder), *project))


def fmt(options: Namespace) -> int:
    """Put files into the canonical layout, or say which are not in it; the exit code."""
    from specc.tools.fmt import format_text, upgrade

    targets = inspect.find_targets(options.files)
    findings = resolve(targets.faults, Sources())
    changed, readable, files = [], 0, [*targets.systems, *targets.parts]
    only_looks = options.check or options.diff
    for path in files:
        allowed = allowed_paths(path)
        if not allowed.contains(path):
            findings += resolve([allowed.link_finding(path)], Sources())
            continue
        document = refuse_other_yaml(read_file(path))
        if not document.ok:
            findings += resolve(document.diagnostics, Sources([document.source]))
            continue
        readable += 1
        old = document.source.text
        new = format_text(old, upgrade if options.upgrade else None)
        if new == old:
            continue
        changed.append(path)
        if options.diff:
            streams.print_output("".join(_difference(path, old, new)))
        if not only_looks:
            try:
                rewrite_file(path, new.encode())
            except OSError as error:
                findings += resolve([fix.unwritable(error)], Sources())
    if readable:
        what = "would be formatted" if only_looks else "formatted"
        for path in changed:
            streams.print_message(f"{what}: {shown_path(path)}")
        same = readable - len(changed)
        streams.print_message(f"{len(changed)} of {readable} {what}, {same} left as they are")
    code = streams.print_report(report(findings, files)) if findings else 0
    return code or int(bool(changed) and options.check)


def _difference(path: str, old: str, new: str) -> Iterator[str]:
    name = shown_path(path)
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    for line in difflib.unified_diff(before, after, f"{name} (now)", f"{name} (formatted)"):
        yield line if line.endswith("\n") else f"{line}\n"


def diff(options: Namespace) -> int:
    """Print how two specifications differ; 0 if they mean the same, 1 if not or with errors."""
    from specc import pipeline
    from specc.tools.diff import compare

    results = [pipeline.read_spec(path) for path in (options.old, options.new)]
    findings = [f for r in results for f in resolve(r.diagnostics, r.sources)]
    # A reference to what is not there leaves the meaning open: it may be a typo.
    wrong = [
        finding
        for finding in findings
        if finding.diagnostic.severity == "error" or finding.diagnostic.code in streams.DANGLING
    ]
    old, new = (result.system for result in results)
    if wrong or old is None or new is None:
        return streams.print_report(report(wrong, [options.old, options.new]), options.format)
    comparison = compare(old, new)
    render = getattr(import_module("specc.tools.diff.changes"), f"as_{options.format}")
    streams.print_output(render(comparison, options.old, options.new), options.format)
    return 1 if comparison.differences else 0


def explain(options: Namespace) -> int:
    """Print the entry of a code, or the list of all codes."""
    from specc.diagnostics.code import MERGED, all_codes, explanation, overview

    codes = all_codes()
    if options.code is None:
        streams.print_output(overview(codes))
        return 0
    wanted = options.code.upper()
    entry = codes.get(MERGED.get(wanted, wanted))
    if entry is None:
        close = " or ".join(f"`{code}`" for code in nearest(options.code, codes))
        hint = f"did you mean {close}?" if close else "`specc explain` lists all codes"
        raise Refused(f"no code is called `{options.code}`; {hint}")
    former = f"{wanted} is part of {entry.id} now.\n\n" if entry.id != wanted else ""
    streams.print_output(former + explanation(entry))
    return 0


def lib(options: Namespace) -> int:
    """Print the parts of the library, all of them or those that are named."""
    from specc.tools.parts import as_text, summary_of

    names = [_library_part(name) for name in options.parts] or library_parts()
    parts = [part for part in map(summary_of, names) if part]
    for number, part in enumerate(parts):
        head, _, rows = as_text(part).partition("\n")
        about = textwrap.fill(part.about, _WIDTH, initial_indent="  ", subsequent_indent="  ")
        text = "\n".join(filter(None, (head, about, rows)))
        streams.print_output("\n" * (number > 0) + text)
    return 0


def _library_part(name: str) -> str:
    """The whole name of a part; raises Refused if there is none."""
    whole = name if name.startswith(LIBRARY) else f"{LIBRARY}{name}"
    if whole not in library_parts():
        parts = {part.removeprefix(LIBRARY): part for part in library_parts()}
        close = " or ".join(parts[name] for name in nearest(whole.removeprefix(LIBRARY), parts))
        hint = f"did you mean {close}?" if close else "`specc lib` lists all parts"
        raise Refused(f"the library has no part {name!r}; {hint}")
    return whole


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
        imported = import_fabric(
            options.files, name=options.name, period=options.period, wires=options.connect
        )
    else:
        imported = import_scxml(options.files[0], name=options.name, period=options.period)
    findings = resolve(imported.diagnostics, imported.sources)
    code = streams.print_report(report(findings, options.files))
    if not imported.text:
        return code
    out = options.out
    if out is None:
        streams.print_output(imported.text)
    else:
        write_output(out, imported.text.encode(), "yaml", options.files, force=options.force)
    return 0
