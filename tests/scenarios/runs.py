"""Runs of specifications as a user starts them."""

from __future__ import annotations

import json
import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from tests.commands import specc

ROOT = Path(__file__).parents[2]
SPECS = ROOT / "specs"
FLAGSHIP = SPECS / "irp_picking.yaml"
INSTALLED = pytest.mark.skipif(
    not (ROOT / "models/.ready").exists(),
    reason="the robot models of wheels are not installed: make models",
)

Change = tuple[str, str]
"""A text of the flagship and what stands in its place."""


@cache
def run(spec: Path, *options: str) -> tuple[int, dict[str, Any]]:
    """Exit code and report of `specc run`; the same run is made once in a test session."""
    with TemporaryDirectory(prefix="specc-run-") as scratch:
        report = Path(scratch) / "report.json"
        done = specc("run", spec, "--report", report, *options)
        assert report.exists(), done.stderr
        return done.returncode, json.loads(report.read_text())


def copy_companions(folder: Path) -> None:
    """Put the files that the flagship names, and nothing else, below `folder`."""
    for name in ("parts", "plants", "objects"):
        shutil.copytree(SPECS / name, folder / name)


def variant(folder: Path, *changes: Change) -> Path:
    """A copy of the flagship in a new `folder`, changed in texts that occur exactly once."""
    copy_companions(folder)
    text = FLAGSHIP.read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = folder / FLAGSHIP.name
    path.write_text(text, encoding="utf-8")
    return path
