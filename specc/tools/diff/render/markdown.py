"""A comparison for a review: a table for each part of the system."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.tools.diff.record import Comparison, Difference
from specc.tools.diff.render.words import by_place, counted, facts, headline, shortened


def render(comparison: Comparison, old: str, new: str) -> str:
    """Differences as tables, with changes without a change of meaning folded away."""
    lines = [f"## {_plain(old)} → {_plain(new)}", ""]
    lines += [f"{counted(len(comparison.differences), 'difference')} of meaning.", ""]
    lines += _section(comparison.differences)
    if comparison.remarks:
        count = counted(len(comparison.remarks), "change")
        lines += ["<details>", f"<summary>{count} without a change of meaning</summary>", ""]
        lines += [*_section(comparison.remarks), "</details>", ""]
    return "\n".join(lines)


def _section(changes: Iterable[Difference]) -> Iterator[str]:
    for where, group in by_place(changes):
        yield from (
            f"### {_plain(where)}",
            "",
            "| change | old | new | |",
            "| --- | --- | --- | --- |",
        )
        for change in group:
            cells = (_plain(headline(change)), _code(change.old), _code(change.new), _why(change))
            yield f"| {' | '.join(cells)} |"
        yield ""


def _why(change: Difference) -> str:
    parts = []
    if change.only_old:
        parts.append(f"only the old one holds when {_facts(change.only_old)}")
    if change.only_new:
        parts.append(f"only the new one holds when {_facts(change.only_new)}")
    if change.note:
        parts.append(_plain(change.note))
    return "<br>".join(parts)


def _facts(found: tuple[tuple[str, str], ...]) -> str:
    return _plain(facts(found))


def _code(text: str) -> str:
    """A text as code; a vertical bar would end the cell, a backtick the code."""
    if not text:
        return ""
    clean = " ".join(shortened(text).split()).replace("|", "\\|")
    fence = "``" if "`" in clean else "`"
    return f"{fence} {clean} {fence}" if fence == "``" else f"`{clean}`"


def _plain(text: str) -> str:
    clean = " ".join(text.split())
    for letter in "\\|<>*_`[]#":
        clean = clean.replace(letter, f"\\{letter}")
    return clean
