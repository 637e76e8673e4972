"""Random examples depend on nothing that differs between processes, such as hashes of texts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DRAWN = """
from hypothesis import HealthCheck, Phase, given, settings
from specc.lang import show
from tests.lower.test_law import systems
from tests.strategies import conditions, environments

def drawn(strategy, shown, count):
    @settings(max_examples=count, derandomize=True, database=None, deadline=None,
              phases=[Phase.generate], suppress_health_check=list(HealthCheck))
    @given(strategy)
    def printed(value):
        print(shown(value))
    printed()

def of_system(system):
    whole = system.subsystems[0]
    parts = [let.value for let in whole.lets]
    parts += [a.value for b in whole.behaviours for a in b.assignments]
    return [a.target for b in whole.behaviours for a in b.assignments], [*map(show, parts)]

drawn(conditions(), show, 30)
drawn(environments(), lambda e: (e.inputs, e.memory, sorted(e.fresh), sorted(e.present)), 10)
drawn(systems(decided=False), of_system, 8)
"""


@pytest.mark.long
def test_examples_do_not_depend_on_the_hashes_of_texts() -> None:
    started = [
        subprocess.Popen(
            [sys.executable, "-c", DRAWN],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            stdout=subprocess.PIPE,
            text=True,
        )
        for seed in ("1", "2")
    ]
    one, other = [process.communicate(timeout=120)[0] for process in started]
    assert [process.returncode for process in started] == [0, 0]
    assert len(one.splitlines()) > 40
    assert one == other
