"""`specc import`: its arguments, and putting a specification where it was asked for."""

from __future__ import annotations

import argparse
import os
from fractions import Fraction
from typing import Any

End = tuple[str, str]


def add_import(commands: Any) -> None:
    """Add the command to the parser's subcommands."""
    parser = commands.add_parser(
        "import", help="make a specification from state machines of other tools"
    )
    formats = parser.add_subparsers(dest="source", metavar="FORMAT", required=True)
    fabric = formats.add_parser("fabric", help="subsystem definitions of FABRIC")
    fabric.add_argument("files", metavar="FILE.xml", nargs="+")
    fabric.add_argument(
        "--connect",
        metavar="A.b=C.d",
        type=_wire,
        action="append",
        default=[],
        help="buffer b of subsystem A is connected with buffer d of subsystem C",
    )
    scxml = formats.add_parser("scxml", help="a flat state chart")
    scxml.add_argument("files", metavar="FILE.scxml", nargs=1)
    for each in (fabric, scxml):
        each.add_argument("--name", metavar="NAME", default="", help="name of the system")
        each.add_argument("--period", metavar="S", type=_period, help="period in seconds")
        each.add_argument(
            "--out", metavar="FILE.yaml", help="file to write (default: standard output)"
        )
        each.add_argument("--force", action="store_true", help="replace the file of --out")
        each.set_defaults(command="import_")


def run_import(options: argparse.Namespace) -> int:
    """Import, print or write the specification, and report what is not in it."""
    from specc.cli.streams import tell
    from specc.diagnostics.report import report, resolve
    from specc.tools.fmt import formatted
    from specc.tools.importers import import_fabric, import_scxml

    if options.source == "fabric":
        made = import_fabric(
            options.files, name=options.name, period=options.period, wires=options.connect
        )
    else:
        made = import_scxml(options.files[0], name=options.name, period=options.period)
    findings = resolve(made.diagnostics, made.sources)
    code = tell(report(findings, options.files))
    if not made.text:
        return code
    return _put(formatted(made.text), options.out, options.force)


def _put(text: str, out: str | None, force: bool) -> int:
    """Write a specification; one that is there may have been completed by hand, so it stays."""
    from specc.cli import streams
    from specc.cli.rewrite import create, rewrite

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


def _period(text: str) -> Fraction:
    try:
        period = Fraction(text) if len(text) < 20 else Fraction(0)
    except (ValueError, ZeroDivisionError):
        period = Fraction(0)
    if not Fraction(1, 10**7) <= period <= 3600:
        raise argparse.ArgumentTypeError(f"{text!r} is not a period in seconds")
    return period


def _wire(text: str) -> tuple[End, End]:
    first, equals, second = text.partition("=")
    a, b = first.rpartition("."), second.rpartition(".")
    if not (equals and all((*a, *b))):
        raise argparse.ArgumentTypeError(f"{text!r} is not SUBSYSTEM.BUFFER=SUBSYSTEM.BUFFER")
    return (a[0], a[2]), (b[0], b[2])
