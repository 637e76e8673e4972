"""Random tests have fixed seeds, or those of the text in SPECC_SEED; what fails can be repeated."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import alone

ROOT = Path(__file__).parents[2]
RANDOM = """
from hypothesis import given
from hypothesis import strategies as st
from tests.conftest import *
from tests.seeds import blocks

@pytest.mark.parametrize("seeds", blocks([3, 7], long=4, each=2))
def test_seeds(seeds):
    for seed in seeds:
        assert seed in (3, 7), "fresh"

drawn = []

@given(st.integers())
def test_examples(number):
    drawn.append(number)

def test_told():
    print("drawn:", drawn)
"""


def outcome(folder: Path, seed: str) -> str:
    """What pytest prints of these tests with a text for SPECC_SEED."""
    (folder / "conftest.py").write_text("from tests.conftest import *\n", encoding="utf-8")
    (folder / "test_random.py").write_text(RANDOM, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-s", *alone(folder)],
        cwd=ROOT,
        env={**os.environ, "SPECC_SEED": seed},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout


def drawn(told: str) -> list[str]:
    """The examples of hypothesis."""
    return re.findall("drawn: .*", told)


@pytest.mark.long
def test_seeds_follow_from_the_text_and_what_fails_is_named(tmp_path: Path) -> None:
    fixed, one = (outcome(tmp_path, text) for text in ("", "a1"))
    assert "random tests: fixed seeds" in fixed and "it failed at seed 1000\n" in fixed
    first = re.search(r"random tests: seeds from (\d+) on, of SPECC_SEED=a1\n", one)
    assert first and f"it failed at seed {first[1]}\n" in one
    command = r"SPECC_SEED=a1 \.venv/bin/pytest '\S*test_random\.py::test_seeds\[\d+-\d+\]'"
    assert len(re.findall(command, one)) == 2 and "[fixed]" not in one
    assert drawn(fixed) != drawn(one)


@pytest.mark.long
def test_the_same_text_gives_the_same_examples(tmp_path: Path) -> None:
    one, again = (outcome(tmp_path, "a1") for _ in range(2))
    assert drawn(one) == drawn(again) != []
