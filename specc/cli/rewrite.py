"""Replacing the text of a file: whole or not at all."""

import os
import shutil
import tempfile
from pathlib import Path


def rewrite(path: str, text: str) -> None:
    """Make `text` the content of a file that exists; links and permissions stay.

    Raises:
        OSError: the system refuses; the file is as it was.
    """
    target = Path(os.path.realpath(path))
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text.encode())
        shutil.copymode(target, name)
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise
