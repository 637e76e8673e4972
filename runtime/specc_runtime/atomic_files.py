"""Files that take the place of others: written aside, synced, then renamed.

Whoever reads finds the old file or the whole new one, also after a power failure: without the sync
a file system may keep the name of the new file before what is in it.

What stands aside is locked by the process that writes it. A process that is killed leaves it
without a lock: the next process that writes into the same folder then removes it.
"""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

PREFIX = ".specc-aside-"
"""How the name of everything begins that stands aside, as in the compiler."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Where to write what is to be at `path`; it gets there at the end, unless anything is raised.

    Raises OSError when the system refuses; what was there is then unchanged.
    """
    aside, lock = _locked(path.parent)
    try:
        yield aside
        sync(aside)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
        os.close(lock)


def sync(path: Path) -> None:
    """Have the content of a file written to the disk. Raises OSError."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _locked(folder: Path) -> tuple[Path, int]:
    """Make an empty file aside in a folder; where it is, and the handle of its lock."""
    remove_stale(os.path.abspath(folder))
    while True:
        aside = folder / f"{PREFIX}{os.urandom(8).hex()}"
        lock = os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        with suppress(OSError):  # the file system knows no locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        # Another process may have taken it for stale before it was locked.
        if aside.exists():
            return aside, lock
        os.close(lock)


@cache
def remove_stale(folder: str) -> None:
    """Remove files that stand aside in a folder without a lock, once in a process."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(PREFIX) and entry.is_file(follow_symlinks=False):
                with suppress(OSError):
                    _remove_if_stale(entry.path)


def _remove_if_stale(aside: str) -> None:
    lock = os.open(aside, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        status = os.fstat(lock)
        if stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid():
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.unlink(aside)
    finally:
        os.close(lock)
