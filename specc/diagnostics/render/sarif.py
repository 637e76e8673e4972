"""A report as SARIF 2.1.0 (OASIS), for code scanning services and editors."""

import json
from typing import Any
from urllib.parse import quote

from specc import __version__
from specc.diagnostics.code import all_codes
from specc.diagnostics.report import Finding, Repair, Report
from specc.source import Span

_LEVELS = {"error": "error", "warning": "warning", "open": "note"}
_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def render(report: Report) -> str:
    """The report as a SARIF log with one run."""
    used = sorted({finding.diagnostic.code for finding in report.shown})
    driver = {"name": "specc", "version": __version__, "rules": [_rule(code) for code in used]}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, used) for finding in report.shown],
        "properties": {"notShown": report.not_shown},
    }
    return json.dumps({"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2) + "\n"


def _rule(code: str) -> dict[str, Any]:
    entry = all_codes().get(code)
    if entry is None:
        return {"id": code}
    return {
        "id": code,
        "shortDescription": {"text": entry.title},
        "fullDescription": {"text": entry.explanation},
        "defaultConfiguration": {"level": _LEVELS[entry.severity]},
    }


def _result(finding: Finding, rules: list[str]) -> dict[str, Any]:
    found = finding.diagnostic
    text = "\n".join((found.message, *found.remarks))
    result: dict[str, Any] = {
        "ruleId": found.code,
        "ruleIndex": rules.index(found.code),
        "level": _LEVELS[found.severity],
        "message": {"text": text},
        "locations": [_location(finding.primary.span)],
        "relatedLocations": [
            {"id": number, "message": {"text": spot.message}, **_location(spot.span)}
            for number, spot in enumerate(finding.related, start=1)
        ],
    }
    if finding.repair is not None:
        result["fixes"] = [_fix(finding.repair)]
    return result


def _fix(repair: Repair) -> dict[str, Any]:
    replacements = [
        {"deletedRegion": _region(change.span), "insertedContent": {"text": change.text}}
        for change in repair.changes
    ]
    change = {"artifactLocation": _artifact(repair.file), "replacements": replacements}
    return {"description": {"text": repair.title}, "artifactChanges": [change]}


def _location(span: Span) -> dict[str, Any]:
    return {"physicalLocation": {"artifactLocation": _artifact(span.file), "region": _region(span)}}


def _artifact(file: str) -> dict[str, Any]:
    return {"uri": quote(file.encode("utf-8", "surrogateescape"))}


def _region(span: Span) -> dict[str, Any]:
    return {
        "startLine": span.line,
        "startColumn": span.col,
        "endLine": span.end_line,
        "endColumn": span.end_col,
    }
