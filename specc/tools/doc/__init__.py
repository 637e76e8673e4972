"""The document of a specification, in the notation of the paper, as HTML and PDF."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from specc.analysis import Facts
from specc.model.system import System
from specc.refusal import Refused, missing_package
from specc.source import Sources
from specc.tools.doc.departures import Departure
from specc.tools.doc.document import DocumentWriter
from specc.tools.doc.markup import array, string, verbatim
from specc.tools.doc.typesetting import NotTypeset, typeset
from specc.tools.doc.web import finished_html
from specc.tools.graph.formats import draw_svgs
from specc.tools.graph.tags import TaggedDiagram

__all__ = ["DocumentFiles", "document_files"]

_PACKAGES = ("typst", "ziamath", "ziafont", "fontTools", "brotli", "pygraphviz")
_OWN_FONT = "Helvetica,sans-Serif"
_FONT = "DejaVu Sans"


@dataclass(frozen=True, slots=True)
class DocumentFiles:
    """A document in both formats."""

    html: bytes
    pdf: bytes


def document_files(
    system: System,
    facts: Facts,
    sources: Sources,
    path: str,
    departures: Sequence[Departure] = (),
    errors: int = 0,
) -> DocumentFiles:
    """The document of the system at `path`. Raises Refused."""
    for package in _PACKAGES:
        if importlib.util.find_spec(package) is None:
            raise missing_package(ModuleNotFoundError(name=package), package)
    written = DocumentWriter(system, facts, sources, path, departures, errors).write()
    folder = _fonts("ziafont")
    tagged = [TaggedDiagram(each, f"p{n}") for n, each in enumerate(written.pictures, 1)]
    pictures = array(map(_picture, draw_svgs(tagged, folder)))
    functions = files(__name__).joinpath("static", "document.typ").read_text("utf-8")
    head, _, body = written.text.partition("\n#front(")
    text = (
        f"{head}\n#let pictures = {pictures}\n{functions}\n"
        f"#show: frame.with({string(written.title)})\n#front({body}"
    )
    try:
        pdf, page = typeset(text, [str(folder)])
    except NotTypeset as error:
        raise Refused(f"typst could not set the document: {error}") from error
    math_font = _fonts("ziamath") / "STIXTwoMath-Regular.ttf"
    return DocumentFiles(finished_html(page, written.title, math_font).encode(), pdf)


def _fonts(package: str) -> Path:
    found = importlib.util.find_spec(package)
    assert found is not None and found.origin is not None
    return Path(found.origin).parent / "fonts"


def _picture(svg: str | None) -> str:
    return "none" if svg is None else verbatim(svg.replace(_OWN_FONT, f"{_FONT},{_OWN_FONT}"))
