"""What a run prints: messages of operators, values and names are strangers' texts.

No character that controls a terminal gets through, and no line that a CI runner would take for a
command.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import unicodedata
from typing import TextIO

# Control characters, and those of formats that reorder or hide text.
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))
_COMMAND = re.compile(r"^([^\S\n]*)::", re.MULTILINE)
_LONGEST = 10_000
_HASHED = re.compile(r"##(?=[a-z]*\[)")


def visible(text: str) -> str:
    """A text on one line, with what cannot be seen written as escapes."""
    return "".join(_shown(char) for char in text)


def harmless(text: str) -> str:
    """A whole output as it may be printed."""
    lines = "\n".join(map(visible, text.split("\n")))
    return _HASHED.sub(r"\\x23#", _COMMAND.sub(r"\1\\x3a:", lines))


def say(message: str) -> None:
    """Print a line on standard error."""
    if len(message) > _LONGEST:
        message = f"{message[:_LONGEST]}..."
    print(harmless(visible(message)), file=sys.stderr, flush=True)


def abandon(*streams: TextIO) -> None:
    """Discard what streams still hold, and what comes: Python flushes them once more at exit."""
    for stream in streams:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _shown(char: str) -> str:
    if (char.isascii() and char.isprintable()) or unicodedata.category(char) not in _HIDDEN:
        return char
    code = ord(char)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{{{code:x}}}"
