"""DOT text as SVG or PNG: the door to pygraphviz, which has Graphviz inside.

Graphviz is C code whose time and memory grow faster than what it draws, and it prints remarks about
fonts. So it works in a process of its own, with bounds: this file is its program, and imports
nothing of specc.
"""

from __future__ import annotations

import importlib.util
import resource
import subprocess
import sys
from typing import Literal

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


class NotDrawn(Exception):
    """Graphviz made no picture within its bounds."""


def is_installed() -> bool:
    """Whether pictures can be drawn here."""
    return importlib.util.find_spec("pygraphviz") is not None


def render(dot: str, form: Format) -> bytes:
    """The picture that a DOT text describes. Raises NotDrawn."""
    command = [sys.executable, "-P", __file__, form]
    try:
        done = subprocess.run(
            command, input=dot.encode(), capture_output=True, check=False, timeout=12 * _SECONDS
        )
    except subprocess.TimeoutExpired as error:
        raise NotDrawn from error
    if done.returncode or not done.stdout:
        raise NotDrawn
    return done.stdout


def _draw(form: str) -> None:
    """What the process does: standard input to standard output."""
    resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
    import pygraphviz

    graph = pygraphviz.AGraph(string=sys.stdin.buffer.read().decode())
    graph.graph_attr.update(_SCALES[form])
    graph.layout("dot")
    picture = graph.draw(format=form)
    if form == "svg":
        for written, shown in _SHOWN.items():
            picture = picture.replace(written, shown)
    sys.stdout.buffer.write(picture)


if __name__ == "__main__":
    _draw(sys.argv[1])
