"""Writing a file: whole or not at all."""

import contextlib
import errno
import os
import shutil
import tempfile
from pathlib import Path

from specc.cli.interruption import held
from specc.diagnostics import Diagnostic
from specc.policy import reach_of
from specc.source import Place


def rewrite(path: str, text: str) -> None:
    """Make `text` the content of a file that exists; links, owner and permissions stay.

    Raises:
        OSError: the system refuses, nobody may write the file, or a link leads out of the project;
            it is as it was.
    """
    if not reach_of(path).holds(path):
        raise OSError(errno.EPERM, "a link leads out of the project", path)
    try:
        with held():
            _rewrite(Path(os.path.realpath(path)), text.encode())
    except OSError as error:
        # Not the name of the new file beside it, which nobody knows.
        raise OSError(error.errno, error.strerror, path) from error


def create(path: str, text: str) -> None:
    """Write a new file; if that fails there is none.

    Raises:
        OSError: the system refuses, or there is something at the path.
    """
    with held(), open(path, "xb") as file:
        try:
            file.write(text.encode())
            file.flush()
        except BaseException:
            os.unlink(path)
            raise


def refusal(error: OSError) -> Diagnostic:
    """The finding about a file that could not be rewritten."""
    message = f"the file cannot be written: {(error.strerror or 'refused').lower()}"
    hint = "it is as it was; check its permissions, those of its directory and the space there"
    return Diagnostic("E0090", message, Place(str(error.filename)), help=hint)


def _rewrite(target: Path, content: bytes) -> None:
    status = target.stat()
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        shutil.copymode(target, name)
        with contextlib.suppress(OSError):
            os.chown(name, status.st_uid, status.st_gid)
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise
