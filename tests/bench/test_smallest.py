"""Quick benchmarks run to their end at their smallest size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from bench import analysis, growth, many_agents, ros_latency, startup

Main = Callable[[Sequence[str]], object]


@pytest.mark.parametrize(
    ("main", "arguments", "said"),
    [
        (analysis.main, "--repeats 1 --states 4 --rows 2", "4"),
        (growth.main, "--sizes 3 --only enum", "enum"),
        pytest.param(
            many_agents.main,
            "--counts 2 --duration 1 --repeats 1",
            "rovers",
            marks=pytest.mark.long,
        ),
        pytest.param(ros_latency.main, "--samples 40 --rounds 1", "relay", marks=pytest.mark.long),
        pytest.param(startup.main, "--repeats 1", "first step", marks=pytest.mark.long),
    ],
    ids=["analysis", "growth", "many_agents", "ros_latency", "startup"],
)
def test_it_runs(main: Main, arguments: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(arguments.split())
    assert said in capsys.readouterr().out


def test_no_benchmark_has_the_name_of_a_folder() -> None:
    """Python looks for what a script imports beside the script first."""
    root = Path(__file__).parents[2]
    folders = {path.name for path in root.iterdir() if path.is_dir()}
    assert folders.isdisjoint(path.stem for path in (root / "bench").glob("*.py"))
