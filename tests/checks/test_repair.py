"""A suggested repair, applied, makes the proof pass."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path

import pytest

from specc.model.fsm import Condition, Transition
from specc.model.system import Subsystem
from specc.model.trace import Trace
from specc.pipeline import compile_spec
from specc.proof import Prover, RowVerdict
from tests.checks.conditions import HERE, condition, machine

CASES = Path(__file__).resolve().parents[1] / "cases" / "machines"
ROW = re.compile(
    r'the row `\[(\w+), (\w+), (\w+), \.\.\.\]` with the initial condition `\w+: "(.*)"`'
)
MOST_REPAIRS = 40


def verdict_of(subsystem: Subsystem) -> RowVerdict:
    return Prover(subsystem, {}).prove_rows("S", "terminal")


def repaired(subsystem: Subsystem) -> Subsystem:
    """The subsystem after one suggested repair."""
    verdict = verdict_of(subsystem)
    rows = list(subsystem.transitions)
    witness = verdict.decision.overlap or verdict.decision.gap
    assert witness
    if witness.repair is None:
        rows.remove(rows[witness.holding[-1]])
        return replace(subsystem, transitions=tuple(rows))
    asked = Condition(f"repair_{len(rows)}", "initial", witness.repair, "", Trace(), HERE)
    if witness.repaired is None:
        rows.append(Transition("S", "terminal", asked, "S", Trace(), HERE))
    else:
        rows[witness.repaired] = replace(rows[witness.repaired], condition=asked)
    return replace(subsystem, transitions=tuple(rows))


@pytest.mark.parametrize("seed", range(40))
def test_repairs_end_in_a_proof(seed: int) -> None:
    rng = random.Random(seed)
    rows = [condition(rng, 2, {}) for _ in range(rng.randint(1, 3))]
    subsystem = machine(rows, terminal=condition(rng, 1, {}), axioms=(condition(rng, 1, {}),))
    for _ in range(MOST_REPAIRS):
        if verdict_of(subsystem).proved:
            return
        subsystem = repaired(subsystem)
    raise AssertionError("the repairs do not end")


@pytest.mark.parametrize("seed", range(40))
def test_a_missing_row_is_missing_once(seed: int) -> None:
    rng = random.Random(100 + seed)
    subsystem = machine([condition(rng, 3, {})], terminal=condition(rng, 1, {}))
    if verdict_of(subsystem).decision.gap:
        assert verdict_of(repaired(subsystem)).proved


@pytest.mark.parametrize("case", sorted(CASES.glob("E0601-*.yaml")), ids=lambda case: case.stem)
def test_the_row_of_the_report_makes_the_specification_pass(case: Path, tmp_path: Path) -> None:
    (finding,) = compile_spec(str(case)).diagnostics
    found = ROW.search(finding.help)
    assert found
    state, cause, name, text = found.groups()
    lines = case.read_text(encoding="utf-8").splitlines()
    initial = lines.index("          initial:")
    lines.insert(initial + 1, f'            {name}: "{text}"')
    lines.append(f"          - [{state}, {cause}, {name}, {state}]")
    mended = tmp_path / "mended.yaml"
    mended.write_text("\n".join(lines) + "\n", encoding="utf-8")
    result = compile_spec(str(mended))
    assert [d for d in result.diagnostics if d.severity == "error"] == []
