"""Writing the output of a build, all of it or nothing; comparing it without writing.

A directory of output is replaced as a whole, so that no file of an earlier build survives. A
marker file says that specc may do so.
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
_UNCOMPARED = "__pycache__"


def stale(directory: Path, files: Mapping[str, str]) -> list[Diagnostic]:
    """A finding for each file that a build would change, add or remove, or one if there is none.

    `files` maps paths relative to `directory` to their text.
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
            for name, state in _differences(directory, files)
        ]
    except OSError as error:
        return [_unwritable(directory, error)]


def write(
    directory: Path, files: Mapping[str, str], allowed: AllowedPaths = ANYWHERE
) -> list[Diagnostic]:
    """Make `directory` hold exactly `files`; findings say why that was refused.

    Links must not lead out of what is allowed. What was there before stays until everything is
    written, also when the user interrupts.
    """
    try:
        if not allowed.contains(str(directory)):
            return [allowed.link_finding(str(directory))]
        is_own = directory.is_dir() and (
            (directory / MARKER).is_file() or not any(directory.iterdir())
        )
        if os.path.lexists(directory) and not is_own:
            message = "specc did not write what is here and will not replace it"
            hint = "name another directory with --out, or move what is here out of the way"
            return [_finding("E0091", message, directory, hint)]
        if _differences(directory, files):
            _replace(directory.resolve(), {**files, MARKER: _MARKER_TEXT})
    except OSError as error:
        return [_unwritable(directory, error)]
    return []


def _differences(directory: Path, files: Mapping[str, str]) -> list[tuple[str, str]]:
    """Names of files that differ, each with how: stale, missing or left over."""
    wanted = {**files, MARKER: _MARKER_TEXT}
    present = _present(directory)
    differences = [
        (name, "stale" if name in present else "missing")
        for name, text in wanted.items()
        if name not in present or (directory / name).read_bytes() != text.encode()
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


def _replace(directory: Path, files: Mapping[str, str]) -> None:
    directory.parent.mkdir(parents=True, exist_ok=True)
    # A sibling, because a rename is atomic only within a file system.
    with temporary_folder(directory.parent) as aside:
        new, old = aside / "new", aside / REPLACED / directory.name
        for name, text in files.items():
            path = new / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text.encode())
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
