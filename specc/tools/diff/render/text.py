"""A comparison for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.diagnostics.render.visible import visible
from specc.tools.diff.record import Comparison, Difference
from specc.tools.diff.render.words import by_place, counted, facts, headline, shortened

_SIGNS = {"added": "+", "removed": "-", "changed": "~"}


def render(comparison: Comparison, old: str, new: str) -> str:
    """Differences by place, then changes without a change of meaning, then how many there are."""
    lines = [*_section(comparison.differences)]
    if comparison.remarks:
        lines += ["without a change of meaning:", "", *_section(comparison.remarks)]
    differences = counted(len(comparison.differences), "difference")
    remarks = counted(len(comparison.remarks), "remark")
    lines.append(f"{visible(old)} -> {visible(new)}: {differences}, {remarks}")
    return "\n".join(lines) + "\n"


def _section(changes: Iterable[Difference]) -> Iterator[str]:
    for where, group in by_place(changes):
        yield where
        for change in group:
            yield f"  {_SIGNS[change.change]} {headline(change)}"
            yield from (f"      {visible(line)}" for line in _details(change))
        yield ""


def _details(change: Difference) -> Iterator[str]:
    if change.change == "changed":
        yield f"old: {shortened(change.old)}"
        yield f"new: {shortened(change.new)}"
    elif change.old or change.new:
        yield shortened(change.old or change.new)
    if change.only_old:
        yield f"only the old one holds when {facts(change.only_old)}"
    if change.only_new:
        yield f"only the new one holds when {facts(change.only_new)}"
    if change.note:
        yield f"({change.note})"
