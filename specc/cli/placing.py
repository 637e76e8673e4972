"""New files that a command writes: all of them or none, and no folder that was made for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from specc.aside import replacing
from specc.cli.interruption import held, terminable

Content = str | Path
"""Of a new file: its text, or the file that it is a copy of."""
Put = Callable[[Mapping[Path, Content]], None]


class Taken(OSError):
    """There is something at a place already; the message names it."""


@contextmanager
def placing() -> Iterator[Put]:
    """A function that writes new files; those that it wrote stay unless anything is raised.

    The first file of each call comes last: where that is, all are. Ctrl-C and SIGTERM wait while
    files are written, and raise KeyboardInterrupt between two calls.

    Raises:
        Taken: a file is there already.
        OSError: the system refuses.
    """
    made: list[Path] = []

    def put(files: Mapping[Path, Content]) -> None:
        refuse_taken(files)
        with held():
            for place in files:
                _make_folders(place.parent, made)
            made.extend(files)
            with ExitStack() as stack:
                # They are renamed in the opposite order, when all are written.
                for place, content in files.items():
                    aside = stack.enter_context(replacing(place))
                    data = content.encode() if isinstance(content, str) else content.read_bytes()
                    aside.write_bytes(data)

    with terminable():
        try:
            yield put
        except BaseException:
            with held():
                _take_away(made)
            raise


def refuse_taken(files: Mapping[Path, Content]) -> None:
    """Raise Taken if any of the files is there."""
    taken = [str(place) for place in files if place.exists() or place.is_symlink()]
    if taken:
        verb = "exists" if len(taken) == 1 else "exist"
        raise Taken(f"{', '.join(taken[:3])} {verb} already")


def reason(error: OSError) -> str:
    """Why files cannot be written, with the place if the system names one."""
    if isinstance(error, Taken):
        return str(error)
    return f"cannot write: {error}"


def _make_folders(folder: Path, made: list[Path]) -> None:
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    for each in reversed(missing):
        each.mkdir()
        made.append(each)


def _take_away(made: list[Path]) -> None:
    """Files and folders, the last first; a folder that somebody else has used meanwhile stays."""
    for place in reversed(made):
        with suppress(OSError):
            place.rmdir() if place.is_dir() else place.unlink(missing_ok=True)
