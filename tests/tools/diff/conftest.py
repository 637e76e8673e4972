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


def system_of(text: str, folder: Path) -> System:
    path = folder / "spec.yaml"
    path.write_text(text, encoding="utf-8")
    result = read_spec(str(path))
    assert result.ok, [d.message for d in result.diagnostics]
    assert result.system is not None
    return result.system


@pytest.fixture(scope="session")
def base(tmp_path_factory: pytest.TempPathFactory) -> System:
    """What most texts are compared with."""
    return system_of(BASE, tmp_path_factory.mktemp("base"))


@pytest.fixture
def read(tmp_path: Path, base: System) -> Reader:
    return lambda text: base if text == BASE else system_of(text, tmp_path)


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
