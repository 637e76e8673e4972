"""Two texts of a specification and what was found between them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from specc.model.system import System
from specc.pipeline import read_spec
from specc.tools.diff import Comparison, compare

BASE = (Path(__file__).parent / "base.yaml").read_text(encoding="utf-8")

Reader = Callable[[str], System]
Differ = Callable[[str, str], Comparison]


@pytest.fixture
def read(tmp_path: Path) -> Reader:
    def reader(text: str) -> System:
        path = tmp_path / "spec.yaml"
        path.write_text(text, encoding="utf-8")
        result = read_spec(str(path))
        assert result.ok, [d.message for d in result.diagnostics]
        assert result.system is not None
        return result.system

    return reader


@pytest.fixture
def differ(read: Reader) -> Differ:
    return lambda old, new: compare(read(old), read(new))


def edited(*edits: tuple[str, str]) -> str:
    """The base specification with texts replaced; every one of them must be there."""
    text = BASE
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    return text
