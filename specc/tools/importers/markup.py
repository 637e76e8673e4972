"""XML as a tree with places in the text, which remembers what has been used.

Document types and entities are refused: the formats that are imported have none, and entities make
a short file endless. What is not used of the tree is reported: nothing is dropped silently.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from specc.diagnostics import Diagnostic
from specc.source import Place

_DEEPEST = 100
_MOST_ELEMENTS = 4_000
_MOST_ATTRIBUTES = 20_000
_TAG = re.compile(r"""(?:[^>"']|"[^"]*"|'[^']*')*+>""")
_ATTRIBUTE = re.compile(r"""\s([^\s=<>"'/]+)\s*=\s*("[^"]*"|'[^']*')""")


class MarkupError(Exception):
    """A text that is not XML as it is accepted here, with the finding that says why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


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
    taken: set[str] = field(default_factory=set)
    quoted: dict[str, tuple[int, int]] = field(default_factory=dict, repr=False)
    """Where the values of attributes stand in the text; looked for once."""
    seen: bool = False

    @property
    def place(self) -> Place:
        """The start tag."""
        return Place(self.path, (), "text", self.start, self.end)

    def value_place(self, name: str, start: int = 0, end: int | None = None) -> Place:
        """The value of an attribute, or a stretch of it; the start tag if there is none."""
        if not self.quoted:
            self.quoted = {
                found[1]: (found.start(2) + 1, found.end(2) - 1)
                for found in _ATTRIBUTE.finditer(self.source, self.start, self.end)
            }
        if name not in self.quoted:
            return self.place
        first, last = self.quoted[name]
        if self.source[first:last] != self.attributes.get(name):
            return Place(self.path, (), "text", first, last)
        return Place(self.path, (), "text", first + start, last if end is None else first + end)

    def get(self, name: str) -> str | None:
        """The value of an attribute, which counts as looked at."""
        self.taken.add(name)
        value = self.attributes.get(name)
        return None if value is None else value.strip()

    def all(self, *tags: str) -> list[XmlElement]:
        """The children of some tags in the order of the document; they count as looked at."""
        found = [child for child in self.children if child.tag in tags]
        for child in found:
            child.seen = True
        return found

    def take_whole(self) -> None:
        """Count everything in this element as looked at."""
        self.seen = True
        self.taken.update(self.attributes)
        for child in self.children:
            child.take_whole()

    def untaken(self) -> Iterator[tuple[XmlElement, str]]:
        """Elements, with "", and attributes of elements that nobody has looked at."""
        if not self.seen:
            yield self, ""
            return
        for name in self.attributes:
            if name not in self.taken:
                yield self, name
        for child in self.children:
            yield from child.untaken()

    def with_text(self) -> Iterator[XmlElement]:
        """Elements that somebody has looked at and that have characters beside their children."""
        if self.seen:
            if self.text.strip():
                yield self
            for child in self.children:
                yield from child.with_text()


def parse_markup(path: str, text: str) -> XmlElement:
    """The root element of an XML text; `path` only names it.

    Raises:
        MarkupError: the text is not XML, has a document type, or is nested or split too much.
    """
    return _Builder(path, text).run()


class _Builder:
    def __init__(self, path: str, text: str) -> None:
        self._path, self._text = path, text
        self._bytes = text.encode("utf-8", "surrogatepass")
        self._ascii = len(self._bytes) == len(text)
        self._counted, self._characters = 0, 0
        self._open: list[XmlElement] = []
        self._root: XmlElement | None = None
        self._count = self._attributes = 0
        # A text is handed over, not bytes: its encoding is known, whatever the declaration says.
        self._parser = expat.ParserCreate(namespace_separator=" ")
        # Otherwise every line break is handed over by itself.
        self._parser.buffer_text = True
        self._parser.buffer_size = max(len(self._bytes), 1)
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters_read
        self._parser.StartDoctypeDeclHandler = self._refuse_doctype

    def run(self) -> XmlElement:
        try:
            self._parser.Parse(self._bytes.decode("utf-8"), True)
        except expat.ExpatError as error:
            at = self._offset_of(error.lineno, error.offset)
            reason = expat.errors.messages[error.code]
            raise self._refusal("E0801", f"this is not XML: {reason}", at) from None
        except (UnicodeDecodeError, ValueError):
            raise self._refusal("E0801", "this is not XML: not a text", 0) from None
        assert self._root is not None  # expat refuses a document without an element
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        start = self._here()
        self._attributes += len(attributes)
        many = self._count > _MOST_ELEMENTS or self._attributes > _MOST_ATTRIBUTES
        if len(self._open) >= _DEEPEST or many:
            message = (
                f"more than {_DEEPEST} levels, {_MOST_ELEMENTS} elements "
                f"or {_MOST_ATTRIBUTES} attributes"
            )
            raise self._refusal("E0801", message, start)
        element = XmlElement(tag, attributes, self._path, start, self._tag_end(start), self._text)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        self._open.pop()

    def _characters_read(self, text: str) -> None:
        if self._open:
            self._open[-1].text += text

    def _refuse_doctype(self, *_: object) -> None:
        raise self._refusal("E0802", "the file declares a document type", self._here())

    def _here(self) -> int:
        """Offset of the current event in characters; events come in the order of the text."""
        at = self._parser.CurrentByteIndex
        if self._ascii:
            return at
        self._characters += len(self._bytes[self._counted : at].decode("utf-8", "replace"))
        self._counted = at
        return self._characters

    def _tag_end(self, start: int) -> int:
        """Past the `>` of a start tag; one inside quotes does not count."""
        tag = _TAG.match(self._text, start)
        return tag.end() if tag else len(self._text)

    def _offset_of(self, line: int, column: int) -> int:
        lines = self._text.split("\n")
        return min(sum(len(part) + 1 for part in lines[: line - 1]) + column, len(self._text))

    def _refusal(self, code: str, message: str, at: int) -> MarkupError:
        place = Place(self._path, (), "text", at, at)
        help = "save the file as one well-formed XML document without a document type"
        return MarkupError(Diagnostic(code, message, place, help=help))
