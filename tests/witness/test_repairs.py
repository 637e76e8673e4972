"""Suggested repairs of faults seeded into the flagship make the scenario of the finding pass."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from bench.seeding.fault import Seed
from bench.seeding.machine import machines
from bench.seeding.machine_faults import FAULTS
from bench.seeding.score import spread
from bench.seeding.sheet import Edit, Sheet
from specc.diagnostics import Diagnostic
from specc.pipeline import compile_spec
from tests.witness.runs import ADDED, ASKED, ROOT, others_of, run, written

SPECS = ROOT / "specs"
MOST = 2
STATE = re.compile(r"of states? `(\w+)`")
CAUSE = re.compile(r"by its (\w+) condition")


def mended(sheet: Sheet, finding: Diagnostic) -> str | None:
    """The text of a specification with the repair that a finding suggests, if it suggests one."""
    route = finding.primary.route
    machine = next(m for m in machines(sheet) if route[: len(m.route)] == m.route)
    conditions = machine.entries("conditions", "initial")
    if not conditions:
        return None
    edits: list[Edit] = []
    others = others_of(finding)
    if found := ADDED.search(finding.help):
        state, cause, name = found.groups()
        for lacking in (state, *others):
            row = machine.rows_of(lacking, cause)[0].route
            edits.append(sheet.beside(row, f"[{lacking}, {cause}, {name}, {lacking}]"))
    elif found := ASKED.search(finding.help):
        which, asked, old = found.groups()
        name, row = "mended", route if which == "this row" else finding.related[0].place.route
        row = row[: len(machine.route) + 2]
        cause = sheet.get(row)[1]
        rows = [each for state in others for each in machine.rows_of(state, cause)]
        also = [other.route for other in rows if other.condition == old]
        edits += [sheet.replaced(sheet.at((*each, 2)), name) for each in (row, *also)]
        edits.append(sheet.beside(conditions[0], f'{name}: "{asked}"'))
    else:
        return None
    return Seed(tuple(edits), ()).text(sheet)


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["conveyor_gate.yaml", pytest.param("irp_picking.yaml", marks=pytest.mark.long)]
)
@pytest.mark.parametrize("code", ["E0601", "E0602"])
def test_a_suggested_repair_makes_the_scenario_pass(name: str, code: str, tmp_path: Path) -> None:
    specs = tmp_path / "specs"
    shutil.copytree(SPECS, specs, ignore=shutil.ignore_patterns("*.png", "*.ply", "*.npz"))
    sheet, path = Sheet.read(SPECS / name), specs / name
    tried = 0
    for fault in FAULTS:
        for seed in spread(list(fault.seeds(sheet)), MOST) if code in fault.codes else ():
            path.write_text(seed.text(sheet), encoding="utf-8")
            told = [d for d in compile_spec(str(path)).diagnostics if d.code == code]
            text = mended(Sheet.read(path), told[0]) if told else None
            if text is None:
                continue
            state, cause = STATE.search(told[0].message), CAUSE.search(told[0].label)
            assert state and cause
            chosen = ("--code", code, "--state", state[1])
            end = f"__{state[1]}__{cause[1]}__{code}"
            scenarios = written(path, tmp_path / "out", *chosen)
            scenario = next(s for s in scenarios if s.stem.endswith(end))
            assert run(scenario, tmp_path) is not None
            path.write_text(text, encoding="utf-8")
            assert run(scenario, tmp_path) is None
            tried += 1
    assert tried
