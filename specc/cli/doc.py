"""`specc doc`: the document of a specification, as HTML and PDF."""

from __future__ import annotations

import os
from argparse import Namespace
from pathlib import Path

from specc.atomic_files import write_atomically
from specc.cli import streams
from specc.cli.files import rewrite_file
from specc.refusal import Refused, reason_of

_MOST_BYTES = 2_000_000
"""Of a file with departures."""


def doc(options: Namespace) -> int:
    """Write the document; 1 if the specification has errors, of what is known all the same."""
    from specc import pipeline
    from specc.tools.doc import document_files
    from specc.tools.doc.departures import departures_in

    result, code = pipeline.compile_spec(options.spec), 0
    wrong = sum(each.severity == "error" for each in result.diagnostics)
    if result.system is None or wrong:
        code = streams.print_findings(result, options.spec) or 1
    if result.system is None or code == streams.USAGE_ERROR or (code and not result.system.agents):
        return code
    name = result.system.name or Path(options.spec).stem
    folder = options.out or f"{name}-doc"
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise Refused(f"{folder} is no folder; name another one with --out")
    departures = departures_in(_text_of(options.departures)) if options.departures else []
    found = document_files(
        result.system, result.proofs, result.sources, options.spec, departures, wrong
    )
    for suffix, content in (("html", found.html), ("pdf", found.pdf)):
        path = os.path.join(folder, f"{name}.{suffix}")
        _write(path, content)
        streams.print_message(f"wrote {path}")
    return code


def _text_of(path: str) -> str:
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read(_MOST_BYTES)
    except OSError as error:
        raise Refused(f"{path} cannot be read: {reason_of(error)}") from error


def _write(path: str, content: bytes) -> None:
    try:
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
        if os.path.lexists(path):
            rewrite_file(path, content)
        else:
            write_atomically(Path(path), content)
    except OSError as error:
        raise Refused(f"{path} cannot be written: {reason_of(error)}") from error
