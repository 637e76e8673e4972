"""Random tests have fixed seeds, or those of the text in SPECC_SEED; what fails can be repeated.

A campaign tries as many of them as it is asked for, and says which, also when it is interrupted.
"""

from __future__ import annotations

import os
import re
import signal
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


def started(folder: Path, tests: str, *options: str, **variables: str) -> subprocess.Popen[str]:
    """A run of pytest with tests in a folder of their own."""
    (folder / "conftest.py").write_text("from tests.conftest import *\n", encoding="utf-8")
    (folder / "test_random.py").write_text(tests, encoding="utf-8")
    of_this_run = ("SPECC_", "PYTEST_")
    others = {name: text for name, text in os.environ.items() if not name.startswith(of_this_run)}
    return subprocess.Popen(
        [sys.executable, "-m", "pytest", "-s", *options, *alone(folder)],
        cwd=ROOT,
        env=others | variables,
        stdout=subprocess.PIPE,
        text=True,
    )


def outcome(folder: Path, seed: str) -> str:
    """What pytest prints of these tests with a text for SPECC_SEED."""
    return started(folder, RANDOM, SPECC_SEED=seed).communicate()[0]


def campaign(folder: Path, tests: str, **variables: str) -> str:
    """What a campaign prints; it has the name of each test without its folder."""
    chosen = ("-m", "fresh or hypothesis")
    told = started(folder, tests, *chosen, SPECC_SEED="a1", **variables).communicate()[0]
    return re.sub(r"[^\s']*(test_random\.py)", r"\1", told)


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


@pytest.mark.long
def test_a_campaign_tries_as_many_seeds_as_it_is_asked_for(tmp_path: Path) -> None:
    told = campaign(tmp_path, RANDOM, SPECC_SEEDS="5")
    found = re.search(r"random tests: seeds from (\d+) on", told)
    assert found
    first = int(found[1])
    failed = f"{first}, {first + 2}, {first + 4}"  # each block ends at its first one
    assert f"      3 tried, {failed} failed  test_random.py::test_seeds\n" in told
    assert "      5 tried, none failed  test_random.py::test_examples\n" in told
    assert "      8 tried in all\n" in told
    command = (
        r"SPECC_SEED=a1 SPECC_SEEDS=5 \.venv/bin/pytest 'test_random\.py::test_seeds\[\d+-\d+\]'"
    )
    assert len(re.findall(command, told)) == 3
    assert "drawn:" not in told  # neither fixed seeds nor other tests


SLOW = """
import time
from tests.conftest import *
from tests.seeds import blocks

@pytest.mark.parametrize("seeds", blocks([3], long=4, each=2))
def test_slow(seeds):
    for seed in seeds:
        time.sleep(0.1)
    print("one block")
"""


@pytest.mark.long
def test_a_test_begins_no_more_seeds_after_its_time(tmp_path: Path) -> None:
    told = campaign(tmp_path, SLOW, SPECC_SEEDS="10", SPECC_LIMIT_S="0.05")
    assert "      2 tried, none failed  test_random.py::test_slow\n" in told
    assert "1 passed, 4 skipped" in told


@pytest.mark.long
def test_a_campaign_that_is_interrupted_says_what_it_tried(tmp_path: Path) -> None:
    variables = {"SPECC_SEED": "a1", "SPECC_SEEDS": "1000"}
    running = started(tmp_path, SLOW, "-m", "fresh", **variables)
    assert running.stdout is not None
    ended = (line for line in running.stdout if "one block" in line)
    assert next(ended) and next(ended)  # the first is in a report by now
    running.send_signal(signal.SIGINT)
    told = running.communicate()[0]
    found = re.search(r"(\d+) tried, none failed  \S*test_random.py::test_slow\n", told)
    assert found and 2 <= int(found[1]) < 1000
    assert running.returncode == pytest.ExitCode.INTERRUPTED
