"""Reports in the formats that programs read: JSON, SARIF, JUnit and GitHub workflow commands."""

import json
from collections.abc import Callable, Iterable
from typing import Any
from urllib.parse import quote
from xml.sax.saxutils import escape, quoteattr

from specc import __version__
from specc.diagnostics.code import all_codes
from specc.diagnostics.diagnostic import Severity
from specc.diagnostics.report import Finding, RenderedLocation, Repair, Report
from specc.diagnostics.visible import visible, visible_lines
from specc.reachable import grouped
from specc.source import Span

VERSION = 1
"""Of the JSON format, which docs/formats.md describes."""


def as_json(report: Report) -> str:
    """The report as an indented JSON text that ends with a line break."""
    summary = {
        "files": list(report.checked),
        "errors": report.count("error"),
        "warnings": report.count("warning"),
        "open_points": report.count("open"),
        "ignored": report.ignored,
        "not_shown": report.not_shown,
    }
    diagnostics = [_json_finding(finding) for finding in report.shown]
    content = {"version": VERSION, "summary": summary, "diagnostics": diagnostics}
    return json.dumps(content, indent=2) + "\n"


def _json_finding(finding: Finding) -> dict[str, Any]:
    diagnostic, fix = finding.diagnostic, None
    if repair := finding.repair:
        edits = [{"location": _location(edit.span), "text": edit.text} for edit in repair.changes]
        fix = {"title": repair.title, "edits": edits}
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": diagnostic.message,
        "label": diagnostic.label,
        "help": diagnostic.help,
        "example": diagnostic.example,
        "route": list(diagnostic.primary.route),
        "location": _location(finding.primary.span),
        "related": [
            {"message": other.message, "location": _location(other.span)}
            for other in finding.related
        ],
        "fix": fix,
    }


def _location(span: Span) -> dict[str, Any]:
    return {
        "file": span.file,
        "line": span.line,
        "column": span.col,
        "end_line": span.end_line,
        "end_column": span.end_col,
    }


# SARIF 2.1.0 (OASIS), for code scanning services and editors.


_SARIF_LEVELS = {"error": "error", "warning": "warning", "open": "note"}
_SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def as_sarif(report: Report) -> str:
    """The report as a SARIF log with one run."""
    codes = sorted({finding.diagnostic.code for finding in report.shown})
    rules = [_sarif_rule(code) for code in codes]
    run = {
        "tool": {"driver": {"name": "specc", "version": __version__, "rules": rules}},
        "columnKind": "unicodeCodePoints",
        "results": [_sarif_result(finding, codes) for finding in report.shown],
        "properties": {"notShown": report.not_shown},
    }
    log = {"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}
    return json.dumps(log, indent=2) + "\n"


def _sarif_rule(code: str) -> dict[str, Any]:
    entry = all_codes().get(code)
    if entry is None:
        return {"id": code}
    return {
        "id": code,
        "shortDescription": {"text": entry.title},
        "fullDescription": {"text": entry.explanation},
        "defaultConfiguration": {"level": _SARIF_LEVELS[entry.severity]},
    }


def _sarif_result(finding: Finding, codes: list[str]) -> dict[str, Any]:
    diagnostic = finding.diagnostic
    result: dict[str, Any] = {
        "ruleId": diagnostic.code,
        "ruleIndex": codes.index(diagnostic.code),
        "level": _SARIF_LEVELS[diagnostic.severity],
        "message": {"text": "\n".join((diagnostic.message, *diagnostic.remarks))},
        "locations": [_sarif_location(finding.primary)],
        "relatedLocations": [
            {"id": number, "message": {"text": other.message}, **_sarif_location(other)}
            for number, other in enumerate(finding.related, start=1)
        ],
    }
    if finding.repair is not None:
        result["fixes"] = [_sarif_fix(finding.repair)]
    return result


def _sarif_fix(repair: Repair) -> dict[str, Any]:
    replacements = [
        {"deletedRegion": _sarif_region(change.span), "insertedContent": {"text": change.text}}
        for change in repair.changes
    ]
    change = {"artifactLocation": _sarif_file(repair.file), "replacements": replacements}
    return {"description": {"text": repair.title}, "artifactChanges": [change]}


def _sarif_location(location: RenderedLocation) -> dict[str, Any]:
    file, region = _sarif_file(location.span.file), _sarif_region(location.span)
    return {"physicalLocation": {"artifactLocation": file, "region": region}}


def _sarif_file(path: str) -> dict[str, Any]:
    return {"uri": quote(path.encode("utf-8", "surrogateescape"))}


def _sarif_region(span: Span) -> dict[str, Any]:
    return {
        "startLine": span.line,
        "startColumn": span.col,
        "endLine": span.end_line,
        "endColumn": span.end_col,
    }


# JUnit XML, for services that show test results: one test case a file.


_SEVERITIES: tuple[Severity, ...] = ("error", "warning", "open")


def as_junit(report: Report) -> str:
    """A suite with a case for every file that was checked or has a finding."""
    files = dict.fromkeys([*report.checked, *(item.primary.span.file for item in report.findings)])
    by_file = grouped((item.primary.span.file, item) for item in report.shown)
    cases = "".join(_junit_case(file, by_file.get(file, [])) for file in files)
    failed = len({item.primary.span.file for item in _of_severity(report.findings, "error")})
    if report.not_shown:
        cases += f"<system-out>{report.not_shown} more findings are not shown</system-out>\n"
    counts = f'tests="{len(files)}" failures="{failed}" errors="0"'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<testsuites {counts}>\n<testsuite name="specc" {counts}>\n'
        f"{cases}</testsuite>\n</testsuites>\n"
    )


def _junit_case(file: str, findings: list[Finding]) -> str:
    head = f'<testcase classname="specc" name={quoteattr(visible(file))}'
    errors, warnings, points = (_of_severity(findings, severity) for severity in _SEVERITIES)
    body = ""
    if errors:
        message = quoteattr(visible(errors[0].diagnostic.message))
        body += f"<failure type={quoteattr(errors[0].diagnostic.code)} message={message}>"
        body += f"{_junit_lines(errors)}</failure>\n"
    if warnings or points:
        body += f"<system-out>{_junit_lines([*warnings, *points])}</system-out>\n"
    return f"{head}>\n{body}</testcase>\n" if body else f"{head}/>\n"


def _of_severity(findings: Iterable[Finding], severity: Severity) -> list[Finding]:
    return [item for item in findings if item.diagnostic.severity == severity]


def _junit_lines(findings: list[Finding]) -> str:
    lines = []
    for item in findings:
        diagnostic, span = item.diagnostic, item.primary.span
        lines.append(f"{span.file}:{span.line}:{span.col}: {diagnostic.code}: {diagnostic.message}")
        lines += [f"  {line}" for remark in diagnostic.remarks for line in remark.splitlines()]
    return escape(visible_lines("\n".join(lines)))


# Workflow commands of GitHub Actions, which show as annotations in a pull request.


_GITHUB_LEVELS = {"error": "error", "warning": "warning", "open": "notice"}
_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = {**_DATA, **str.maketrans({":": "%3A", ",": "%2C"})}


def as_github(report: Report) -> str:
    """One command a line for each finding."""
    commands = [_github_command(finding) for finding in report.shown]
    if report.not_shown:
        commands.append(f"::notice title=specc::{report.not_shown} more findings are not shown")
    return "".join(f"{command}\n" for command in commands)


def _github_command(finding: Finding) -> str:
    diagnostic, span = finding.diagnostic, finding.primary.span
    properties = {"file": span.file, "line": span.line, "endLine": span.end_line, "col": span.col}
    # Annotations of several lines take no columns.
    if span.line == span.end_line:
        properties["endColumn"] = span.end_col
    else:
        del properties["col"]
    properties["title"] = f"specc {diagnostic.code}"
    pairs = ",".join(
        f"{key}={visible(str(value)).translate(_PROPERTY)}" for key, value in properties.items()
    )
    related = (
        f"{visible(other.span.file)}:{other.span.line}: {other.message}"
        for other in finding.related
    )
    text = visible_lines("\n".join((diagnostic.message, *related, *diagnostic.remarks)))
    return f"::{_GITHUB_LEVELS[diagnostic.severity]} {pairs}::{text.translate(_DATA)}"


RENDERERS: dict[str, Callable[[Report], str]] = {
    "json": as_json,
    "sarif": as_sarif,
    "github": as_github,
    "junit": as_junit,
}
