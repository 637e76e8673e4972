"""A report as JSON, for programs.

docs/formats.md describes it.
"""

import json
from typing import Any

from specc.diagnostics.report import Finding, Repair, Report
from specc.source import Span

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
            "ignored": report.ignored,
            "not_shown": report.not_shown,
        },
        "diagnostics": [_finding(finding) for finding in report.shown],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    found = finding.diagnostic
    return {
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "label": found.label,
        "help": found.help,
        "example": found.example,
        "route": list(found.primary.route),
        "location": _location(finding.primary.span),
        "related": [
            {"message": spot.message, "location": _location(spot.span)} for spot in finding.related
        ],
        "fix": _fix(finding.repair),
    }


def _fix(repair: Repair | None) -> dict[str, Any] | None:
    if repair is None:
        return None
    edits = [{"location": _location(edit.span), "text": edit.text} for edit in repair.changes]
    return {"title": repair.title, "edits": edits}


def _location(span: Span) -> dict[str, Any]:
    return {
        "file": span.file,
        "line": span.line,
        "column": span.col,
        "end_line": span.end_line,
        "end_column": span.end_col,
    }
