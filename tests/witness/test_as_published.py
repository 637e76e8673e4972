"""The paper's section 4 as it stands: its overlaps run, although other texts have errors."""

from __future__ import annotations

from pathlib import Path

import pytest
from specc_runtime.faults import UndecidedTransition

from specc.pipeline import compile_spec
from tests.witness.runs import ROOT, run, states_of, written

SPEC = ROOT / "specs" / "irp_picking_as_published.yaml"


@pytest.mark.long
def test_every_overlap_runs(tmp_path: Path) -> None:
    told = [d for d in compile_spec(str(SPEC)).diagnostics if d.code == "E0602"]
    scenarios = written(SPEC, tmp_path / "out", "--code", "E0602")
    assert len(scenarios) == sum(map(states_of, told)) == 2
    for scenario in scenarios:
        error = run(scenario, tmp_path)
        assert isinstance(error, UndecidedTransition)
        assert f"irp__m__{error.state}__{error.cause}" in scenario.name
        assert len(error.rows) > 1
