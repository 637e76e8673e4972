"""`specc lib`: the parts that come with specc, and what whoever uses them gives and gets."""

from __future__ import annotations

import textwrap
from argparse import Namespace

from specc.cli import streams
from specc.diagnostics import nearest
from specc.refusal import Refused
from specc.resources import LIBRARY, library_parts
from specc.tools.parts import as_text, summary_of

_WIDTH = 100


def lib(options: Namespace) -> int:
    """Print the parts of the library, all of them or those that are named."""
    names = [_known(name) for name in options.parts] or library_parts()
    found = [part for part in map(summary_of, names) if part]
    for number, part in enumerate(found):
        head, _, rows = as_text(part).partition("\n")
        about = textwrap.fill(part.about, _WIDTH, initial_indent="  ", subsequent_indent="  ")
        streams.print_output("\n" * (number > 0) + "\n".join(filter(None, (head, about, rows))))
    return 0


def _known(name: str) -> str:
    """The whole name of a part; raises Refused if there is none."""
    whole = name if name.startswith(LIBRARY) else f"{LIBRARY}{name}"
    if whole not in library_parts():
        parts = {part.removeprefix(LIBRARY): part for part in library_parts()}
        close = " or ".join(parts[name] for name in nearest(whole.removeprefix(LIBRARY), parts))
        hint = f"did you mean {close}?" if close else "`specc lib` lists all parts"
        raise Refused(f"the library has no part {name!r}; {hint}")
    return whole
