"""Characters as a terminal shows them: nothing that a file contains may steer the terminal."""

import re
import unicodedata
from typing import Literal

OutputFormat = Literal["text", "markdown", "json", "sarif", "github", "junit"]
"""A format of output; `github` has workflow commands that specc gives itself."""

TAB = "    "
# Format characters reorder or hide text (bidirectional overrides, zero-width ones); the others are
# control characters, surrogates from undecodable file names, private use and unassigned ones.
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))


def visible(text: str, tab: str = TAB) -> str:
    """The text with every character that cannot be seen written as an escape."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_escaped(char, tab) for char in text)


def visible_lines(text: str) -> str:
    """Like `visible`, with line breaks kept."""
    return "\n".join(visible(line) for line in text.split("\n"))


def sanitize(text: str, form: OutputFormat = "text") -> str:
    """A whole output as it may be printed: no character is hidden, no line is a command.

    Runners of continuous integration obey lines that begin with `::`, and `##[` or `##word[`
    anywhere in a line. JSON from `json.dumps` is ASCII already, but for what it spells out in
    strings.
    """
    colon, hash_ = _ESCAPES[form]
    if form not in ("json", "sarif"):
        text = visible_lines(text)
    if form != "github":
        text = _COMMAND.sub(rf"\1{colon}:", text)
    return _HASHED.sub(lambda _: f"{hash_}#", text)


def width(text: str) -> int:
    """Terminal columns of a text that is visible already."""
    return len(text) if text.isascii() else sum(map(_columns, text))


# `::: ` before a second place is no command: these have a name right behind the two colons.
_COMMAND = re.compile(r"^([^\S\n]*)::(?!: )", re.MULTILINE)
_HASHED = re.compile(r"##(?=[a-z]*\[)")
_ESCAPES: dict[OutputFormat, tuple[str, str]] = {
    "text": (r"\\x3a", r"\x23"),
    "markdown": ("&#58;", "&#35;"),
    "json": (":", r"\u0023"),
    "sarif": (":", r"\u0023"),
    "github": (":", "%23"),
    "junit": ("&#58;", "&#35;"),
}
"""How each format writes the first colon and the first hash of what runners would obey."""


def _escaped(char: str, tab: str) -> str:
    if char == "\t":
        return tab
    if unicodedata.category(char) not in _HIDDEN:
        return char
    code = ord(char)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{{{code:x}}}"


def _columns(char: str) -> int:
    if unicodedata.category(char) in ("Mn", "Me"):
        return 0
    return 2 if unicodedata.east_asian_width(char) in ("W", "F") else 1
