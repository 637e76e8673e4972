"""Cells as users write them: two agents with a task timer, a ramp and a count of tries."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore
from tests.seeds import short

CELLS = sorted((Path(__file__).parent / "cells").glob("*.yaml"))


@pytest.mark.parametrize("cell", short(CELLS, 0))
def test_cells_are_valid(cell: Path) -> None:
    result = compile_spec(str(cell))
    assert result.ok and not result.diagnostics
    assert result.system is not None
    machines = [s for s in result.system.subsystems if s.qualified_name.endswith(".c")]
    assert len(machines) == 2
    assert 13 <= sum(len(machine.states) for machine in machines) <= 17


@pytest.mark.long
@pytest.mark.parametrize("cell", CELLS, ids=lambda cell: cell.stem)
def test_cells_are_explored_completely_and_proved(cell: Path) -> None:
    found = explore(compile_spec(str(cell)).proofs, 700_000)
    assert found.status == "complete"
    assert {each.verdict for each in found.requirements} == {"proved"}
    assert sum(each.configurations for each in found.slices) <= 20_000
