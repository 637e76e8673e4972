"""Which findings are shown, and which of them refuse a specification."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from specc.diagnostics import Diagnostic
from specc.policy.ignores import Ignore, ignores_of, unused
from specc.policy.settings import Settings
from specc.reachable import grouped
from specc.source import Place, SourceFile, Sources

_EXPLORED = "W10"
"""Codes of what only `specc explore` finds; comments about it are no concern of other commands."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """Findings that are left; `used` are the places of the codes in comments that suppressed some.

    `ignored` counts the findings that comments or settings suppress.
    """

    diagnostics: tuple[Diagnostic, ...]
    ignored: int = 0
    used: frozenset[Place] = frozenset()

    @property
    def refused(self) -> bool:
        """Whether an error is left."""
        return any(finding.severity == "error" for finding in self.diagnostics)


def judge(
    diagnostics: Iterable[Diagnostic],
    sources: Sources,
    settings: Settings,
    is_complete: bool = True,
) -> Judgement:
    """Apply ignore comments, then settings.

    Errors and open points always pass. A comment
    counts as used also if the settings would hold the finding back too. While there are any,
    or if the users of a file are left open (`whole` is false), not everything has been checked,
    and no comment is called unused.
    """
    found = list(dict.fromkeys(diagnostics))
    complete = is_complete and all(finding.severity == "warning" for finding in found)
    ignores, faults = _all_ignores(sources)
    kept, used = _commented(found, ignores, sources)
    left = [finding for finding in kept if settings.shows(finding)]
    ignored = len(found) - len(left)
    rest = [*faults]
    if complete:
        idle = [(source, entry) for source, entry in ignores if entry.place not in used]
        rest += [unused(source, e) for source, e in idle if not e.code.startswith(_EXPLORED)]
    left += [finding for finding in rest if settings.shows(finding)]
    if settings.strict:
        left = [replace(finding, promoted=not finding.code.startswith("E")) for finding in left]
    return Judgement(tuple(left), ignored, frozenset(used))


def _all_ignores(sources: Sources) -> tuple[list[tuple[SourceFile, Ignore]], list[Diagnostic]]:
    ignores: list[tuple[SourceFile, Ignore]] = []
    faults: list[Diagnostic] = []
    for source in sources:
        entries, wrong = ignores_of(source)
        ignores += [(source, entry) for entry in entries]
        faults += wrong
    return ignores, faults


def _commented(
    found: list[Diagnostic], ignores: list[tuple[SourceFile, Ignore]], sources: Sources
) -> tuple[list[Diagnostic], set[Place]]:
    """Findings that no comment suppresses, and the places of codes that suppress some."""
    by_line = grouped(((s.path, entry.line, entry.code), entry.place) for s, entry in ignores)
    if not by_line:
        return found, set()
    kept: list[Diagnostic] = []
    used: set[Place] = set()
    for finding in found:
        span = sources.span(finding.primary)
        places = by_line.get((span.file, span.line, finding.code))
        if places is None:
            kept.append(finding)
        else:
            used.update(places)
    return kept, used
