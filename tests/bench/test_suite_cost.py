"""The benchmark of the tests counts what a test takes, its child processes and memory included."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SPENDS = """
import subprocess, sys, time

SPEND = "import time\\nwhile time.process_time() < {}: pass"

def test_child():
    subprocess.run([sys.executable, "-c", SPEND.format(0.4)], check=True)

def test_memory():
    assert len(b'x' * 200_000_000) > 1
"""


def test_cpu_time_of_children_and_memory_of_a_worker_are_told(tmp_path: Path) -> None:
    (tmp_path / "test_spends.py").write_text(SPENDS, encoding="utf-8")
    command = [sys.executable, "bench/suite_cost.py", "--each", "-n", "1", f"--rootdir={tmp_path}"]
    done = subprocess.run(
        [*command, "-c", "/dev/null", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    each = [line.split() for line in done.stdout.splitlines() if "test_spends.py::" in line]
    costs = {test.partition("::")[2]: (float(cpu_s), float(mb)) for cpu_s, mb, test in each}
    assert 0.3 < costs["test_child"][0] < 4  # of the 0.4 s that it spends
    assert costs["test_child"][1] < 200 < costs["test_memory"][1]
    assert "0 tests over 3 CPU seconds" in done.stdout
