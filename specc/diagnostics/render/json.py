"""A report as JSON, for programs.

The object has `version` (1; it changes when a member changes its meaning or goes), `summary`
(`files`, `errors`, `warnings`, `open_points`) and `diagnostics`, each with `code`, `severity`
(`error`, `warning` or `open`), `message`, `label`, `help`, `route` (keys and indices in the
file), `location` and `related` (a list of `message` and `location`). A location has `file`
(relative to the working directory when below it), `line`, `column`, `end_line` and `end_column`,
counted from 1 in characters, end exclusive.
"""

import json
from typing import Any

from specc.diagnostics.report import Finding, Report, Spot

VERSION = 1


def render(report: Report) -> str:
    """The report as an indented JSON text that ends with a line break."""
    return json.dumps(_report(report), indent=2) + "\n"


def _report(report: Report) -> dict[str, Any]:
    return {
        "version": VERSION,
        "summary": {
            "files": list(report.checked),
            "errors": report.count("error"),
            "warnings": report.count("warning"),
            "open_points": report.count("open"),
        },
        "diagnostics": [_finding(finding) for finding in report.findings],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    found = finding.diagnostic
    return {
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "label": found.label,
        "help": found.help,
        "route": list(found.primary.route),
        "location": _location(finding.primary),
        "related": [
            {"message": spot.message, "location": _location(spot)} for spot in finding.related
        ],
    }


def _location(spot: Spot) -> dict[str, Any]:
    span = spot.span
    return {
        "file": span.file,
        "line": span.line,
        "column": span.col,
        "end_line": span.end_line,
        "end_column": span.end_col,
    }
