"""Files that take the place of others: written aside, synced, then renamed.

Whoever reads finds the old file or the whole new one, also after a power failure: without the sync
a file system may keep the name of the new file before what is in it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Where to write what is to be at `path`; it gets there at the end, unless anything is raised.

    Raises:
        OSError: the system refuses; what was there is unchanged.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield aside
        sync(aside)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def put(path: Path, content: str | bytes) -> None:
    """Put a file there as a whole; what is no character of a text is spelt out. Raises OSError."""
    data = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    with replacing(path) as aside:
        aside.write_bytes(data)


def sync(path: Path) -> None:
    """Have the content of a file written to the disk. Raises OSError."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
