"""What is certainly wrong in a text with errors that keep it from being read as a whole.

It is found in the mended text. What only follows from the missing parts is not reported, since it
would go away with the error.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

from specc.diagnostics import Diagnostic, Edit
from specc.source import Place, Sources
from specc.tools.lsp.unfinished import difference

_OF_TEXTS = ("E02", "E03", "O02")
"""Names and types: wrong whatever the missing parts say, unless these declare the name."""
_WORD = re.compile(r"\w+")
_DEFINED = re.compile(r"[\w.]+(?=[\"']?\s*:)|(?m:^[ -]*[\w.]+)|enum\[[^\]\n]*")
_KEYS = frozenset(("enum", "is", "type", "when", "title", "init", "error", "terminal"))
"""Words of the language that messages use as well."""


def certain(
    found: Iterable[Diagnostic],
    mended: Sources,
    present: Sources,
    earlier: Iterable[Diagnostic],
) -> Iterator[Diagnostic]:
    """Findings of mended texts that also hold of the present texts, at offsets in these.

    Findings of an earlier analysis of the whole text are repeated.
    """
    known = {(diagnostic.code, diagnostic.message) for diagnostic in earlier}
    missing = {word for source in mended for word in _missing(source.text, present, source.path)}
    for diagnostic in found:
        names = set(_WORD.findall(diagnostic.message))
        of_text = diagnostic.code.startswith(_OF_TEXTS) and not names & missing
        if of_text or (diagnostic.code, diagnostic.message) in known:
            yield _by_offsets(diagnostic, mended)


def _missing(mended: str, present: Sources, path: str) -> Iterator[str]:
    """The names that a text defines where it was overwritten: keys, what begins a line, members."""
    source = present.get(path)
    if source is None or source.text == mended or len(source.text) != len(mended):
        return
    changed, text = difference(mended, source.text), source.text
    begin = text.rfind("\n", 0, changed.start) + 1
    for name in _DEFINED.finditer(text, begin):
        if name.start() >= changed.new_end:
            return
        if mended[name.end() - 1] == " ":
            yield from (word for word in _WORD.findall(name.group()) if word not in _KEYS)


def _by_offsets(diagnostic: Diagnostic, sources: Sources) -> Diagnostic:
    """A diagnostic whose places hold without the tree of the mended text."""

    def fixed(place: Place) -> Place:
        source = sources.get(place.file)
        return Place(place.file, (), "text", *source.offsets(place)) if source else place

    fix = diagnostic.fix
    return replace(
        diagnostic,
        primary=fixed(diagnostic.primary),
        related=tuple(replace(r, place=fixed(r.place)) for r in diagnostic.related),
        fix=fix and replace(fix, edits=tuple(Edit(fixed(e.place), e.text) for e in fix.edits)),
    )
