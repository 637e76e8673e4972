"""Comparisons as text for a terminal, as Markdown for a review, and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from itertools import groupby
from typing import Any

from specc.diagnostics.phrases import counted, join_some, truncate
from specc.diagnostics.visible import visible
from specc.tools.diff.changes import Comparison, Difference

# What the readable formats share: a change in a few words, in order.


LONGEST = 400
MOST_PLACES = 8


def _headline(change: Difference) -> str:
    """What changed: `state S1 added`, `row S0 --terminal--> S1: condition changed`."""
    name = "" if change.name == change.where else change.name
    what = visible(f"{change.part} {name}".strip())
    if change.change != "changed":
        return f"{what} {change.change}"
    return f"{what}: {visible(change.aspect)} changed" if change.aspect else f"{what} changed"


def _witnesses(change: Difference) -> Iterator[str]:
    """Under which facts only one of two conditions holds."""
    for which, facts in (("old", change.only_old), ("new", change.only_new)):
        if facts:
            when = visible(", ".join(f"{fact} is {answer}" for fact, answer in facts))
            yield f"only the {which} one holds when {when}"


_GUARANTEES = {"weaker": "less is guaranteed", "stronger": "more is guaranteed", "": ""}


def _by_place(changes: Iterable[Difference]) -> Iterator[tuple[str, list[Difference]]]:
    """Changes by agent, subsystem or device; places with the same changes are listed together."""
    together: dict[tuple[Difference, ...], list[tuple[str, list[Difference]]]] = {}
    for where, group in groupby(changes, key=lambda change: change.where):
        own = list(group)
        same = (replace(one, where="", name="" if one.name == where else one.name) for one in own)
        together.setdefault(tuple(same), []).append((visible(where) or "system", own))
    for alike in together.values():
        yield join_some([where for where, _ in alike], MOST_PLACES), alike[0][1]


# For a terminal.


_SIGNS = {"added": "+", "removed": "-", "changed": "~"}


def as_text(comparison: Comparison, old: str, new: str) -> str:
    """Differences by place, then changes without a change of meaning, then how many there are."""
    lines = [*_list(comparison.differences)]
    if comparison.remarks:
        lines += ["without a change of meaning:", "", *_list(comparison.remarks)]
    remarks = counted(len(comparison.remarks), "remark")
    lines.append(f"{visible(old)} -> {visible(new)}: {_counted(comparison)}, {remarks}")
    return "\n".join(lines) + "\n"


def _counted(comparison: Comparison) -> str:
    """How many differences there are, and by how many of them less is guaranteed."""
    weaker = sum(change.guarantee == "weaker" for change in comparison.differences)
    words = f", {weaker} of which weaken{'s' * (weaker == 1)} what is guaranteed" if weaker else ""
    return f"{counted(len(comparison.differences), 'difference')}{words}"


def _list(changes: Iterable[Difference]) -> Iterator[str]:
    for where, group in _by_place(changes):
        yield where
        for change in group:
            yield f"  {_SIGNS[change.change]} {_headline(change)}"
            old, new = (visible(truncate(text, LONGEST)) for text in (change.old, change.new))
            if change.change == "changed":
                yield f"      old: {old}"
                yield f"      new: {new}"
            elif old or new:
                yield f"      {old or new}"
            yield from (f"      {visible(line)}" for line in _witnesses(change))
            remarks = filter(None, (_GUARANTEES[change.guarantee], change.note))
            yield from (f"      ({visible(words)})" for words in remarks)
        yield ""


# For a review: a table for each part of the system.


def as_markdown(comparison: Comparison, old: str, new: str) -> str:
    """Differences as tables, with changes without a change of meaning folded away."""
    lines = [f"## {_plain(old)} → {_plain(new)}", ""]
    lines += [f"{_counted(comparison)}.", ""]
    lines += _tables(comparison.differences)
    if comparison.remarks:
        count = counted(len(comparison.remarks), "change")
        lines += ["<details>", f"<summary>{count} without a change of meaning</summary>", ""]
        lines += [*_tables(comparison.remarks), "</details>", ""]
    return "\n".join(lines)


def _tables(changes: Iterable[Difference]) -> Iterator[str]:
    for where, group in _by_place(changes):
        head = "| change | old | new | |", "| --- | --- | --- | --- |"
        yield from (f"### {_plain(where)}", "", *head)
        for change in group:
            words = *_witnesses(change), _GUARANTEES[change.guarantee], change.note
            why = "<br>".join(map(_plain, filter(None, words)))
            cells = _plain(_headline(change)), _code(change.old), _code(change.new), why
            yield f"| {' | '.join(cells)} |"
        yield ""


def _code(text: str) -> str:
    """A text as code; a vertical bar would end the cell, a backtick the code."""
    if not text:
        return ""
    clean = " ".join(visible(truncate(text, LONGEST)).split()).replace("|", "\\|")
    return f"`` {clean} ``" if "`" in clean else f"`{clean}`"


def _plain(text: str) -> str:
    clean = " ".join(text.split())
    for letter in "\\|<>*_`[]#":
        clean = clean.replace(letter, f"\\{letter}")
    return clean


# For programs. The keys stay; new ones may come.


def as_json(comparison: Comparison, old: str, new: str) -> str:
    """One object: both files, `equal`, and all changes; see docs/diff.md."""
    document = {
        "version": 1,
        "old": old,
        "new": new,
        "equal": not comparison.differences,
        "verdict": comparison.verdict,
        "differences": [_change(change) for change in comparison.differences],
        "remarks": [_change(change) for change in comparison.remarks],
    }
    return json.dumps(document, indent=2) + "\n"


def _change(change: Difference) -> dict[str, Any]:
    found = {key: value for key, value in asdict(change).items() if key != "semantic"}
    for key in ("only_old", "only_new"):
        found[key] = [{"fact": fact, "value": answer} for fact, answer in found[key]]
    return found
