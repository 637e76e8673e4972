"""Writing scenarios: one file for each, never over a file that somebody else wrote."""

from __future__ import annotations

import os
from pathlib import Path

from specc.scenario.text import MARK


class ForeignFileError(Exception):
    """There is a file that `specc witness` did not write; the message names it."""


def put(path: Path, text: str) -> None:
    """Write the text of a scenario, whole or not at all.

    Raises:
        ForeignFileError: somebody else wrote what is there.
        OSError: the system refuses.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if os.path.lexists(path) and not _is_own(path):
        raise ForeignFileError(str(path))
    aside = path.with_name(f".{path.name}.new")
    try:
        aside.write_text(text, encoding="utf-8", newline="\n")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def _is_own(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline().rstrip("\n") == MARK
