"""Repairs that write another name, as the file writes it: indices in braces stay in it.

A finding is about what a text became where `for` was unfolded, such as `raill_3`; the file has
`raill_{i}` there, once for all copies. So the letters change by which the right name differs, and
nothing else; where the difference is in an index there is no repair.
"""

from __future__ import annotations

import re
from dataclasses import replace

from specc.diagnostics.diagnostic import Edit, Fix
from specc.diagnostics.nearest import difference
from specc.source import Place, Sources

_TOKEN = re.compile(r"\{[^{}]*\}|.", re.DOTALL)
_INDEX = r"(-?\d+|\{[^{}]*\})"
_GOES_ON = re.compile(r"[\w{]")
_LONGEST = 200


def rename_fix(place: Place, wrong: str, right: str) -> Fix | None:
    """The repair that writes `right` where `wrong` was read; None if there is nothing to write."""
    return Fix(f"write `{right}`", (Edit(place, right, wrong),)) if right else None


def as_written(fix: Fix | None, sources: Sources) -> Fix | None:
    """A repair in terms of the text of the file; None if it would change more than letters."""
    if fix is None or not any(edit.old for edit in fix.edits):
        return fix
    (edit,) = fix.edits
    source = sources.get(edit.place.file)
    raw = source.scalar(edit.place) if source is not None else None
    if edit.place.part == "text" or source is None:
        return fix
    if raw is None:
        return None
    start = edit.place.start or 0
    found = renamed_as_written(raw[start:], edit.old, edit.text)
    if found is None or (edit.place.start is None and len(found[0]) != len(raw)):
        return None
    old, new = found
    place = replace(edit.place, start=start, end=start + len(old))
    return Fix(f"write `{new}`", (Edit(place, new, old),))


def renamed_as_written(raw: str, old: str, new: str) -> tuple[str, str] | None:
    """What at the beginning of `raw` became `old`, and the same with the letters of `new`."""
    tokens: list[str] = []
    for found in _TOKEN.finditer(raw[:_LONGEST]):
        tokens.append(found[0])
        at = _ends(tokens, old)
        if at is not None and not _GOES_ON.match(raw, found.end()):
            text = _changed(tokens, at, old, new)
            return None if text is None else ("".join(tokens), text)
    return None


def _ends(tokens: list[str], old: str) -> list[int] | None:
    """Where in `old` each token begins, and its end; None if they did not become that."""
    if len(tokens) > len(old):
        return None
    parts = (_INDEX if len(token) > 1 else f"({re.escape(token)})" for token in tokens)
    found = re.fullmatch("".join(parts), old, re.DOTALL)
    return None if found is None else [*(found.start(n + 1) for n in range(len(tokens))), len(old)]


def _changed(tokens: list[str], at: list[int], old: str, new: str) -> str | None:
    """The tokens with the letters of `new` in place of those of `old`."""
    made, done = "", 0
    for start, end, text in _differences(old, new):
        if start not in at or end not in at:
            return None
        first, last = at.index(start), at.index(end)
        if any(len(token) > 1 for token in tokens[first:last]):
            return None
        made += "".join(tokens[done:first]) + text
        done = last
    return made + "".join(tokens[done:])


def _differences(old: str, new: str) -> list[tuple[int, int, str]]:
    """Stretches of `old` with what `new` has instead: letters, or all that is not the same."""
    if old.casefold() == new.casefold() and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True))
        return [(n, n + 1, b) for n, (a, b) in pairs if a != b]
    start, ours, theirs = difference(old, new)
    return [(start, start + len(ours), theirs)]
