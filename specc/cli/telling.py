"""Telling people what was found, on standard error, and the exit code that it stands for."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from specc.cli import streams
from specc.diagnostics.report import Report
from specc.source import COMMAND_LINE

if TYPE_CHECKING:
    from specc.diagnostics import Diagnostic

# Open, but possibly a slip: a reference to what is not there.
_DANGLING = frozenset(("O0205",))
# Not faults of a specification: a file that gives no text or takes none.
_UNREADABLE = frozenset(("E0001", "E0002", "E0003", "E0004", "E0005", "E0090", "E0091"))


def exit_code(found: Report) -> int:
    """What a report stands for: 0 clean, 1 errors, 2 wrong usage or an unreadable file."""
    if any(_is_usage(finding.diagnostic) for finding in found.findings):
        return 2
    dangling = any(finding.diagnostic.code in _DANGLING for finding in found.findings)
    return 1 if dangling or found.count("error") else 0


def _is_usage(found: Diagnostic) -> bool:
    said = found.primary.file == COMMAND_LINE and found.severity != "warning"
    return said or found.code in _UNREADABLE


def tell(found: Report) -> int:
    """Print a report as text, in colour and as wide as the terminal takes it; its exit code."""
    from specc.diagnostics.render import text

    colour = streams.coloured(sys.stderr)
    shown = text.render(found, colour, streams.columns(sys.stderr))
    if colour:
        sys.stderr.write(shown)  # its parts are harmless; nobody but a person reads a terminal
    else:
        streams.show(shown, to=sys.stderr)
    return exit_code(found)
