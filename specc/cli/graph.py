"""`specc graph`: a picture of a specification, in a file or as DOT text."""

from __future__ import annotations

import os
from argparse import Namespace
from importlib import import_module

from specc.cli import streams
from specc.cli.pictures import write_picture
from specc.refusal import Refused
from specc.tools.graph import Diagram, as_dot, drawing, picture

FORMATS = ("svg", "png", "dot")
DONE, WRONG = 0, 1


def graph(options: Namespace) -> int:
    """Draw what is known of a specification.

    0 if all of it is right; 1 if it has errors, which are told: without them, more might be drawn;
    2 for wrong usage, and where a file cannot be written.
    """
    from specc import pipeline

    result = pipeline.read_spec(options.spec)
    wrong = any(found.severity == "error" for found in result.diagnostics)
    code = (
        streams.print_findings(result, options.spec) or WRONG
        if wrong or not result.system
        else DONE
    )
    if result.system is None or code == streams.USAGE_ERROR or (code and not result.system.agents):
        return code
    form = _format(options)
    kind, diagram = picture(result.system, options.place, options.of)
    content = _content(diagram, form)
    if form == "dot" and not options.out:
        streams.print_output(content.decode())
        return code
    path = options.out or _name(options, kind, form)
    write_picture(path, content, form, "graph")
    streams.print_output(f"{path}\n")
    return code


def _format(options: Namespace) -> str:
    """The one that is asked for, else that of the file, else SVG."""
    suffix = os.path.splitext(options.out or "")[1].lower().removeprefix(".")
    form = options.format or suffix or FORMATS[0]
    if form not in FORMATS:
        formats = ", ".join(FORMATS)
        raise Refused(f"{options.out}: {suffix} is none of {formats}; choose one with --format")
    return str(form)


def _name(options: Namespace, kind: str, form: str) -> str:
    stem = os.path.splitext(os.path.basename(options.spec))[0]
    return "-".join(filter(None, (stem, options.place, kind))) + f".{form}"


def _content(diagram: Diagram, form: str) -> bytes:
    text = as_dot(diagram)
    if form == "dot":
        return text.encode()
    if not drawing.is_installed():
        raise Refused(import_module("specc_runtime.extras").lacking("pygraphviz"))
    nodes, arcs = sum(1 for _ in diagram.every_node), len(diagram.arcs)
    if nodes > drawing.MAX_NODES or arcs > drawing.MAX_ARCS or len(text) > drawing.MAX_TEXT:
        size = f"{nodes:,} nodes and {arcs:,} arcs"
        raise Refused(f"a picture with {size} is not legible; {_SMALLER}")
    try:
        return drawing.drawn(text, "png" if form == "png" else "svg")
    except drawing.NotDrawn:
        raise Refused(f"Graphviz could not draw this within its bounds; {_SMALLER}") from None


_SMALLER = "name a part, such as one agent or subsystem, or take the text with --format dot"
