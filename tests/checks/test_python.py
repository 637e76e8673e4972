"""Names of Python objects are looked for in the text of their module, which is never imported."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.checks.python import lacks
from specc.limits import one_run

PLAIN = """
raise SystemExit("this module was imported")
import os.path as paths, json
from math import hypot as length
if paths: chosen = 1
else:
    def other(): pass
try: from numpy import array
except ImportError: array = None
class Drive: inner = 3
a = b = 0
c, (d, e) = 1, (2, 3) if a else (4, 5)
for k in range(3): last = k
"""


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path with a package `robot`, whose import ends the process."""
    package = tmp_path / "robot"
    package.mkdir()
    (package / "__init__.py").write_text("raise SystemExit\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    return package


def test_names_of_a_module_are_found_in_its_text(packages: Path) -> None:
    (packages / "arm.py").write_text(PLAIN)
    defined = [
        "paths",
        "json",
        "length",
        "chosen",
        "other",
        "array",
        "Drive",
        "a",
        "b",
        "c",
        "d",
        "e",
        "k",
        "last",
    ]
    assert [name for name in defined if lacks(f"robot.arm:{name}")] == []
    assert [
        name for name in ("inner", "drive", "os", "hypot") if not lacks(f"robot.arm:{name}")
    ] == []
    assert not lacks("robot:arm")
    assert lacks("robot:leg")


def test_no_more_text_is_parsed_than_a_run_may(packages: Path) -> None:
    (packages / "arm.py").write_text("def grip(): ...\n" + "# long\n" * 1000)
    with one_run():
        told = [lacks(f"robot.arm:leg_{n}") for n in range(100)]
    assert told == sorted(told, reverse=True)
    assert 0 < told.count(True) < 100 and lacks("robot.arm:leg")


def test_a_package_may_be_a_folder_with_nothing_but_others(packages: Path) -> None:
    inner = packages.parent / "cell" / "left"
    inner.mkdir(parents=True)
    (inner / "arm.py").write_text("def grip(): ...\n")
    assert lacks("cell.left.arm:leg") and not lacks("cell.left.arm:grip")


@pytest.mark.parametrize(
    "text",
    [
        "from math import *",
        "def __getattr__(name): return 1",
        "globals()['grip'] = 1",
        "this is no Python",
        "\0",
    ],
)
def test_nothing_is_said_of_modules_whose_names_are_not_in_their_text(
    packages: Path, text: str
) -> None:
    (packages / "hand.py").write_text(text)
    assert not lacks("robot.hand:grip")


def test_nothing_is_said_of_modules_that_are_not_there_or_have_no_text(packages: Path) -> None:
    for name in (
        "none.at:all",
        "robot.none:f",
        "math:hypo",
        "numpy._core._multiarray_umath:f",
        "robot",
    ):
        assert not lacks(name)
    assert not lacks(".".join("a" * 400) + ":f")


def test_the_folder_of_the_specification_is_looked_into_last(packages: Path) -> None:
    beside = packages.parent / "cell"
    beside.mkdir()
    (beside / "tool.py").write_text("def grip(): ...\n")
    (beside / "robot.py").write_text("def leg(): ...\n")
    assert lacks("tool:leg", str(beside)) and not lacks("tool:grip", str(beside))
    assert lacks("robot:leg", str(beside)) and not lacks("tool:leg", str(packages))
