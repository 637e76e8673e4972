"""Synthetic specifications have nothing wrong with them."""

from pathlib import Path

import pytest

from bench.harness.synthetic import machine
from specc.pipeline import compile_spec


@pytest.mark.parametrize("states", [1, 2, 10])
@pytest.mark.parametrize("rows", [2, 4, 8])
def test_a_machine_is_without_findings(states: int, rows: int, tmp_path: Path) -> None:
    spec = tmp_path / "machine.yaml"
    spec.write_text(machine(states, rows), encoding="utf-8")
    result = compile_spec(str(spec))
    assert result.diagnostics == ()
    assert result.system is not None
    worker = next(s for s in result.system.subsystems if s.name == "worker")
    assert (len(worker.states), len(worker.transitions)) == (states, states * rows)
