"""Writing scenarios: one file for each, never over a file that somebody else wrote."""

from __future__ import annotations

import os
from pathlib import Path

from specc.scenario.text import MARK


class ForeignFileError(Exception):
    """There is a file that was not written of this specification; the message names it."""


def put(path: Path, text: str) -> None:
    """Write the text of a scenario, whole or not at all.

    Raises:
        ForeignFileError: what is there is not a scenario of the same specification.
        OSError: the system refuses.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if os.path.lexists(path) and not _is_own(path, text):
        raise ForeignFileError(str(path))
    aside = path.with_name(f".{path.name}.new")
    try:
        aside.write_text(text, encoding="utf-8", newline="\n")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def _is_own(path: Path, text: str) -> bool:
    """Whether what is there was written of the same specification."""
    if not path.is_file():
        return False
    there = path.read_text(encoding="utf-8", errors="replace")
    return there.startswith(f"{MARK}\n") and _specification(there) == _specification(text)


def _specification(text: str) -> str:
    """The statement of a scenario that names its specification."""
    return text.partition("\nSPEC = ")[2].partition("\n\n")[0]
