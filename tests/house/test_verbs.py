"""A verb of disturbances is known by two rows: that of the compiler and that of the runtime."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from specc_runtime import disturbances

from specc.model.task import VERBS

ROOT = Path(__file__).resolve().parents[2]
ROWS = {"specc": {"model/task.py"}, "runtime/specc_runtime": {"disturbances.py"}}
UNIT = {"turn"}
OTHER_WORDS = {
    "specc": {
        "model/units.py": UNIT,
        "analysis/suspicious_expressions.py": UNIT,
        "checks/expressions.py": UNIT,
    },
    "runtime/specc_runtime": {
        "sampling.py": {"silent"},  # a slot
        "recording/scene.py": {"scale"},  # of markers in Foxglove's schemas
    },
}
"""What the same text means elsewhere."""
ONCE_OR_LONGER = {"press"}
"""Verbs that have a duration with some subjects only."""


def words(module: Path) -> set[str]:
    """The verbs that are texts, or names of arguments, in a module."""
    source = module.read_text(encoding="utf-8")
    found = re.search(rf"""["']({"|".join(VERBS)})["']""", source)
    nodes = ast.walk(ast.parse(source if found else ""))
    texts = {node.value for node in nodes if isinstance(node, ast.Constant)}
    return {text for text in texts if isinstance(text, str)} & VERBS.keys()


@pytest.mark.parametrize("package", ROWS)
def test_no_other_module_knows_a_verb_by_its_name(package: str) -> None:
    root = ROOT / package
    modules = {path.relative_to(root).as_posix(): path for path in root.rglob("*.py")}
    found = {name: words(path) for name, path in modules.items() if name not in ROWS[package]}
    assert {name: known for name, known in found.items() if known} == OTHER_WORDS[package]


def test_the_compiler_and_the_runtime_know_the_same_verbs() -> None:
    assert list(VERBS) == list(disturbances.VERBS)
    for name, row in disturbances.VERBS.items():
        assert VERBS[name].has_duration == (row.lasts is not None), name
        assert (row.lasts is None) != (row.once is None) or name in ONCE_OR_LONGER, name
