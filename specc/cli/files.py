"""Files that commands write: whole or not at all, and never in place of what somebody else made."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from struct import pack
from zlib import crc32

from specc.atomic_files import (
    digest_at,
    digest_of,
    note_new_files,
    replacing_file,
    temporary_folder,
    write_atomically,
)
from specc.policy import allowed_paths
from specc.processes import defer_signals
from specc.refusal import Refused, reason_of


def write_output(
    path: str, content: bytes, form: str, *, by: str = "", force: bool = False
) -> None:
    """Write what a command made; an existing file is replaced by `force` or if it is a picture of
    this format that specc made. Raises Refused.
    """
    content = with_signature(content, form, by) if by else content
    if not os.path.basename(path):
        raise Refused(f"--out `{path}` names no file")
    try:
        if not os.path.lexists(path):
            write_atomically(Path(path), content)
        elif force or _is_own(path, form):
            rewrite_file(path, content)
        elif not (os.path.isfile(path) and Path(path).read_bytes() == content):
            kind = f", but no {form.upper()} that specc made" if form in _STARTS else " already"
            raise Refused(f"{path} is there{kind}; `--force` replaces it")
    except OSError as error:
        raise Refused(f"{path} cannot be written: {reason_of(error)}") from error


def rewrite_file(path: str, content: bytes) -> None:
    """Replace the content of a file that exists; links, owner and permissions stay.

    Raises:
        OSError: the system refuses, nobody may write the file, or a link leads out of the project;
            the file is unchanged.
    """
    if not allowed_paths(path).contains(path):
        raise OSError(errno.EPERM, "a link leads out of the project", path)
    try:
        target = Path(os.path.realpath(path))
        status = target.stat()
        if not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        with replacing_file(target) as aside:
            aside.write_bytes(content)
            shutil.copymode(target, aside)
            with suppress(OSError):
                os.chown(aside, status.st_uid, status.st_gid)
    except OSError as error:
        # Not the name of the new file beside it, which nobody knows.
        raise OSError(error.errno, error.strerror, path) from error


# Pictures say that specc made them, so that no others are replaced.


_MARKS = re.compile(rb"specc (graph|plot)")
_STARTS = {"svg": b"<?xml", "png": b"\x89PNG", "dot": b"//", "pdf": b"%PDF"}
_LENGTH = 200
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


def _is_own(path: str, form: str) -> bool:
    """Whether a file is a picture of this format with the mark of a command."""
    if form not in _STARTS or not os.path.isfile(path):
        return False
    with open(path, "rb") as file:
        start = file.read(_LENGTH)
        if form == "pdf":
            file.seek(-min(_LENGTH, os.fstat(file.fileno()).st_size), os.SEEK_END)
        marked = file.read(_LENGTH) if form == "pdf" else start
    return start.startswith(_STARTS[form]) and _MARKS.search(marked) is not None


# Several new files: all of them or none, and no folder that was made for them.


Content = str | Path
"""Of a new file: its text, or the file that it is a copy of."""
Files = Mapping[Path, Content]


class AlreadyExists(OSError):
    """There is something at a place already; the message names it."""


class NewFiles:
    """New files that may be removed again. Signals wait during each call."""

    def __init__(self, created: dict[Path, str | None], note: Callable[[], None]) -> None:
        """`created` gets the digest of each file, None for a folder; then they are to be noted."""
        self._created = created
        self._note = note

    def write(self, files: Files) -> None:
        """Write new files; the first one comes last: where that is, all are.

        A file that is there with the same bytes stays as it is, whatever comes.

        Raises:
            AlreadyExists: a file is there already, with other bytes.
            OSError: the system refuses.
        """
        refuse_existing(files)
        data = {p: _bytes(content) for p, content in files.items() if not p.exists()}
        with defer_signals():
            for place in data:
                _make_folders(place.parent, self._created)
            self._created.update({place: digest_of(content) for place, content in data.items()})
            self._note()
            with ExitStack() as stack:
                # They are renamed in the opposite order, when all are written.
                for place, content in data.items():
                    stack.enter_context(replacing_file(place)).write_bytes(content)

    def commit(self, last_step: Callable[[], None]) -> None:
        """Do the last step, which needs the files: unless it raises, they stay whatever comes."""
        with defer_signals():
            last_step()
            self._created.clear()


@contextmanager
def creating(last: Path) -> Iterator[NewFiles]:
    """New files, which are removed if anything is raised.

    If the process is killed, the next one removes them unless `last` is written by then.
    """
    created: dict[Path, str | None] = {}
    try:
        with defer_signals():
            _make_folders(last.parent, created)
        before = digest_at(last)
        with temporary_folder(last.parent) as aside:
            try:
                yield NewFiles(created, lambda: note_new_files(aside, last, before, created))
            except BaseException:
                _remove(created)  # while there is a note of them
                raise
    except BaseException:
        _remove(created)
        raise


def refuse_existing(files: Files) -> None:
    """Raise AlreadyExists if a file is there with other bytes, or something else is there."""
    existing = [str(place) for place, content in files.items() if _is_occupied(place, content)]
    if existing:
        verb = "exists" if len(existing) == 1 else "exist"
        raise AlreadyExists(f"{', '.join(existing[:3])} {verb} already")


def _is_occupied(place: Path, content: Content) -> bool:
    if place.is_symlink() or not place.is_file():
        return place.is_symlink() or place.exists()
    data = _bytes(content)
    return place.stat().st_size != len(data) or place.read_bytes() != data


def _bytes(content: Content) -> bytes:
    return content.encode() if isinstance(content, str) else content.read_bytes()


def _make_folders(folder: Path, created: dict[Path, str | None]) -> None:
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    for each in reversed(missing):
        each.mkdir()
        created[each] = None


def _remove(created: Mapping[Path, str | None]) -> None:
    """Remove files and folders, the last first; a folder that others use by now stays."""
    with defer_signals():
        for place in reversed([*created]):
            with suppress(OSError):
                place.rmdir() if place.is_dir() else place.unlink(missing_ok=True)
