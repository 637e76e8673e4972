"""What files of pictures say of what made them, so that no others are replaced."""

from __future__ import annotations

from struct import pack
from zlib import crc32

_MARK = b"specc graph"
_STARTS = {"svg": b"<?xml", "png": b"\x89PNG", "dot": b"//"}
LENGTH = 200
"""Bytes at the beginning of a file that have the mark in them."""
_PNG_HEAD = 33
"""Bytes of the signature and of the first chunk."""


def signed(content: bytes, form: str) -> bytes:
    """A picture with the mark near its beginning."""
    match form:
        case "svg":
            declaration, end, rest = content.partition(b"\n")
            return declaration + end + b"<!-- " + _MARK + b" -->\n" + rest
        case "png":
            text = b"tEXtSoftware\0" + _MARK
            chunk = pack(">I", len(text) - 4) + text + pack(">I", crc32(text))
            return content[:_PNG_HEAD] + chunk + content[_PNG_HEAD:]
    return b"// " + _MARK + b"\n" + content


def is_signed(beginning: bytes, form: str) -> bool:
    """Whether a file of this format begins as a signed picture does."""
    return beginning.startswith(_STARTS[form]) and _MARK in beginning[:LENGTH]
