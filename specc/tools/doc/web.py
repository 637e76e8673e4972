"""The HTML of typst made fit for browsers: MathML mended, its font embedded, a style sheet.

Typst writes scripts before and behind one base as one element, where Chromium leaves a gap as wide
as those behind; accents as combining characters, which slip; links inside formulas where HTML has
none.
"""

from __future__ import annotations

import base64
import html
import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from importlib.resources import files
from pathlib import Path

from specc.diagnostics.visible import visible

_ACCENTS = {
    "\u0303": "\u02dc",
    "\u0302": "\u02c6",
    "\u0304": "\u00af",
    "\u0307": "\u02d9",
    "\u0308": "\u00a8",
    "\u20d7": "\u2192",
}
_LINK = re.compile(r'<a href="([^"]*)"><math>((?:(?!<math).)*?)</math></a>', re.DOTALL)
_EDGE = re.compile(r"<math\b[^>]*>|</math>")
_FEATURES = ["ccmp", "locl", "kern", "mark", "mkmk", "ssty", "dtls", "flac"]
"""Of a font, those that browsers use in formulas."""
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:"


def finished_html(text: str, title: str, math_font: Path) -> str:
    """The document as one file that needs no other."""
    text = _LINK.sub(r'<mi><a href="\1"><math>\2</math></a></mi>', text)
    parts, letters = [], set[str]()
    for part, is_math in _split(text):
        if is_math:
            root = ET.fromstring(part)
            _mend(root)
            letters |= set("".join(root.itertext()))
            part = ET.tostring(root, encoding="unicode", short_empty_elements=False)
        parts.append(part)
    head, _, body = "".join(parts).partition("</head>")
    style = files("specc.tools.doc").joinpath("static", "document.css").read_text("utf-8")
    font = base64.b64encode(_subset(math_font, letters)).decode()
    face = (
        '@font-face { font-family: "Specc Math"; '
        f'src: url("data:font/woff2;base64,{font}") format("woff2"); }}'
    )
    own = (
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        f"<title>{html.escape(visible(title))}</title><style>{face}\n{style}</style>"
    )
    head = re.sub(r"<title>.*?</title>", "", head, flags=re.DOTALL)
    return f"{head}{own}</head>{body}\n"


def _split(text: str) -> Iterator[tuple[str, bool]]:
    """Parts of a text, and whether each is a formula with all that is in it."""
    depth, start = 0, 0
    for found in _EDGE.finditer(text):
        if found[0] != "</math>":
            if depth == 0:
                yield text[start : found.start()], False
                start = found.start()
            depth += 1
        else:
            depth -= 1
            if depth == 0:
                yield text[start : found.end()], True
                start = found.end()
    yield text[start:], False


def _mend(root: ET.Element) -> None:
    for parent in root.iter():
        if parent.tag == "mtext":  # beside which signs would have no space
            parent.tag = "mi"
            parent.set("mathvariant", "normal")
        if parent.tag == "mover" and parent.get("accent") and len(parent) == 2:
            parent[1].text = _ACCENTS.get(parent[1].text or "", parent[1].text)
        for index, child in enumerate(parent):
            if child.tag == "mmultiscripts" and (mended := _without_gap(child)) is not None:
                parent[index] = mended


def _without_gap(old: ET.Element) -> ET.Element | None:
    """Scripts before a base inside, those behind it outside; None if one of the two is missing."""
    tags = [each.tag for each in old]
    if "mprescripts" not in tags or tags.index("mprescripts") != 3:
        return None
    base, sub, sup, mark, *before = old
    behind = [("sub", sub), ("sup", sup)]
    outer = [(name, each) for name, each in behind if len(each) or each.text]
    if not outer:
        return None
    new = ET.Element(f"m{''.join(name for name, _ in outer)}", old.attrib)
    inner = ET.SubElement(new, "mmultiscripts")
    inner.extend([base, ET.Element("mrow"), ET.Element("mrow"), mark, *before])
    new.extend(each for _, each in outer)
    new.tail = old.tail
    return new


def _subset(font: Path, letters: Iterable[str]) -> bytes:
    """The letters of a font as WOFF2, with what formulas need of it."""
    from fontTools import subset

    options = subset.Options(flavor="woff2", layout_features=_FEATURES, notdef_outline=True)
    loaded = subset.load_font(str(font), options)
    chosen = subset.Subsetter(options)
    chosen.populate(unicodes=sorted({ord(each) for each in letters} | set(range(0x20, 0x7F))))
    chosen.subset(loaded)
    data = io.BytesIO()
    subset.save_font(loaded, data, options)
    return data.getvalue()
