"""Imports point the way the design says."""

import subprocess
import sys

import networkx
import pytest
from importlinter import cli

from tests.house.tree import ROOT, modules

HEAVY = {"numpy", "networkx", "mujoco", "pinocchio", "cv2", "jinja2"}


def test_import_contracts_hold(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    outcome = cli.lint_imports(config_filename="pyproject.toml", no_cache=True)
    assert outcome == cli.EXIT_STATUS_SUCCESS, capfd.readouterr().out


def test_generated_code_imports_only_the_runtime() -> None:
    strangers = {
        (module.name, name)
        for module in modules("generated", ".")
        for name in module.imports()
        if (top := name.split(".")[0]) not in sys.stdlib_module_names
        and top not in {"specc_runtime", "numpy", module.name.split(".")[0]}
    }
    assert not strangers


def test_command_line_starts_without_heavy_packages() -> None:
    loaded = subprocess.run(
        [sys.executable, "-c", "import sys, specc.cli; print(*sys.modules)"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split()
    assert "specc.cli" in loaded
    assert not HEAVY.intersection(loaded)


@pytest.mark.parametrize(("root", "package"), [(".", "specc"), ("runtime", "specc_runtime")])
def test_modules_do_not_import_each_other_in_circles(root: str, package: str) -> None:
    names = {module.name for module in modules(root, package)}
    graph = networkx.DiGraph(
        (module.name, name)
        for module in modules(root, package)
        for name in module.imports_of(names - {module.name})
    )
    found = networkx.strongly_connected_components(graph)
    assert [sorted(circle) for circle in found if len(circle) > 1] == []
