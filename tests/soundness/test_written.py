"""The specifications of the project do as the interpreter says, with operators of no meaning."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Interpreter
from tests.soundness.law import marks_of
from tests.soundness.open_inputs import stubs, with_stubs
from tests.soundness.running import Script, ScriptedPlant, built, executed

ROOT = Path(__file__).parents[2]
SPECS = (
    "specs/irp_picking.yaml",
    "specs/conveyor_gate.yaml",
    "specs/skeletons/joint/joint.yaml",
    "specs/skeletons/sense-act/follow.yaml",
    "specs/skeletons/two-agents/told.yaml",
)
TICKS = 200


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", SPECS)
def test_same_records(name: str, seed: int) -> None:
    result = compile_spec(str(ROOT / name))
    assert result.ok
    assert result.system is not None
    system, marks = with_stubs(result.system), marks_of(result.system)
    script = Script(system, str(seed), marks)
    with stubs(system, str(seed), marks, ()) as operators:
        expected = Interpreter(system, operators, script.measure).run(TICKS)
        for proofs in (None, result.proofs):
            with built(system, proofs) as made:
                found = executed(made, ScriptedPlant(script) if made.plant else None, TICKS)
            assert differences(expected, found, tolerance=1e-9) == []
    assert sum(map(len, expected.steps.values())) > 20
