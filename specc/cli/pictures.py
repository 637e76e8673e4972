"""Files of pictures and tables: written aside, and only in place of others that specc made."""

from __future__ import annotations

import os
from pathlib import Path

from specc.aside import replacing
from specc.cli.interruption import held
from specc.tools.signature import LENGTH, is_signed, signed


class NotWritten(Exception):
    """A file stays as it is, or cannot be there; the message says why."""


def put(path: str, content: bytes, form: str, by: str) -> None:
    """Write what a command made as a file of a format. Raises NotWritten."""
    try:
        if os.path.lexists(path) and not _may_replace(path, form):
            words = f"{path} is there, but no {form.upper()} that specc made, so it stays"
            raise NotWritten(f"{words}; name another file with --out")
        with held(), replacing(Path(path)) as aside:
            aside.write_bytes(signed(content, form, by))
    except OSError as error:
        why = (error.strerror or "not possible").lower()
        raise NotWritten(f"{path} cannot be written: {why}") from error


def _may_replace(path: str, form: str) -> bool:
    if not os.path.isfile(path):
        return False
    with open(path, "rb") as file:
        beginning = file.read(LENGTH)
        file.seek(-min(LENGTH, os.fstat(file.fileno()).st_size), os.SEEK_END)
        return is_signed(beginning, file.read(), form)
