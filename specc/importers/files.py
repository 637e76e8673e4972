"""Files of other formats: from a path to a tree, with findings for what is wrong on the way."""

from __future__ import annotations

from specc.importers.carried import Notes
from specc.importers.markup import Element, MarkupError, parse_markup
from specc.read.load import UnreadableFileError, load_text
from specc.source import SourceFile, Sources


def read_markup(path: str, notes: Notes, sources: Sources) -> Element | None:
    """The root of the XML file at `path`, or None with the reason in `notes`."""
    try:
        text, _ = load_text(path)
    except UnreadableFileError as refusal:
        sources.add(SourceFile(path, refusal.text))
        notes.diagnostics.append(refusal.diagnostic)
        return None
    sources.add(SourceFile(path, text))
    try:
        return parse_markup(path, text)
    except MarkupError as refusal:
        notes.diagnostics.append(refusal.diagnostic)
        return None
