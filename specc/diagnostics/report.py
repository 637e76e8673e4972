"""Findings with their places resolved and in order: what every renderer starts from."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate

from specc.diagnostics.diagnostic import Diagnostic, Fix, Severity
from specc.diagnostics.renaming import with_repairs_of_typos
from specc.diagnostics.visible import visible
from specc.limits import MAX_LETTERS, MAX_SHOWN
from specc.resources import is_library_part
from specc.source import SET, Place, Sources, Span

_MOST_SET = 80
"""Letters of a constant that was set, with its text, that are shown."""
_RANKS: dict[Severity, int] = {"error": 0, "warning": 1, "open": 2}


@dataclass(frozen=True, slots=True)
class RenderedLocation:
    """A resolved place: its span, the text of its first line, and a message for it."""

    span: Span
    line: str
    message: str


@dataclass(frozen=True, slots=True)
class Change:
    """New text for the characters of a file from offset `start` up to `end`, which are `span`."""

    start: int
    end: int
    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Repair:
    """What mends a finding: changes within one file."""

    title: str
    changes: tuple[Change, ...]

    @property
    def file(self) -> str:
        """The file, relative to the working directory."""
        return self.changes[0].span.file


@dataclass(frozen=True, slots=True)
class Finding:
    """A diagnostic with the places it speaks of; paths are relative to the working directory."""

    diagnostic: Diagnostic
    primary: RenderedLocation
    related: tuple[RenderedLocation, ...]
    repair: Repair | None = None

    @property
    def letters(self) -> int:
        """How much there is to read, without the lines of the file."""
        texts = [self.diagnostic.message, *self.diagnostic.remarks, self.primary.message]
        return sum(map(len, texts)) + sum(len(other.message) for other in self.related)


@dataclass(frozen=True, slots=True)
class Report:
    """All findings about the files of one command; `ignored` counts those that are not shown."""

    findings: tuple[Finding, ...]
    checked: tuple[str, ...]
    ignored: int = 0

    @property
    def shown(self) -> tuple[Finding, ...]:
        """The findings that are shown: all, or the first of the worst."""
        worst = sorted(self.findings, key=lambda item: _RANKS[item.diagnostic.severity])
        sums = accumulate(item.letters for item in worst[:MAX_SHOWN])
        fitting = sum(letters <= MAX_LETTERS for letters in sums)
        if fitting == len(self.findings):
            return self.findings
        shown = set(map(id, worst[: max(fitting, 1)]))
        return tuple(item for item in self.findings if id(item) in shown)

    @property
    def not_shown(self) -> int:
        """How many findings are only counted."""
        return len(self.findings) - len(self.shown)

    def count(self, severity: Severity) -> int:
        """Number of findings of a severity."""
        return sum(finding.diagnostic.severity == severity for finding in self.findings)


def resolve(diagnostics: Iterable[Diagnostic], sources: Sources) -> list[Finding]:
    """Resolve the places of diagnostics; equal ones are kept once."""
    return [
        Finding(
            diagnostic,
            _rendered(diagnostic.primary, diagnostic.label, sources),
            tuple(_rendered(item.place, item.message, sources) for item in diagnostic.related),
            repair(diagnostic.fix, sources),
        )
        for diagnostic in with_repairs_of_typos(dict.fromkeys(diagnostics), sources)
    ]


def brief(finding: Finding) -> str:
    """A finding in one line: where it is, what it says and what helps."""
    span = finding.primary.span
    where = f"{span.file}:{span.line}"
    if finding.diagnostic.primary.file == SET:
        where = visible(finding.primary.line[:_MOST_SET])
    others = [
        f"{other.message} ({other.span.file}:{other.span.line})" for other in finding.related[:1]
    ]
    words = (finding.diagnostic.message, *others, *finding.diagnostic.remarks)
    return f"{where}: {'; '.join(filter(None, words))}"


def report(findings: Iterable[Finding], checked: Iterable[str]) -> Report:
    """Sort findings by file, line and column, without duplicates."""
    ordered = sorted(dict.fromkeys(findings), key=_order)
    return Report(tuple(ordered), tuple(shown_path(path) for path in checked))


def shown_path(path: str) -> str:
    """A path as people read it: relative to the working directory if it lies below it."""
    return _shown_from(os.getcwd(), path)


@lru_cache
def _shown_from(folder: str, path: str) -> str:
    if is_library_part(path):
        return path
    try:
        relative = os.path.relpath(path, folder)
    except ValueError:
        return path
    return path if relative.startswith(os.pardir) else relative


def repair(fix: Fix | None, sources: Sources) -> Repair | None:
    """A fix with its places resolved; None if it goes beyond one file that was read."""
    files = {edit.place.file for edit in fix.edits} if fix else set()
    source = sources.get(files.pop()) if len(files) == 1 else None
    if fix is None or source is None:
        return None
    changes = []
    for edit in fix.edits:
        # Of a name in quotes only the name changes.
        place = replace(edit.place, start=0) if edit.place.start is None else edit.place
        span = _with_shown_path(source.span(place))
        changes.append(Change(*source.offsets(place), span, edit.text))
    return Repair(fix.title, tuple(changes))


def _rendered(place: Place, message: str, sources: Sources) -> RenderedLocation:
    span = sources.span(place)
    return RenderedLocation(_with_shown_path(span), sources.line(place.file, span.line), message)


def _with_shown_path(span: Span) -> Span:
    return replace(span, file=shown_path(span.file))


def _order(finding: Finding) -> tuple[str, int, int, str, str]:
    span = finding.primary.span
    return span.file, span.line, span.col, finding.diagnostic.code, finding.diagnostic.message
