"""Files of other formats: from a path to a tree, with findings for what is wrong on the way."""

from __future__ import annotations

import re

from specc.importers.carried import Notes
from specc.importers.markup import Element, MarkupError, parse_markup
from specc.read.load import UnreadableFileError, load_text
from specc.source import Place, SourceFile, Sources


def read_markup(path: str, root: str, notes: Notes, sources: Sources) -> Element | None:
    """The root of the XML file at `path`, or None with the reason in `notes`.

    A text without a tag `root` is another's, and nothing of it is shown.
    """
    try:
        text, _ = load_text(path)
    except UnreadableFileError as refusal:
        notes.diagnostics.append(refusal.diagnostic)
        return None
    if not re.search(rf"<(?:[\w.-]+:)?{root}[\s/>]", text):
        message = f"the file has no <{root}>"
        notes.error("E0803", message, Place(path), "is this the right file, and the right format?")
        return None
    sources.add(SourceFile(path, text))
    try:
        return parse_markup(path, text)
    except MarkupError as refusal:
        notes.diagnostics.append(refusal.diagnostic)
        return None
