"""DOT text as SVG or PNG: the door to pygraphviz, which has Graphviz inside.

Graphviz is C code whose time and memory grow faster than what it draws, and it prints remarks about
fonts. So it works in a process of its own, with bounds: this file is its program, and imports
nothing of specc.
"""

from __future__ import annotations

import importlib.util
import json
import os
import resource
import subprocess
import sys
import tempfile
from base64 import b64decode, b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import Literal
from xml.sax.saxutils import escape

Format = Literal["svg", "png"]
MAX_ARCS = 250
"""More in one picture are illegible, and laid out in a time that nobody wants to wait for."""
MAX_NODES = 200
MAX_TEXT = 200_000
"""Of DOT text."""
_SECONDS = 5
_BYTES = 1_000_000_000
"""Of address space; what is used of it is a fraction."""
_SCALES = {
    "png": {"dpi": "144", "size": "28,28"},
    "svg": {"dpi": "84"},
}
"""Dots in an inch, and inches to which a larger picture is scaled down."""
_SHOWN = {
    b' baseline-shift="sub" font-size="10.00"': b' baseline-shift="sub" font-size="6.80"',
    b' font-size="10.00"': b' font-size="8.50"',
}
"""Sizes of texts in SVG: as Graphviz writes them, and as they are shown. It measures with a font of
this machine, and whoever looks at the picture may have one that is a sixth wider. It measures
subscripts smaller than it writes them. The whole is as much larger as the texts are smaller."""


_KNOWN_FONTS = (
    '<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd">'
    "<fontconfig><dir>{}</dir></fontconfig>"
)


class NotDrawn(Exception):
    """Graphviz made no picture within its bounds."""


def is_installed() -> bool:
    """Whether pictures can be drawn here."""
    return importlib.util.find_spec("pygraphviz") is not None


def render(dot: str, form: Format) -> bytes:
    """The picture that a DOT text describes. Raises NotDrawn."""
    return render_all([dot], form)[0]


def render_all(dots: Sequence[str], form: Format, fonts: Path | None = None) -> list[bytes]:
    """The pictures that DOT texts describe, by one process: all of them, or NotDrawn is raised.

    With a folder of `fonts` texts are measured with these alone, so that pictures are the same on
    all machines.
    """
    command = [sys.executable, "-P", __file__, form]
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ)
        if fonts is not None:
            known = Path(folder, "fonts.conf")
            known.write_text(_KNOWN_FONTS.format(escape(str(fonts))), "utf-8")
            environment["FONTCONFIG_FILE"] = str(known)
        try:
            done = subprocess.run(
                command,
                input=json.dumps(list(dots)).encode(),
                capture_output=True,
                check=False,
                timeout=12 * _SECONDS,
                env=environment,
            )
        except subprocess.TimeoutExpired as error:
            raise NotDrawn from error
    if done.returncode or not done.stdout:
        raise NotDrawn
    return [b64decode(each) for each in json.loads(done.stdout)]


def _draw(form: str) -> None:
    """What the process does: standard input to standard output."""
    resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
    import pygraphviz

    found = []
    for dot in json.loads(sys.stdin.buffer.read()):
        graph = pygraphviz.AGraph(string=dot)
        graph.graph_attr.update(_SCALES[form])
        graph.layout("dot")
        picture = graph.draw(format=form)
        if form == "svg":
            for written, shown in _SHOWN.items():
                picture = picture.replace(written, shown)
        found.append(b64encode(picture).decode())
    sys.stdout.buffer.write(json.dumps(found).encode())


if __name__ == "__main__":
    _draw(sys.argv[1])
