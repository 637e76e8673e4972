"""Telling people what was found, on standard error."""

import sys

from specc.cli import streams
from specc.diagnostics.report import Report


def tell(found: Report) -> None:
    """Print a report as text, in colour and as wide as the terminal takes it."""
    from specc.diagnostics.render import text

    shown = text.render(found, streams.coloured(sys.stderr), streams.columns(sys.stderr))
    sys.stderr.write(shown)
