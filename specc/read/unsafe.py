"""Characters that a specification may not contain, found before a parser sees them."""

import re
import unicodedata

from specc.diagnostics import Diagnostic
from specc.source import Place

# What YAML 1.2 forbids (5.1), and the line breaks of YAML 1.1 that editors do not show as lines.
_FORBIDDEN = re.compile(
    "[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)


def forbidden_characters(path: str, text: str) -> tuple[Diagnostic, ...]:
    """One finding, at the first forbidden character, or none."""
    found = _FORBIDDEN.search(text)
    if found is None:
        return ()
    char = found.group()
    name = "NUL" if char == "\0" else unicodedata.name(char, "a control character")
    return (
        Diagnostic(
            "E0006",
            f"the file contains U+{ord(char):04X} ({name})",
            Place(path, (), "text", found.start(), found.end()),
            help=f'delete it, or write "\\U{ord(char):08X}" inside double quotes',
        ),
    )
