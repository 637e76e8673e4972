"""Reading XML files of other formats: trees with places, and notes on what is not carried over.

Document types and entities are refused: the formats that are imported have none, and entities make
a short file endless. What is not used of a tree is reported: nothing is dropped silently.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from specc.diagnostics import Diagnostic
from specc.reachable import grouped
from specc.read.document import UnreadableFileError, load_text
from specc.source import Place, SourceFile, Sources
from specc.tools.importers.writing import comment_lines, fill_yaml

_DEEPEST = 100
_MOST_ELEMENTS = 4_000
_MOST_ATTRIBUTES = 20_000
_TAG = re.compile(r"""(?:[^>"']|"[^"]*"|'[^']*')*+>""")
_ATTRIBUTE = re.compile(r"""\s([^\s=<>"'/]+)\s*=\s*("[^"]*"|'[^']*')""")
_WIDTH = 98


@dataclass(eq=False, slots=True)
class XmlElement:
    """An element of an XML document; `start` and `end` delimit its start tag in the text."""

    tag: str
    attributes: dict[str, str]
    path: str
    start: int
    end: int
    source: str = field(repr=False)
    children: list[XmlElement] = field(default_factory=list)
    text: str = ""
    used: bool = False
    used_attributes: set[str] = field(default_factory=set)
    _spans: dict[str, tuple[int, int]] = field(default_factory=dict, repr=False)
    """Where the values of attributes stand in the text; computed once."""

    @property
    def place(self) -> Place:
        """The start tag."""
        return Place(self.path, (), "text", self.start, self.end)

    def value_place(self, name: str, start: int = 0, end: int | None = None) -> Place:
        """The value of an attribute, or a stretch of it; the start tag if there is none."""
        if not self._spans:
            self._spans = {
                found[1]: (found.start(2) + 1, found.end(2) - 1)
                for found in _ATTRIBUTE.finditer(self.source, self.start, self.end)
            }
        if name not in self._spans:
            return self.place
        first, last = self._spans[name]
        if self.source[first:last] != self.attributes.get(name):
            return Place(self.path, (), "text", first, last)
        return Place(self.path, (), "text", first + start, last if end is None else first + end)

    def get(self, name: str) -> str:
        """The value of an attribute, which counts as used; empty if it is missing."""
        self.used_attributes.add(name)
        return self.attributes.get(name, "").strip()

    def all(self, *tags: str) -> list[XmlElement]:
        """The children of some tags in the order of the document; they count as used."""
        found = [child for child in self.children if child.tag in tags]
        for child in found:
            child.used = True
        return found

    def use_all(self) -> None:
        """Count everything in this element as used."""
        for each in self.walk():
            each.used = True
            each.used_attributes.update(each.attributes)

    def walk(self) -> Iterator[XmlElement]:
        """This element and all in it, in the order of the document."""
        yield self
        for child in self.children:
            yield from child.walk()

    def unused(self) -> Iterator[tuple[XmlElement, str]]:
        """Elements, with "", and attributes of used elements that are not used."""
        if not self.used:
            yield self, ""
            return
        yield from ((self, name) for name in self.attributes if name not in self.used_attributes)
        for child in self.children:
            yield from child.unused()

    def with_text(self) -> Iterator[XmlElement]:
        """Used elements that have characters beside their children."""
        if self.used:
            if self.text.strip():
                yield self
            for child in self.children:
                yield from child.with_text()


class MarkupError(Exception):
    """A text that is not XML as it is accepted here, with the finding that says why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def parse_markup(path: str, text: str) -> XmlElement:
    """The root element of an XML text; `path` only names it.

    Raises:
        MarkupError: the text is not XML, has a document type, or is nested or split too much.
    """
    encoded = text.encode("utf-8", "surrogatepass")
    offset = _offsets(encoded, len(text))
    open_elements: list[XmlElement] = []
    elements: list[XmlElement] = []
    attribute_count = 0

    def refusal(code: str, message: str, at: int) -> MarkupError:
        help = "save the file as one well-formed XML document without a document type"
        return MarkupError(Diagnostic(code, message, Place(path, (), "text", at, at), help=help))

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal attribute_count
        at = offset(parser.CurrentByteIndex)
        attribute_count += len(attributes)
        many = len(elements) >= _MOST_ELEMENTS or attribute_count > _MOST_ATTRIBUTES
        if len(open_elements) >= _DEEPEST or many:
            message = (
                f"more than {_DEEPEST} levels, {_MOST_ELEMENTS} elements "
                f"or {_MOST_ATTRIBUTES} attributes"
            )
            raise refusal("E0801", message, at)
        end = _TAG.match(text, at)  # a `>` inside quotes does not count
        element = XmlElement(tag, attributes, path, at, end.end() if end else len(text), text)
        elements.append(element)
        if open_elements:
            open_elements[-1].children.append(element)
        open_elements.append(element)

    def characters(found: str) -> None:
        if open_elements:
            open_elements[-1].text += found

    def refuse_doctype(*_: object) -> None:
        at = offset(parser.CurrentByteIndex)
        raise refusal("E0801", "the file declares a document type", at)

    parser = expat.ParserCreate(namespace_separator=" ")
    # Otherwise every line break is handed over by itself.
    parser.buffer_text = True
    parser.buffer_size = max(len(encoded), 1)
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: open_elements.pop()
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        # A text is handed over, not bytes: its encoding is known, whatever the declaration says.
        parser.Parse(encoded.decode("utf-8"), True)
    except expat.ExpatError as error:
        lines = text.split("\n")[: error.lineno - 1]
        at = min(sum(len(line) + 1 for line in lines) + error.offset, len(text))
        reason = expat.errors.messages[error.code]
        raise refusal("E0801", f"this is not XML: {reason}", at) from None
    except (UnicodeDecodeError, ValueError):
        raise refusal("E0801", "this is not XML: not a text", 0) from None
    return elements[0]  # expat refuses a document without an element


def _offsets(encoded: bytes, length: int) -> Callable[[int], int]:
    """Offsets in characters of offsets in bytes, which are asked for in ascending order."""
    counted = characters = 0

    def offset(at: int) -> int:
        nonlocal counted, characters
        if len(encoded) == length:
            return at
        characters += len(encoded[counted:at].decode("utf-8", "replace"))
        counted = at
        return characters

    return offset


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

    def loss(self, message: str, place: Place) -> None:
        """Something that the specification does not have."""
        self.diagnostics.append(Diagnostic("W0801", message, place))

    def change(self, message: str, place: Place, help: str = "") -> None:
        """Something that the specification has in another form, or that was assumed."""
        self.diagnostics.append(Diagnostic("W0802", message, place, help=help))

    @property
    def failed(self) -> bool:
        """Whether no specification can be made."""
        return any(item.severity == "error" for item in self.diagnostics)

    def read(self, path: str, root: str) -> XmlElement | None:
        """The root of the XML file at `path`; None, with a finding, if it cannot be read.

        A text without a tag `root` is another's, and nothing of it is shown.
        """
        try:
            text, _ = load_text(path)
            if not re.search(rf"<(?:[\w.-]+:)?{root}[\s/>]", text):
                help = "is this the right file, and the right format?"
                self.error("E0803", f"the file has no <{root}>", Place(path), help)
                return None
            self.sources.add(SourceFile(path, text))
            return parse_markup(path, text)
        except (UnreadableFileError, MarkupError) as refusal:
            self.diagnostics.append(refusal.diagnostic)
            return None

    def need(self, element: XmlElement, attribute: str) -> str:
        """The value of an attribute; a missing or empty one is an error and gives ""."""
        value = element.get(attribute)
        if not value:
            message = f"<{element.tag}> needs the attribute `{attribute}`"
            self.error("E0803", message, element.place, f'write `{attribute}="..."`')
        return value

    def report_unused(self, root: XmlElement, reasons: Mapping[tuple[str, str], str]) -> None:
        """Report what was not used of a document, once for each kind of element or attribute.

        `reasons` says why, by tag and attribute; the attribute is "" for an element. Characters
        between tags have no meaning in the formats that are imported.
        """
        for tag, elements in grouped((each.tag, each) for each in root.with_text()).items():
            message = f"the text in <{tag}> is not carried over{_times(elements)}"
            self.loss(f"{message}: it has no meaning there", elements[0].place)
        unused = grouped(((each.tag, attribute), each) for each, attribute in root.unused())
        for (tag, attribute), elements in unused.items():
            what = f"attribute `{attribute}` of <{tag}>" if attribute else f"<{tag}>"
            reason = reasons.get((tag, attribute), "specc knows no counterpart")
            message = f"{what} is not carried over{_times(elements)}: {reason}"
            first = elements[0]
            self.loss(message, first.value_place(attribute) if attribute else first.place)

    def write(self, template: str, parts: Mapping[str, Any], *remarks: str) -> None:
        """Fill the template of the specification, with what was lost or changed at its head."""
        lines = list(remarks)
        if self.diagnostics:
            lines.append("What differs from the files, or is assumed:")
        spans = [(self.sources.span(item.primary), item) for item in self.diagnostics]
        for span, item in sorted(spans, key=lambda pair: (pair[0].file, pair[0].line, pair[0].col)):
            name = span.file.replace("\\", "/").rsplit("/", 1)[-1]
            lines.append(f"- {item.code} {name}:{span.line}: {item.message}")
        head = [line for text in lines for line in comment_lines(text, _WIDTH)]
        self.text = fill_yaml(template, {"head": head, **parts})


def _times(elements: list[XmlElement]) -> str:
    return f" ({len(elements)} times, first here)" if len(elements) > 1 else ""
