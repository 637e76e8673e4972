"""`specc import`: putting a specification where it was asked for."""

from __future__ import annotations

import os
from argparse import Namespace

from specc.cli import streams
from specc.cli.rewrite import create, rewrite
from specc.diagnostics.report import report, resolve
from specc.tools.fmt import formatted
from specc.tools.importers import import_fabric, import_scxml


def run_import(options: Namespace) -> int:
    """Import, print or write the specification, and report what is not in it."""
    if options.source == "fabric":
        made = import_fabric(
            options.files, name=options.name, period=options.period, wires=options.connect
        )
    else:
        made = import_scxml(options.files[0], name=options.name, period=options.period)
    findings = resolve(made.diagnostics, made.sources)
    code = streams.tell(report(findings, options.files))
    if not made.text:
        return code
    if options.out and os.path.realpath(options.out) in map(os.path.realpath, options.files):
        streams.say(f"specc: {options.out} is what is imported; name another file with --out")
        return 2
    return _put(formatted(made.text), options.out, options.force)


def _put(text: str, out: str | None, force: bool) -> int:
    """Write a specification; one that is there may have been completed by hand, so it stays."""
    if out is None:
        streams.show(text)
        return 0
    try:
        if force and os.path.exists(out):
            rewrite(out, text)
        else:
            create(out, text)
    except FileExistsError:
        streams.say(f"specc: {out} is there already; `--force` replaces it")
        return 2
    except OSError as error:
        why = (error.strerror or "").lower()
        streams.say(f"specc: {out} cannot be written: {why}")
        return 2
    return 0
