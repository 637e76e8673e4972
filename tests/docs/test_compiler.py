"""docs/compiler.md names modules that are there, every package, and the tables of the house."""

import re
from pathlib import Path

from tests.house.tree import ROOT, modules

PAGE = (ROOT / "docs" / "compiler.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"`((?:specc|tests|runtime|templates|specs)/[\w./]*)`", PAGE))
INSIDE = {"specc/tools/importers/fabric", "specc/tools/importers/scxml", "specc/tools"}
"""Packages that belong to one that is named."""


def test_what_the_page_names_is_there() -> None:
    assert [name for name in sorted(NAMED) if not (ROOT / name).exists()] == []


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
