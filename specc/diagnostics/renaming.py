"""Repairs that write another name, as the file writes it: indices in braces stay in it.

A finding is about what a text became where `for` was unfolded, such as `raill_3`; the file has
`raill_{i}` there, once for all copies. So the letters change by which the right name differs, and
nothing else; where the difference is in an index there is no repair.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

from specc.diagnostics.diagnostic import Diagnostic, Edit, Fix
from specc.reachable import grouped
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


_NOT_DEFINED = ("E0101", "E0304", "E0502", "E0905")
"""Findings about words that specifications do not define."""
_FOR_READERS = ("let", "constants", "initial", "terminal", "error", "functions", "behaviours")
"""Keys below which names stand that no run and no other subsystem shows."""


def offer_both_renames(diagnostics: Iterable[Diagnostic], sources: Sources) -> list[Diagnostic]:
    """Write repairs as files spell them, and offer to rename definitions instead.

    A name that stands nowhere but where it is defined may be misspelt there, so the help offers to
    rename the definition. That is the repair if the other name stands at several places and no
    other file can use the definition. If each name stands at one place, the use is repaired only
    if the name is seen by readers alone.
    """
    found = [replace(d, fix=as_written(d.fix, sources)) if d.fix else d for d in diagnostics]
    typos = grouped((typo, number) for number, d in enumerate(found) if (typo := _typo(d)))
    for (wrong, right), numbers in typos.items():
        if _count(right, sources) != 1 or (place := _definition(right, sources)) is None:
            continue
        uses = [found[number] for number in numbers]
        if _count(wrong, sources) > 1:
            fix = _rename_definition(place, right, wrong, uses, sources)
        else:
            fix = uses[0].fix if ("", *place.route)[-2] in _FOR_READERS else None
        for number, use in zip(numbers, uses, strict=True):
            hint = f"{use.help} or rename the definition"
            found[number] = replace(use, help=hint, fix=fix)
    return found


def _typo(diagnostic: Diagnostic) -> tuple[str, str] | None:
    """The unknown part of a name and its probable correction, as the file writes them."""
    if diagnostic.fix is None or diagnostic.code in _NOT_DEFINED:
        return None
    edit = diagnostic.fix.edits[0]
    pairs = zip(edit.old.split("."), edit.text.split("."), strict=False)
    return next(((old, new) for old, new in pairs if old != new), None)


def _count(name: str, sources: Sources) -> int:
    """How often a name stands in files."""
    word = re.compile(rf"(?<!\w){_pattern(name)}")
    return sum(1 for source in sources for _ in word.finditer(source.text))


def _definition(name: str, sources: Sources) -> Place | None:
    """The first key that spells `name`; one right below `x` or `y` refers to a peer."""
    word = re.compile(_pattern(name))
    for source in sources:
        for route, *_ in source.nodes:
            if word.fullmatch(str(route[-1])) and ("", *route)[-2] not in ("x", "y"):
                return Place(source.path, route, "key")
    return None


def _rename_definition(
    place: Place, old: str, new: str, uses: Iterable[Diagnostic], sources: Sources
) -> Fix | None:
    """The repair of a definition, if no other file can use it."""
    source, key = sources.get(place.file), str(place.route[-1])
    renamed = renamed_as_written(key, old, new)
    is_of_system = source is not None and source.node(("system",)) is not None
    if not (is_of_system and renamed and all(use.primary.file == place.file for use in uses)):
        return None
    return Fix(f"rename the definition to `{renamed[1]}`", (Edit(place, renamed[1], key),))
