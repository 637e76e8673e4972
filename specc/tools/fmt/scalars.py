"""Scalars and rows of tables as text."""

from __future__ import annotations

import re

from specc.read.compose import NumberRangeError, is_null, plain_value
from specc.tools.fmt.tree import Scalar

# How a scalar is written: plain where it can be, in quotes where it must be.


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


# Rows of a table below each other: cells padded to the widths of their columns.


_GAP = re.compile(r"\s{2,}")


def header_cells(comment: str, columns: int) -> list[str] | None:
    """The words over the columns, if a comment has as many of them, two blanks apart."""
    cells = _GAP.split(comment.removeprefix("#").strip())
    return cells if len(cells) == columns else None


def widths(rows: list[list[str]], header: list[str] | None) -> list[int]:
    """Width of every column with its comma and the blanks behind it."""
    found = [max(len(cell) + 2 for cell in column) for column in zip(*rows, strict=True)]
    if header:
        found = [max(width, len(cell) + 2) for width, cell in zip(found, header, strict=True)]
    return found


def row(cells: list[str], columns: list[int]) -> str:
    """A row in brackets."""
    padded = [f"{cell}, ".ljust(width) for cell, width in zip(cells, columns, strict=True)]
    return f"[{''.join(padded[:-1])}{cells[-1]}]"


def header_line(cells: list[str], columns: list[int]) -> str:
    """The comment over a table; its words stand over the cells of `- [a, b]`."""
    padded = [cell.ljust(width) for cell, width in zip(cells, columns, strict=True)]
    return f"#  {''.join(padded).rstrip()}"
