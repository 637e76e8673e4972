"""What exploring says of rows holds in runs: no run takes a row to which there is no way."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from specc import pipeline
from specc.tools.explore.explorer import explore
from tests.commands import specc
from tests.scenarios.runs import SPECS

COMPLETE = {
    "conveyor_gate.yaml": "12",
    "architectures/teleoperation.yaml": "20",
    "architectures/sense_plan_act.yaml": "20",
    "architectures/two_tier.yaml": "10",
}
"""Specifications of which all ways are explored in a short time, and how long they run (s)."""


@pytest.mark.long
@pytest.mark.no_replay("what runs do is replayed elsewhere")
@pytest.mark.parametrize("name", COMPLETE, ids=lambda name: Path(name).stem)
def test_runs_take_no_row_to_which_there_is_no_way(name: str, tmp_path: Path) -> None:
    spec, file = SPECS / name, tmp_path / "run.mcap"
    result = pipeline.compile_spec(str(spec))
    found = explore(result.proofs, 100_000)
    assert all(each.complete for each in found.slices)
    assert result.system is not None
    specc("run", spec, "--duration", COMPLETE[name], "--record", file)
    items = json.loads(specc("coverage", file, "--format", "json").stdout)["items"]
    taken = {
        (i["subsystem"], i["line"], i["name"]) for i in items if i["kind"] == "row" and i["count"]
    }
    assert taken
    inside = {name for each in found.slices for name in (*each.names, *each.equal_machines)}
    reached = {
        (subsystem.qualified_name, result.sources.span(row.place).line)
        for subsystem in result.system.subsystems
        for index, row in enumerate(subsystem.transitions)
        if (subsystem.qualified_name, index) in found.reached_rows
    }
    assert {(name, line) for name, line, _ in taken if name in inside} <= reached


@pytest.mark.long
def test_what_one_copy_can_take_all_copies_can() -> None:
    result = pipeline.compile_spec(str(SPECS / "rovers.yaml"))
    reached = explore(result.proofs, 5000).reached_rows
    rows = [{row for of, row in reached if of == f"rovers_{i}.c"} for i in range(1, 5)]
    assert rows[0] == rows[1] == rows[2] == rows[3] == {0, 1, 2, 3}
