"""New files that a command writes: all of them or none, and no folder that was made for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from specc.atomic_files import replacing
from specc.cli.interruption import held, terminable

Content = str | Path
"""Of a new file: its text, or the file that it is a copy of."""
Files = Mapping[Path, Content]


class Taken(OSError):
    """There is something at a place already; the message names it."""


class Placing:
    """New files that may be taken away again. Ctrl-C and SIGTERM wait during each call."""

    def __init__(self) -> None:
        self._made: list[Path] = []

    def put(self, files: Files) -> None:
        """Write new files; the first one comes last: where that is, all are.

        A file that is there with the same bytes stays as it is, whatever comes.

        Raises:
            Taken: a file is there already, with other bytes.
            OSError: the system refuses.
        """
        refuse_taken(files)
        files = {place: content for place, content in files.items() if not place.exists()}
        with held():
            for place in files:
                _make_folders(place.parent, self._made)
            self._made.extend(files)
            with ExitStack() as stack:
                # They are renamed in the opposite order, when all are written.
                for place, content in files.items():
                    aside = stack.enter_context(replacing(place))
                    aside.write_bytes(_bytes(content))

    def keep(self, then: Callable[[], None]) -> None:
        """Do the last step, which needs the files: unless it raises, they stay whatever comes."""
        with held():
            then()
            self._made.clear()

    def take_away(self) -> None:
        """Remove files and folders, the last first; a folder that others use by now stays."""
        with held():
            for place in reversed(self._made):
                with suppress(OSError):
                    place.rmdir() if place.is_dir() else place.unlink(missing_ok=True)


@contextmanager
def placing() -> Iterator[Placing]:
    """New files, which are taken away if anything is raised, KeyboardInterrupt of SIGTERM too."""
    new = Placing()
    with terminable():
        try:
            yield new
        except BaseException:
            new.take_away()
            raise


def refuse_taken(files: Files) -> None:
    """Raise Taken if any of the files is there with other bytes, or something else is there."""
    taken = [str(place) for place, content in files.items() if _is_taken(place, content)]
    if taken:
        verb = "exists" if len(taken) == 1 else "exist"
        raise Taken(f"{', '.join(taken[:3])} {verb} already")


def _is_taken(place: Path, content: Content) -> bool:
    if place.is_symlink() or not place.is_file():
        return place.is_symlink() or place.exists()
    data = _bytes(content)
    return place.stat().st_size != len(data) or place.read_bytes() != data


def _bytes(content: Content) -> bytes:
    return content.encode() if isinstance(content, str) else content.read_bytes()


def reason(error: OSError) -> str:
    """Why nothing is written, with the place if the system names one."""
    why = str(error) if isinstance(error, Taken) else f"cannot write: {error}"
    return f"{why}; nothing was written"


def _make_folders(folder: Path, made: list[Path]) -> None:
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    for each in reversed(missing):
        each.mkdir()
        made.append(each)
