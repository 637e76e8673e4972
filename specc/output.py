"""Writing the output of a build, all of it or nothing; comparing it without writing.

A directory of output is replaced as a whole, so that no file of an earlier build survives. A
marker file says that specc may do so. Where others may have put files, it lists those of specc.
"""

import os
from collections.abc import Mapping
from pathlib import Path

from specc.atomic_files import REPLACED, sync, temporary_folder
from specc.diagnostics import Diagnostic
from specc.processes import defer_signals
from specc.read import ANYWHERE, AllowedPaths
from specc.refusal import reason_of
from specc.source import Place

MARKER = ".specc-output"
_MARKER_TEXT = "Written by `specc build`, which replaces this directory as a whole.\n"
_LIST_HEAD = "Written by `specc build --ament`, which replaces these files:\n"
_UNCOMPARED = "__pycache__"


OutputFiles = Mapping[str, str | bytes]
"""Contents by paths relative to the directory."""


def stale(directory: Path, files: OutputFiles, *, is_shared: bool = False) -> list[Diagnostic]:
    """A finding for each file that a build would change, add or remove, or one if there is none.

    `is_shared` is as in `write`.
    """
    try:
        if not _present(directory):
            message = "nothing has been built here yet"
            hint = "what is reviewed with the specification is committed"
            hint = f"run `specc build` without --check; {hint}"
            return [_finding("E0092", message, directory, hint)]
        hint = "run `specc build` and commit"
        return [
            _finding("E0092", f"the file is {state}", directory / name, hint)
            for name, state in _differences(directory, _marked(files, is_shared))
        ]
    except OSError as error:
        return [_unwritable(directory, error)]


def write(
    directory: Path,
    files: OutputFiles,
    allowed: AllowedPaths = ANYWHERE,
    *,
    is_shared: bool = False,
) -> list[Diagnostic]:
    """Make `directory` hold exactly `files`; findings say why that was refused.

    Links must not lead out of what is allowed. What was there before stays until everything is
    written, also when the user interrupts. A directory that `is_shared` is not replaced while
    somebody else has files in it.
    """
    try:
        if not allowed.contains(str(directory)):
            return [allowed.link_finding(str(directory))]
        marked = _marked(files, is_shared)
        if foreign := _foreign(directory, is_shared):
            where, message = foreign
            hint = f"name another directory with {'--ament' if is_shared else '--out'}, or move"
            return [_finding("E0091", message, where, f"{hint} what is here out of the way")]
        if _differences(directory, marked):
            _replace(directory.resolve(), marked)
    except OSError as error:
        return [_unwritable(directory, error)]
    return []


def _marked(files: OutputFiles, is_shared: bool) -> dict[str, bytes]:
    """The files as bytes, with the marker."""
    listed = "".join(f"{name}\n" for name in sorted(files))
    marker = f"{_LIST_HEAD}{listed}" if is_shared else _MARKER_TEXT
    contents = {**files, MARKER: marker}
    return {
        name: c.encode(errors="surrogateescape") if isinstance(c, str) else c
        for name, c in contents.items()
    }


def _foreign(directory: Path, is_shared: bool) -> tuple[Path, str] | None:
    """What keeps a directory from being replaced, and why; None if nothing does."""
    message = "specc did not write what is here and will not replace it"
    if not os.path.lexists(directory):
        return None
    if not directory.is_dir():
        return directory, message
    if not (directory / MARKER).is_file():
        return (directory, message) if any(directory.iterdir()) else None
    text = (directory / MARKER).read_text(encoding="utf-8", errors="surrogateescape")
    if text.startswith(_LIST_HEAD) != is_shared:
        kind = "a package of ROS 2" if text.startswith(_LIST_HEAD) else "no package of ROS 2"
        return directory, f"specc wrote what is here as {kind}"
    others = sorted(_present(directory) - {*text.split("\n"), MARKER}) if is_shared else []
    return (directory / others[0], "specc did not write this file") if others else None


def _differences(directory: Path, wanted: Mapping[str, bytes]) -> list[tuple[str, str]]:
    """Names of files that differ, each with how: stale, missing or left over."""
    present = _present(directory)
    differences = [
        (name, "stale" if name in present else "missing")
        for name, content in wanted.items()
        if name not in present or (directory / name).read_bytes() != content
    ]
    return sorted([*differences, *((name, "left over") for name in present - wanted.keys())])


def _present(directory: Path) -> set[str]:
    if not directory.is_dir():
        return set()
    return {
        path.relative_to(directory).as_posix()
        for path in directory.rglob("*")
        if not path.is_dir() and _UNCOMPARED not in path.parts
    }


def _replace(directory: Path, files: Mapping[str, bytes]) -> None:
    directory.parent.mkdir(parents=True, exist_ok=True)
    # A sibling, because a rename is atomic only within a file system.
    with temporary_folder(directory.parent) as aside:
        new, old = aside / "new", aside / REPLACED / directory.name
        for name, content in files.items():
            path = new / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            if directory.exists():
                sync(path)
        with defer_signals():
            try:
                if directory.exists():
                    old.parent.mkdir()
                    directory.rename(old)
                new.rename(directory)
            except BaseException:
                if old.exists() and not directory.exists():
                    old.rename(directory)
                raise


def _finding(code: str, message: str, path: Path, hint: str) -> Diagnostic:
    return Diagnostic(code, message, Place(str(path)), help=hint)


def _unwritable(directory: Path, error: OSError) -> Diagnostic:
    message = f"the output cannot be written: {reason_of(error)}"
    hint = "check the permissions and the space there, or name another directory with --out"
    return _finding("E0090", message, Path(error.filename or directory), hint)
