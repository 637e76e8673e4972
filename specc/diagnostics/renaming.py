"""Repairs that write another name, as the file writes it: indices in braces stay in it.

A finding is about what a text became where `for` was unfolded, such as `raill_3`; the file has
`raill_{i}` there, once for all copies. So the letters change by which the right name differs, and
nothing else; where the difference is in an index there is no repair.
"""

from __future__ import annotations

import re
from dataclasses import replace

from specc.diagnostics.diagnostic import Edit, Fix
from specc.source import Place, Sources

_INDEX = re.compile(r"(-?\d+|\{[^{}]*\})")
_LONGEST = 200


def rename_fix(place: Place, wrong: str, right: str) -> Fix | None:
    """The repair that writes `right` where `wrong` was read; None without a replacement."""
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
    """The text at the start of `raw` that was read as `old`, and its replacement.

    The replacement spells `new` and keeps the braces of indices; None if the indices differ.
    """
    parts = _INDEX.split(new)
    found = re.match(_pattern(old), raw[:_LONGEST])
    if found is None or _INDEX.split(old)[1::2] != parts[1::2]:
        return None
    parts[1::2] = found.groups()
    return found[0], "".join(parts)


def _pattern(name: str) -> str:
    """A pattern of what files may have for a name: any number in it may be an index in braces."""
    parts = enumerate(_INDEX.split(name))
    texts = (rf"({re.escape(t)}|\{{[^{{}}]*\}})" if n % 2 else re.escape(t) for n, t in parts)
    return rf"{''.join(texts)}(?![\w{{])"
