"""The host runs in any Python from 3.10 on, with nothing but its standard library."""

from __future__ import annotations

import ast
import sys
from functools import cache
from pathlib import Path

import pytest
import specc_runtime

PACKAGE = Path(specc_runtime.__file__).parent
HOST = "specc_runtime.hosting.host"
# Newer than 3.10.
UNKNOWN = {"tomllib": (), "typing": ("Self", "assert_never", "override"), "enum": ("StrEnum",)}


def path_of(module: str) -> Path | None:
    base = PACKAGE.parent / module.replace(".", "/")
    return next((p for p in (base.with_suffix(".py"), base / "__init__.py") if p.exists()), None)


def imported(path: Path) -> set[tuple[str, str]]:
    """Modules that are imported, each with a name of it; those for type checkers are not."""
    found = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            return
        if isinstance(node, ast.Import):
            found.update((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level
            found.update((str(node.module), alias.name) for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(parsed(path))
    return found


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path), feature_version=(3, 10))


@cache
def of_the_host() -> dict[str, Path]:
    """All modules of the runtime that the host imports, packages around them included."""
    found: dict[str, Path] = {}
    asked = [HOST]
    while asked:
        name = asked.pop()
        path = path_of(name)
        if path is None or name in found:
            continue
        found[name] = path
        asked += [f"{m}.{n}" for m, n in imported(path)] + [m for m, _ in imported(path)]
        asked.append(name.rpartition(".")[0])
    return found


def test_the_host_is_small() -> None:
    names = {name.removeprefix("specc_runtime.") for name in of_the_host()}
    of_package = {"host", "keeper", "courier", "reader", "devices", "memory", "wire", "agency"}
    besides = {"blocks", "hosting", "scheduling", "specc_runtime"}
    assert names == {f"hosting.{n}" for n in of_package} | besides


@pytest.mark.parametrize("name", sorted(of_the_host()))
def test_it_imports_the_standard_library_only(name: str) -> None:
    for module, item in imported(of_the_host()[name]):
        top = module.split(".")[0]
        assert top == "specc_runtime" or top in sys.stdlib_module_names
        assert item not in UNKNOWN.get(module, ()) and module != "tomllib"
