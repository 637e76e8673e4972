"""Telling people what was found, on standard error."""

import sys

from specc.cli import streams
from specc.diagnostics.report import Report


def tell(found: Report) -> None:
    """Print a report as text, in colour and as wide as the terminal takes it."""
    from specc.diagnostics.render import text

    colour = streams.coloured(sys.stderr)
    shown = text.render(found, colour, streams.columns(sys.stderr))
    if colour:
        sys.stderr.write(shown)  # its parts are harmless; nobody but a person reads a terminal
    else:
        streams.show(shown, to=sys.stderr)
