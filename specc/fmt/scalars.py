"""How a scalar is written: plain where it can be, in quotes where it must be."""

from __future__ import annotations

from specc.fmt.tree import Scalar
from specc.read.scalars import NumberRangeError, is_null, plain_value

_FIRST = frozenset("-?:,[]{}#&*!|>'\"%@`")
# The C parser refuses a question mark before a closing bracket.
_FLOW = frozenset(",[]{}?")
_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def key_text(key: Scalar, flow: bool) -> str:
    """A key; any plain text is one, except those that YAML takes for null or merging."""
    if not key.style and key.raw == key.text and not (flow and "?" in key.raw):
        return key.raw
    plain = _is_plain(key.text, flow) and not is_null(key.text) and key.text != "<<"
    return key.text if plain else quoted(key.text)


def value_text(scalar: Scalar, flow: bool) -> str:
    """A value on one line."""
    if not scalar.style:
        if is_null(scalar.text):
            return "null" if flow or scalar.text else ""
        if scalar.raw == scalar.text and not (flow and "?" in scalar.raw):
            return scalar.raw
    text = scalar.text
    return text if _is_plain(text, flow) and _means_itself(text) else quoted(text)


def quoted(text: str) -> str:
    """In double quotes; in single ones if that spares escapes."""
    if ('"' in text or "\\" in text) and text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return '"' + "".join(_escaped(char) for char in text) + '"'


def _escaped(char: str) -> str:
    if char in _ESCAPES:
        return _ESCAPES[char]
    if char.isprintable():
        return char
    code = ord(char)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _is_plain(text: str, flow: bool) -> bool:
    """Whether a text needs no quotes.

    A colon gets them everywhere: in braces older parsers refuse it, and people misread it.
    """
    if not text or text != text.strip() or not text.isprintable() or text[0] in _FIRST:
        return False
    if ":" in text or " #" in text or text.startswith("..."):
        return False
    return not (flow and _FLOW.intersection(text))


def _means_itself(text: str) -> bool:
    try:
        return plain_value(text) == text
    except NumberRangeError:
        return False
