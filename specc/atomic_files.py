"""Files and folders that take the place of others: written aside, synced, then renamed.

Whoever reads finds the old file or the whole new one, also after a power failure: without the sync
a file system may keep the name of the new file before what is in it.

What stands aside is locked by the process that writes it. A process that is killed leaves it
without a lock: the next process that writes into the same folder then removes it, after it has
undone what had begun.
"""

from __future__ import annotations

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

from specc.processes import defer_signals

PREFIX = ".specc-aside-"
"""How the name of everything begins that stands aside."""
REPLACED = "replaced"
"""The folder, in a folder aside, of what gives way; it goes back unless its place was taken."""
_NEW_FILES = "new.json"
_LONGEST_NOTE = 1 << 20


@contextmanager
def replacing_file(path: Path) -> Iterator[Path]:
    """Where to write what is to be at `path`; it gets there at the end, unless anything is raised.

    Signals wait meanwhile.

    Raises:
        OSError: the system refuses; what was there is unchanged.
    """
    with defer_signals():
        aside, lock = _locked(path.parent, is_folder=False)
        try:
            yield aside
            sync(aside)
            aside.replace(path)
        finally:
            aside.unlink(missing_ok=True)
            _unlock(lock)


def write_atomically(path: Path, content: str | bytes) -> None:
    """Put a file there as a whole; what is no character of a text is spelt out. Raises OSError."""
    data = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    try:
        with replacing_file(path) as aside:
            aside.write_bytes(data)
    except OSError as error:
        # Not the name of the new file beside it, which nobody knows.
        raise OSError(error.errno, error.strerror, str(path)) from error


@contextmanager
def temporary_folder(parent: Path | None = None) -> Iterator[Path]:
    """A folder that is removed at the end; without a parent it is among the temporary files.

    Raises OSError.
    """
    with defer_signals():
        aside, lock = _locked(parent or Path(tempfile.gettempdir()), is_folder=True)
    try:
        yield aside
    finally:
        with defer_signals():
            shutil.rmtree(aside, ignore_errors=True)
            _unlock(lock)


def sync(path: Path) -> None:
    """Have the content of a file written to the disk. Raises OSError."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _locked(folder: Path, *, is_folder: bool) -> tuple[Path, int | None]:
    """Make something aside in a folder; where it is, and the handle of its lock."""
    remove_stale(os.path.abspath(folder))
    while True:
        aside = folder / f"{PREFIX}{os.urandom(8).hex()}"
        if is_folder:
            aside.mkdir(0o700)
        else:
            os.close(os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        # Another process may take it for stale before it is locked, or even before it is opened.
        with suppress(FileNotFoundError):
            lock = _lock(aside, waits=True)
            if aside.exists():
                return aside, lock
            _unlock(lock)


def _lock(path: Path, *, waits: bool) -> int | None:
    """A handle that holds the lock; None where there are no locks. Raises OSError if it is held."""
    try:
        import fcntl  # not everywhere
    except ImportError:
        return None
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
    except OSError:
        if waits:  # the file system knows no locks
            return handle
        os.close(handle)
        raise
    return handle


def _unlock(lock: int | None) -> None:
    if lock is not None:
        os.close(lock)


# What a process that was killed has left aside.


@cache
def remove_stale(folder: str) -> None:
    """Remove what stands aside in a folder without a lock, once in a process."""
    try:
        with os.scandir(folder) as entries:
            found = [Path(entry.path) for entry in entries if entry.name.startswith(PREFIX)]
    except OSError:
        return
    for aside in found:
        with suppress(OSError):
            _remove_if_stale(aside)


def _remove_if_stale(aside: Path) -> None:
    # No lock: it may be in use.
    if (lock := _lock(aside, waits=False)) is None:
        return
    try:
        status = os.fstat(lock)
        if status.st_uid != os.geteuid():
            return
        if not stat.S_ISDIR(status.st_mode):
            aside.unlink()
            return
        if (aside / REPLACED).is_dir():
            for replaced in (aside / REPLACED).iterdir():
                if not os.path.lexists(place := aside.parent / replaced.name):
                    replaced.rename(place)
        _undo_new_files(aside)
        shutil.rmtree(aside)
    finally:
        _unlock(lock)


# Several new files: a note in a folder aside says how to take them away again.


def note_new_files(
    aside: Path, last: Path, before: str | None, new: Mapping[Path, str | None]
) -> None:
    """Note the digests of files before they are made in the folder of `aside`, or below it.

    While `last` still has the digest `before`, the next process removes the files that are
    unchanged; otherwise all stay. A folder, and a file that does not exist, have no digest.
    """
    note = {
        "last": [last.name, before],
        "new": [[os.path.relpath(path, aside.parent), content] for path, content in new.items()],
    }
    text = json.dumps(note)
    (aside / "note").write_text(text, encoding="utf-8")
    (aside / "note").replace(aside / _NEW_FILES)


def digest_of(content: bytes) -> str:
    """What a note says of the content of a file."""
    return sha256(content).hexdigest()


def digest_at(path: Path) -> str | None:
    """The digest of a file; None if there is none."""
    is_file = path.is_file() and not path.is_symlink()
    return digest_of(path.read_bytes()) if is_file else None


def _undo_new_files(aside: Path) -> None:
    """Remove new files as the note says, whoever wrote it: only unchanged ones below its folder."""
    base, note = aside.parent.resolve(), aside / _NEW_FILES
    if not note.is_file() or note.stat().st_size > _LONGEST_NOTE:
        return
    try:
        content = json.loads(note.read_bytes())
        last, before = content["last"]
        new = [(base / path, digest) for path, digest in content["new"]]
        if digest_at(base / last) != before:
            return
    except (ValueError, KeyError, TypeError, RecursionError):
        return
    for path, digest in reversed(new):
        if not path.parent.resolve().is_relative_to(base):
            continue
        with suppress(OSError):
            if digest is None:
                path.rmdir()
            elif digest_at(path) == digest:
                path.unlink()
