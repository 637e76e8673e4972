"""Characters as a terminal shows them: nothing that a file contains may steer the terminal."""

import unicodedata

TAB = "    "
# Format characters reorder or hide text (bidirectional overrides, zero-width ones); the others are
# control characters, surrogates from undecodable file names, private use and unassigned ones.
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))


def visible(text: str, tab: str = TAB) -> str:
    """The text with every character that cannot be seen written as an escape."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_shown(char, tab) for char in text)


def visible_lines(text: str) -> str:
    """Like `visible`, with line breaks kept."""
    return "\n".join(visible(line) for line in text.split("\n"))


def width(text: str) -> int:
    """Terminal columns of a text that is visible already."""
    if text.isascii():
        return len(text)
    return sum(_columns(char) for char in text)


def _shown(char: str, tab: str) -> str:
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
