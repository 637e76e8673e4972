"""Importing a text: into a file, through the importer, and on to the compiler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from specc.pipeline import Result, compile_spec
from specc.tools.importers import Notes, import_fabric, import_scxml

FILES = Path(__file__).parent / "files"


@dataclass(frozen=True)
class Workshop:
    """A folder in which texts are imported and what comes out is compiled."""

    folder: Path

    def fabric(self, text: str, name: str = "unit") -> Notes:
        path = self.folder / f"{name}.xml"
        path.write_text(text, encoding="utf-8")
        return import_fabric([str(path)])

    def scxml(self, text: str, name: str = "unit") -> Notes:
        path = self.folder / f"{name}.scxml"
        path.write_text(text, encoding="utf-8")
        return import_scxml(str(path))

    def compile(self, made: Notes) -> Result:
        path = self.folder / "made.yaml"
        path.write_text(made.text, encoding="utf-8")
        return compile_spec(str(path))


@pytest.fixture
def workshop(tmp_path: Path) -> Workshop:
    return Workshop(tmp_path)


@pytest.fixture
def codes() -> Callable[[Notes | Result], list[str]]:
    return lambda found: sorted(d.code for d in found.diagnostics)
