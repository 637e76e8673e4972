"""docs/compiler.md names modules that are there, and every package; so do decisions."""

import re
from pathlib import Path

import pytest

from tests.house.tree import ROOT, modules

PAGE = (ROOT / "docs" / "compiler.md").read_text(encoding="utf-8")
PATH = re.compile(r"`((?:specc|tests|runtime|templates|specs)/[\w./-]*)`")
NAMED = set(PATH.findall(PAGE))
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
INSIDE = {"specc/tools"}
"""Packages that belong to one that is named."""


def test_what_the_page_names_is_there() -> None:
    assert [name for name in sorted(NAMED) if not (ROOT / name).exists()] == []


@pytest.mark.parametrize("page", DECISIONS, ids=lambda page: page.stem)
def test_what_decisions_name_is_there(page: Path) -> None:
    named = set(PATH.findall(page.read_text(encoding="utf-8"))) - {"specc/_data"}  # of the wheel
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []


def test_every_package_is_named() -> None:
    paths = {module.path for module in modules(".", "specc")}
    packages = {str(p.parent.relative_to(ROOT)) for p in paths if p.name == "__init__.py"}
    assert packages - {name.rstrip("/") for name in NAMED} - INSIDE == set()


def test_the_code_that_it_shows_is_generated() -> None:
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    assert code in Path(ROOT / "generated/conveyor_gate/gate_c.py").read_text(encoding="utf-8")


def test_the_condition_that_it_follows_is_specified() -> None:
    assert "error: {stuck: elapsed > patience}" in PAGE
    text = (ROOT / "specs/conveyor_gate.yaml").read_text(encoding="utf-8")
    assert "error: {stuck: elapsed > patience}" in text
