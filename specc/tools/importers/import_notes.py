"""What was carried over and what was not; files that are read for it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from specc.diagnostics import Diagnostic
from specc.reachable import grouped
from specc.read.document import UnreadableFileError, load_text
from specc.source import Place, SourceFile, Sources
from specc.tools.fmt import formatted
from specc.tools.importers.markup import MarkupError, XmlElement, parse_markup
from specc.tools.importers.writing import Data, comment_lines, to_yaml

# What an import gives: a specification and the list of what is not, or not quite, in it.


_WIDTH = 98


@dataclass(eq=False, slots=True)
class Notes:
    """The files that are imported, and findings about them in the order in which they were made."""

    sources: Sources = field(default_factory=Sources)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    text: str = ""
    """Of the specification; empty where an error kept it from being made."""

    def error(self, code: str, message: str, place: Place, help: str) -> None:
        """Something without which there is no specification."""
        self.diagnostics.append(Diagnostic(code, message, place, help=help))

    def lost(self, message: str, place: Place) -> None:
        """Something that the specification does not have."""
        self.diagnostics.append(Diagnostic("W0801", message, place))

    def changed(self, message: str, place: Place, help: str = "") -> None:
        """Something that the specification has in another form, or that was assumed."""
        self.diagnostics.append(Diagnostic("W0802", message, place, help=help))

    def need(self, element: XmlElement, attribute: str) -> str:
        """The value of an attribute; a missing or empty one is an error and gives ""."""
        value = element.get(attribute)
        if value:
            return value
        message = f"<{element.tag}> needs the attribute `{attribute}`"
        self.error("E0804", message, element.place, f'write `{attribute}="..."`')
        return ""

    @property
    def failed(self) -> bool:
        """Whether no specification can be made."""
        return any(item.severity == "error" for item in self.diagnostics)

    def leftovers(self, root: XmlElement, reasons: Mapping[tuple[str, str], str]) -> None:
        """Report what was not used of a document, once for each kind of element or attribute.

        `reasons` says why, by tag and attribute; the attribute is "" for an element.
        """
        groups = grouped(((each.tag, attribute), each) for each, attribute in root.untaken())
        self._texts(root)
        for (tag, attribute), elements in groups.items():
            first = elements[0]
            what = f"attribute `{attribute}` of <{tag}>" if attribute else f"<{tag}>"
            times = f" ({len(elements)} times, first here)" if len(elements) > 1 else ""
            reason = reasons.get((tag, attribute), "specc knows no counterpart")
            place = first.value_place(attribute) if attribute else first.place
            self.lost(f"{what} is not carried over{times}: {reason}", place)

    def _texts(self, root: XmlElement) -> None:
        """Report characters between tags: the formats that are imported give them no meaning."""
        for tag, elements in grouped((each.tag, each) for each in root.with_text()).items():
            times = f" ({len(elements)} times, first here)" if len(elements) > 1 else ""
            words = f"the text in <{tag}> is not carried over{times}: it has no meaning there"
            self.lost(words, elements[0].place)


def document(command: str, parts: Iterable[str], notes: Notes, data: Mapping[str, Data]) -> str:
    """The text of a specification with what was lost or changed at its head."""
    lines = [f"Made by `{command}`.", *parts]
    if notes.diagnostics:
        lines.append("What differs from the files, or is assumed:")
    spans = [(notes.sources.span(item.primary), item) for item in notes.diagnostics]
    for span, item in sorted(spans, key=lambda pair: (pair[0].file, pair[0].line, pair[0].col)):
        name = span.file.replace("\\", "/").rsplit("/", 1)[-1]
        lines.append(f"- {item.code} {name}:{span.line}: {item.message}")
    head = "".join(f"# {line}\n" for text in lines for line in comment_lines(text, _WIDTH))
    return formatted(head + to_yaml(data))


# Files of other formats: from a path to a tree, with findings for what is wrong on the way.


def read_markup(path: str, root: str, notes: Notes) -> XmlElement | None:
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
    notes.sources.add(SourceFile(path, text))
    try:
        return parse_markup(path, text)
    except MarkupError as refusal:
        notes.diagnostics.append(refusal.diagnostic)
        return None
