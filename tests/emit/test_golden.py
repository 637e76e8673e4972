"""Generated packages are what was reviewed: see `tests/emit/golden.py` for how to renew them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.emit.golden import GOLDEN, SPECS, packages

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", SPECS)
def test_golden_packages_are_up_to_date(name: str) -> None:
    for directory, files in packages(name).items():
        stored = {path.name: path.read_text() for path in (GOLDEN / directory).glob("*.py")}
        assert files == stored


def test_output_does_not_depend_on_the_run(tmp_path: Path) -> None:
    """Another process has other hashes, so other orders of sets."""
    program = (
        "import sys; from tests.emit.golden import packages; "
        "[print(d, p, t) for d, f in packages('press').items() for p, t in f.items()]"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={"PYTHONHASHSEED": seed, "PATH": "", "PYTHONPATH": str(ROOT)},
            cwd=directory,
            capture_output=True,
            check=True,
        ).stdout
        for seed, directory in (("1", ROOT), ("2", tmp_path))
    }
    assert len(texts) == 1
    assert str(ROOT).encode() not in texts.pop()


RUFF = (
    ["ruff", "check", "--no-cache", "generated"],
    ["ruff", "format", "--no-cache", "--check", "generated"],
)


@pytest.mark.parametrize("name", SPECS)
def test_golden_packages_pass_linter_and_formatter(name: str, tmp_path: Path) -> None:
    passes(name, RUFF, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("name", SPECS)
def test_golden_packages_pass_the_type_checker(name: str, tmp_path: Path) -> None:
    named = [f"--package={directory}" for directory in packages(name)]
    passes(name, (["mypy", "--no-incremental", *named],), tmp_path)


def passes(name: str, commands: Iterable[list[str]], tmp_path: Path) -> None:
    """The modules that are run in a folder with the generated packages accept them."""
    generated = tmp_path / "generated"
    for directory, files in packages(name).items():
        (generated / directory).mkdir(parents=True)
        for path, text in files.items():
            (generated / directory / path).write_text(text)
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text())
    for command in commands:
        run = subprocess.run(
            [sys.executable, "-m", *command],
            cwd=tmp_path,
            env={"MYPYPATH": f"{ROOT / 'runtime'}:{generated}", "PATH": ""},
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stdout + run.stderr
