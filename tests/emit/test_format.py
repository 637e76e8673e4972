"""The formatter: what it does, and what is said when it cannot."""

from __future__ import annotations

import shutil

import pytest

from specc import emit
from specc.emit import FormatError, format_files


def test_imports_are_sorted_and_lines_broken() -> None:
    text = "from b import z\nfrom a import y\n\nx = y(" + ", ".join(["z" * 12] * 9) + ")\n"
    done = format_files({"p.py": text, "deep/q.py": "x=1\n"})
    assert done["deep/q.py"] == "x = 1\n"
    assert done["p.py"].startswith("from a import y\nfrom b import z\n\nx = y(\n")
    assert max(map(len, done["p.py"].splitlines())) <= 100


def test_what_cannot_be_formatted_is_kept() -> None:
    with pytest.raises(FormatError, match="kept in") as error:
        format_files({"p.py": "def def\n"})
    kept = error.value.folder
    assert kept is not None
    assert (kept / "p.py").read_text() == "def def\n"
    shutil.rmtree(kept)


def test_a_missing_formatter_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(emit, "which", lambda name: None)
    with pytest.raises(FormatError, match="pip install ruff"):
        format_files({"p.py": "x = 1\n"})
