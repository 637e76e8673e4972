"""Expressions that a YAML comment cuts short."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

from specc.diagnostics import Diagnostic
from specc.expr import CUT_SHORT
from specc.source import Place, Sources

_COMMENT = re.compile(r"[ \t]+#")
_HELP = "` #` begins a comment in YAML: leave it out, or put the whole text in quotes"


def told_of_comments(found: Iterable[Diagnostic], sources: Sources) -> Iterator[Diagnostic]:
    """The findings; those of expressions that end too early and before a comment say so."""
    for finding in found:
        cut = finding.code == "E0301" and finding.message in CUT_SHORT
        yield replace(finding, help=_HELP) if cut and _before_comment(finding, sources) else finding


def _before_comment(finding: Diagnostic, sources: Sources) -> bool:
    place = finding.primary
    source = sources.get(place.file)
    if source is None or place.part != "value":
        return False
    end = source.offsets(Place(place.file, place.route))[1]
    return _COMMENT.match(source.text, end) is not None
