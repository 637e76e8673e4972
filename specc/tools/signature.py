"""What files of pictures say of what made them, so that no others are replaced."""

from __future__ import annotations

import re
from struct import pack
from zlib import crc32

_MARKS = re.compile(rb"specc (graph|plot)")
_STARTS = {"svg": b"<?xml", "png": b"\x89PNG", "dot": b"//", "pdf": b"%PDF"}
LENGTH = 200
"""Bytes at the beginning of a file, or at its end, that have the mark in them."""
_PNG_HEAD = 33
"""Bytes of the signature and of the first chunk."""


def signed(content: bytes, form: str, by: str) -> bytes:
    """A picture with the mark of a command; a table has no place for one."""
    mark = f"specc {by}".encode()
    match form:
        case "svg":
            declaration, end, rest = content.partition(b"\n")
            return declaration + end + b"<!-- " + mark + b" -->\n" + rest
        case "png":
            text = b"tEXtSoftware\0" + mark
            chunk = pack(">I", len(text) - 4) + text + pack(">I", crc32(text))
            return content[:_PNG_HEAD] + chunk + content[_PNG_HEAD:]
        case "dot":
            return b"// " + mark + b"\n" + content
        case "pdf":  # where its parts are, counted from the beginning, stands in it
            return content + b"% " + mark + b"\n"
    return content


def is_signed(beginning: bytes, end: bytes, form: str) -> bool:
    """Whether a file of this format begins and ends as a signed one does; never a table."""
    if form not in _STARTS:
        return False
    place = end[-LENGTH:] if form == "pdf" else beginning[:LENGTH]
    return beginning.startswith(_STARTS[form]) and _MARKS.search(place) is not None
