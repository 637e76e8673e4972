"""Findings with their places resolved and in order: what every renderer starts from."""

import os
from collections.abc import Iterable
from dataclasses import dataclass

from specc.diagnostics.diagnostic import Diagnostic, Severity
from specc.source import Place, Sources, Span


@dataclass(frozen=True, slots=True)
class Spot:
    """A resolved place: its span, the text of its first line, and a message for it."""

    span: Span
    line: str
    message: str


@dataclass(frozen=True, slots=True)
class Finding:
    """A diagnostic with the spots it speaks of; paths are relative to the working directory."""

    diagnostic: Diagnostic
    primary: Spot
    related: tuple[Spot, ...]


@dataclass(frozen=True, slots=True)
class Report:
    """All findings about the files of one command; `ignored` counts those that are not shown."""

    findings: tuple[Finding, ...]
    checked: tuple[str, ...]
    ignored: int = 0

    def count(self, severity: Severity) -> int:
        """Number of findings of a severity."""
        return sum(finding.diagnostic.severity == severity for finding in self.findings)


def resolve(diagnostics: Iterable[Diagnostic], sources: Sources) -> list[Finding]:
    """Look the places of diagnostics up; equal diagnostics are kept once."""
    return [_finding(diagnostic, sources) for diagnostic in dict.fromkeys(diagnostics)]


def report(findings: Iterable[Finding], checked: Iterable[str]) -> Report:
    """Put findings in the order of file, line and column, each once."""
    ordered = sorted(dict.fromkeys(findings), key=_order)
    return Report(tuple(ordered), tuple(shown_path(path) for path in checked))


def shown_path(path: str) -> str:
    """A path as people read it: relative to the working directory if it lies below it."""
    try:
        relative = os.path.relpath(path)
    except ValueError:
        return path
    return path if relative.startswith(os.pardir) else relative


def _finding(diagnostic: Diagnostic, sources: Sources) -> Finding:
    primary = _spot(diagnostic.primary, diagnostic.label, sources)
    related = tuple(_spot(item.place, item.message, sources) for item in diagnostic.related)
    return Finding(diagnostic, primary, related)


def _spot(place: Place, message: str, sources: Sources) -> Spot:
    span = sources.span(place)
    shown = Span(shown_path(span.file), span.line, span.col, span.end_line, span.end_col)
    return Spot(shown, sources.line(place.file, span.line), message)


def _order(finding: Finding) -> tuple[str, int, int, str, str]:
    span = finding.primary.span
    return span.file, span.line, span.col, finding.diagnostic.code, finding.diagnostic.message
