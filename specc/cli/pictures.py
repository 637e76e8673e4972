"""Files of pictures and tables: written aside, and only in place of pictures that specc made.

A table has no mark of who made it, so none is ever replaced.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from struct import pack
from zlib import crc32

from specc import atomic_files
from specc.refusal import Refused, reason_of


def write_picture(path: str, content: bytes, form: str, by: str) -> None:
    """Write what a command made as a file of a format. Raises Refused."""
    made = with_signature(content, form, by)
    try:
        if os.path.lexists(path) and not _may_replace(path, form):
            if _has_content(path, made):
                return
            raise Refused(_foreign_file(path, form))
        atomic_files.write_atomically(Path(path), made)
    except OSError as error:
        raise Refused(f"{path} cannot be written: {reason_of(error)}") from error


def _has_content(path: str, content: bytes) -> bool:
    """Whether that is all that a file has, so that nothing is to be written."""
    if not os.path.isfile(path) or os.path.getsize(path) != len(content):
        return False
    return Path(path).read_bytes() == content


def _foreign_file(path: str, form: str) -> str:
    if form == "csv":
        words = f"{path} is there, and no table says who made it, so it stays"
        return f"{words}; remove it, or name another file with --out"
    words = f"{path} is there, but no {form.upper()} that specc made, so it stays"
    return f"{words}; name another file with --out"


def _may_replace(path: str, form: str) -> bool:
    if not os.path.isfile(path):
        return False
    with open(path, "rb") as file:
        beginning = file.read(LENGTH)
        file.seek(-min(LENGTH, os.fstat(file.fileno()).st_size), os.SEEK_END)
        return is_signed(beginning, file.read(), form)


# What files of pictures say of what made them, so that no others are replaced.


_MARKS = re.compile(rb"specc (graph|plot)")
_STARTS = {"svg": b"<?xml", "png": b"\x89PNG", "dot": b"//", "pdf": b"%PDF"}
LENGTH = 200
"""Bytes at the beginning of a file, or at its end, that have the mark in them."""
_PNG_HEAD = 33
"""Bytes of the signature and of the first chunk."""


def with_signature(content: bytes, form: str, by: str) -> bytes:
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
