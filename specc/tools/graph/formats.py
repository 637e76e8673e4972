"""The formats of pictures: how one is drawn, how its files begin, and who wrote them."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from struct import pack
from typing import Literal
from zlib import crc32

from specc.refusal import Refused, missing_package
from specc.tools.graph import drawing
from specc.tools.graph.diagram import Diagram
from specc.tools.graph.dot import NOTE_COLOR, Tags, as_dot
from specc.tools.graph.lines import set_lines
from specc.tools.graph.tags import TaggedDiagram

# A file says which command wrote it, so that commands replace no pictures of others.


_MARK = re.compile(rb"specc (graph|plot|report)")
_LENGTH = 200
"""Bytes at the beginning of a file, or at its end, that have the mark in them."""
_PNG_HEAD = 33
"""Bytes of the signature and of the first chunk."""


@dataclass(frozen=True, slots=True)
class FileSignature:
    """How files of a format begin, and how `sign` puts the mark of a command into a picture."""

    start: bytes
    sign: Callable[[bytes, bytes], bytes]
    is_at_end: bool = False
    """Whether the mark is near the end of the file, not near its beginning."""

    def is_own(self, path: str) -> bool:
        """Whether a file is a picture of this format with the mark of a command."""
        if not os.path.isfile(path):
            return False
        with open(path, "rb") as file:
            start = file.read(_LENGTH)
            if self.is_at_end:
                file.seek(-min(_LENGTH, os.fstat(file.fileno()).st_size), os.SEEK_END)
            marked = file.read(_LENGTH) if self.is_at_end else start
        return start.startswith(self.start) and _MARK.search(marked) is not None


def mark_of(command: str) -> bytes:
    """The mark of `graph`, `plot` or `report`."""
    return f"specc {command}".encode()


def _sign_svg(picture: bytes, mark: bytes) -> bytes:
    declaration, end, rest = picture.partition(b"\n")
    return declaration + end + b"<!-- " + mark + b" -->\n" + rest


def _sign_png(picture: bytes, mark: bytes) -> bytes:
    text = b"tEXtSoftware\0" + mark
    chunk = pack(">I", len(text) - 4) + text + pack(">I", crc32(text))
    return picture[:_PNG_HEAD] + chunk + picture[_PNG_HEAD:]


def _sign_dot(picture: bytes, mark: bytes) -> bytes:
    return b"// " + mark + b"\n" + picture


def _sign_html(page: bytes, mark: bytes) -> bytes:
    doctype, end, rest = page.partition(b"\n")
    return doctype + end + b"<!-- " + mark + b" -->" + end + rest


def _sign_pdf(picture: bytes, mark: bytes) -> bytes:
    return picture + b"% " + mark + b"\n"  # a PDF has the offsets of its parts from the beginning


# The formats of `specc graph`.


_DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>\n'
_SMALLER = "name a part, such as one agent or subsystem, or take the text with --format dot"


@dataclass(frozen=True, slots=True)
class PictureFormat:
    """A format of `specc graph`; `render` raises Refused where it cannot draw a diagram."""

    render: Callable[[Diagram], bytes]
    signature: FileSignature
    is_text: bool = False
    """Whether it goes to standard output unless a file is named."""


def draw_svg(tagged: TaggedDiagram) -> str:
    """The element `svg` of a picture. Raises Refused."""
    return _element(_draw("svg", tagged.diagram, tagged.tags))


def draw_svgs(all_tagged: Sequence[TaggedDiagram], fonts: Path) -> list[str | None]:
    """The elements of several pictures, with texts measured in the fonts of a folder.

    None stands for one that is too large.
    """
    texts: dict[int, str] = {}
    for number, tagged in enumerate(all_tagged):
        with suppress(Refused):
            texts[number] = _text(tagged.diagram, tagged.tags)
    try:
        drawn = drawing.render_all(list(texts.values()), "svg", fonts)
    except drawing.NotDrawn:  # one of them takes too long
        drawn = [_alone(text, fonts) for text in texts.values()]
    found = dict(zip(texts, drawn, strict=True))
    pictures = (found.get(number) for number in range(len(all_tagged)))
    return [_element(picture) if picture else None for picture in pictures]


def _alone(text: str, fonts: Path) -> bytes:
    try:
        return drawing.render_all([text], "svg", fonts)[0]
    except drawing.NotDrawn:
        return b""


def _element(picture: bytes) -> str:
    """Graphviz would put names of nodes into comments and titles, where it escapes too little."""
    text = picture.decode()
    text = re.sub(r"<!--.*?-->\n|<title>.*?</title>\n", "", text[text.index("<svg") :])
    return set_lines(text, NOTE_COLOR)


def _draw(form: Literal["svg", "png"], diagram: Diagram, tags: Tags | None = None) -> bytes:
    """The picture by Graphviz. Raises Refused."""
    text = _text(diagram, tags)
    try:
        return drawing.render(text, form)
    except drawing.NotDrawn:
        raise Refused(f"Graphviz could not draw this within its bounds; {_SMALLER}") from None


def _text(diagram: Diagram, tags: Tags | None) -> str:
    """The DOT text of a picture that can be drawn. Raises Refused."""
    text = as_dot(diagram, tags)
    if not drawing.is_installed():
        raise missing_package(ModuleNotFoundError(name="pygraphviz"), "pygraphviz")
    nodes, arcs = sum(1 for _ in diagram.all_nodes), len(diagram.arcs)
    if nodes > drawing.MAX_NODES or arcs > drawing.MAX_ARCS or len(text) > drawing.MAX_TEXT:
        size = f"{nodes:,} nodes and {arcs:,} arcs"
        raise Refused(f"a picture with {size} is not legible; {_SMALLER}")
    return text


FORMATS: Mapping[str, PictureFormat] = {
    "svg": PictureFormat(
        lambda d: f"{_DECLARATION}{draw_svg(TaggedDiagram(d, ''))}\n".encode(),
        FileSignature(b"<?xml", _sign_svg),
    ),
    "png": PictureFormat(partial(_draw, "png"), FileSignature(b"\x89PNG", _sign_png)),
    "dot": PictureFormat(
        lambda d: as_dot(d).encode(), FileSignature(b"//", _sign_dot), is_text=True
    ),
}
"""By name, which is also the ending of files; the first is the default."""

SIGNATURES = {name: form.signature for name, form in FORMATS.items()} | {
    "pdf": FileSignature(b"%PDF", _sign_pdf, is_at_end=True),  # of `specc plot`
    "html": FileSignature(b"<!doctype html>", _sign_html),  # of `specc report`
}
"""By format; a table of numbers has no place for a mark."""
