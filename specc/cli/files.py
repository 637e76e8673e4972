"""Files that commands write: whole or not at all, and never in place of what somebody else made."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

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
    path: str,
    content: bytes,
    form: str,
    inputs: Iterable[str] = (),
    *,
    by: str = "",
    force: bool = False,
) -> None:
    """Write what a command made of its `inputs`, which it never replaces.

    Another ordinary file is replaced by `force`, or if it is a picture of this format that specc
    made. Raises Refused.
    """
    from specc.tools.graph.formats import SIGNATURES, mark_of  # most commands write no pictures

    signature = SIGNATURES.get(form)
    if signature is not None and by:
        content = signature.sign(content, mark_of(by))
    if not os.path.basename(path):
        raise Refused(f"--out `{path}` names no file")
    if os.path.lexists(path) and not os.path.isfile(path):
        raise Refused(f"{path} is there and no ordinary file; name another one with --out")
    if os.path.realpath(path) in map(os.path.realpath, inputs):
        raise Refused(f"{path} is an input of this command; name another file with --out")
    try:
        if not os.path.lexists(path):
            write_atomically(Path(path), content)
        elif force or (signature is not None and signature.is_own(path)):
            rewrite_file(path, content)
        elif Path(path).read_bytes() != content:
            kind = f", but no {form.upper()} that specc made" if signature else " already"
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
