"""New files that a command writes: all of them or none, and no folder that was made for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from specc.atomic_files import (
    digest_at,
    digest_of,
    note_new_files,
    replacing_file,
    temporary_folder,
)
from specc.signals import defer_signals

Content = str | Path
"""Of a new file: its text, or the file that it is a copy of."""
Files = Mapping[Path, Content]


class AlreadyExists(OSError):
    """There is something at a place already; the message names it."""


class NewFiles:
    """New files that may be taken away again. Signals wait during each call."""

    def __init__(self, made: dict[Path, str | None], note: Callable[[], None]) -> None:
        """`made` gets the digest of each file, None for a folder; then they are to be noted."""
        self._made = made
        self._note = note

    def write(self, files: Files) -> None:
        """Write new files; the first one comes last: where that is, all are.

        A file that is there with the same bytes stays as it is, whatever comes.

        Raises:
            Taken: a file is there already, with other bytes.
            OSError: the system refuses.
        """
        refuse_existing(files)
        data = {p: _bytes(content) for p, content in files.items() if not p.exists()}
        with defer_signals():
            for place in data:
                _make_folders(place.parent, self._made)
            self._made.update({place: digest_of(content) for place, content in data.items()})
            self._note()
            with ExitStack() as stack:
                # They are renamed in the opposite order, when all are written.
                for place, content in data.items():
                    stack.enter_context(replacing_file(place)).write_bytes(content)

    def commit(self, then: Callable[[], None]) -> None:
        """Do the last step, which needs the files: unless it raises, they stay whatever comes."""
        with defer_signals():
            then()
            self._made.clear()


@contextmanager
def creating(last: Path) -> Iterator[NewFiles]:
    """New files, which are taken away if anything is raised.

    If the process is killed, the next one takes them away unless `last` is written by then.
    """
    made: dict[Path, str | None] = {}
    try:
        with defer_signals():
            _make_folders(last.parent, made)
        before = digest_at(last)
        with temporary_folder(last.parent) as aside:
            try:
                yield NewFiles(made, lambda: note_new_files(aside, last, before, made))
            except BaseException:
                _remove(made)  # while there is a note of them
                raise
    except BaseException:
        _remove(made)
        raise


def refuse_existing(files: Files) -> None:
    """Raise Taken if any of the files is there with other bytes, or something else is there."""
    taken = [str(place) for place, content in files.items() if _is_occupied(place, content)]
    if taken:
        verb = "exists" if len(taken) == 1 else "exist"
        raise AlreadyExists(f"{', '.join(taken[:3])} {verb} already")


def _is_occupied(place: Path, content: Content) -> bool:
    if place.is_symlink() or not place.is_file():
        return place.is_symlink() or place.exists()
    data = _bytes(content)
    return place.stat().st_size != len(data) or place.read_bytes() != data


def _bytes(content: Content) -> bytes:
    return content.encode() if isinstance(content, str) else content.read_bytes()


def write_failure(error: OSError) -> str:
    """Why nothing is written, with the place if the system names one."""
    why = str(error) if isinstance(error, AlreadyExists) else f"cannot write: {error}"
    return f"{why}; nothing was written"


def _make_folders(folder: Path, made: dict[Path, str | None]) -> None:
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    for each in reversed(missing):
        each.mkdir()
        made[each] = None


def _remove(made: Mapping[Path, str | None]) -> None:
    """Remove files and folders, the last first; a folder that others use by now stays."""
    with defer_signals():
        for place in reversed([*made]):
            with suppress(OSError):
                place.rmdir() if place.is_dir() else place.unlink(missing_ok=True)
