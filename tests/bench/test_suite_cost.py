"""The benchmark of the tests counts what a test takes, once, its child processes included."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import alone

ROOT = Path(__file__).parents[2]
SPENDS = """
import subprocess, sys

SPEND = "import time\\nwhile time.process_time() < {}: pass"

def test_child():
    subprocess.run([sys.executable, "-c", SPEND.format(0.3)], check=True)

def test_memory():
    assert len(b'x' * 200_000_000) > 1
"""


def spent_s() -> float:
    """CPU seconds of the children that have ended."""
    return sum(os.times()[2:4])


@pytest.mark.long
def test_cpu_time_of_children_and_memory_of_a_worker_are_told(tmp_path: Path) -> None:
    before_s = spent_s()
    (tmp_path / "test_spends.py").write_text(SPENDS, encoding="utf-8")
    command = [sys.executable, "bench/suite_cost.py", "--each", "-n", "1"]
    done = subprocess.run(
        [*command, *alone(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    each = [line.split() for line in done.stdout.splitlines() if "test_spends.py::" in line]
    costs = {test.partition("::")[2]: (float(cpu_s), float(mb)) for cpu_s, mb, test in each}
    child_s = costs["test_child"][0]
    assert 0.25 < child_s < 1.5  # of the 0.3 s that it spends
    assert costs["test_child"][1] < 200 < costs["test_memory"][1]
    assert "0 tests over 3 CPU seconds" in done.stdout
    rows = {line.split()[0]: line.split() for line in done.stdout.splitlines() if line.split()}
    rest_s, all_s = float(rows["rest"][1]), float(rows["all"][2])
    assert child_s < all_s < spent_s() - before_s + 0.2 and rest_s < all_s - child_s + 0.1
    line = re.search(
        r"tests took (\d+) s \(wall\), (\d+) CPU s; reference loop (\S+) CPU s", done.stdout
    )
    assert line and abs(int(line[2]) - all_s) <= 1 and 0.1 < float(line[3]) < 20
    assert "on fresh seeds" not in done.stdout or os.environ.get("SPECC_SEED")
