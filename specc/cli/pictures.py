"""Files of pictures and tables: written aside, and only in place of pictures that specc made.

A table has no mark of who made it, so none is ever replaced.
"""

from __future__ import annotations

import os
from pathlib import Path

from specc.atomic_files import replacing
from specc.cli.interruption import held
from specc.tools.signature import LENGTH, is_signed, signed


class NotWritten(Exception):
    """A file stays as it is, or cannot be there; the message says why."""


def put(path: str, content: bytes, form: str, by: str) -> None:
    """Write what a command made as a file of a format. Raises NotWritten."""
    made = signed(content, form, by)
    try:
        if os.path.lexists(path) and not _may_replace(path, form):
            if _holds(path, made):
                return
            raise NotWritten(_stays(path, form))
        with held(), replacing(Path(path)) as aside:
            aside.write_bytes(made)
    except OSError as error:
        why = (error.strerror or "not possible").lower()
        raise NotWritten(f"{path} cannot be written: {why}") from error


def _holds(path: str, content: bytes) -> bool:
    """Whether that is all that a file has, so that nothing is to be written."""
    if not os.path.isfile(path) or os.path.getsize(path) != len(content):
        return False
    return Path(path).read_bytes() == content


def _stays(path: str, form: str) -> str:
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
