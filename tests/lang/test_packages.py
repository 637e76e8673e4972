"""Names that no system has: those of modules that Python could take its package for."""

import ast
import sys
from pathlib import Path

from specc.lang.packages import PACKAGES

ROOT = Path(__file__).parents[2]


def test_modules_of_this_python_are_in_the_list() -> None:
    assert sys.stdlib_module_names <= PACKAGES


def test_what_specc_and_its_runtime_import_is_in_the_list() -> None:
    """The list is a fixed one, the same on all machines."""
    imported = set()
    for module in (*(ROOT / "specc").rglob("*.py"), *(ROOT / "runtime").rglob("*.py")):
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                imported.add((node.module or "").partition(".")[0])
    assert {"numpy", "specc", "specc_runtime", "rclpy"} <= imported
    assert imported <= PACKAGES
