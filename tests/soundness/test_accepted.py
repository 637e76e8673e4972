"""What was accepted decides: every step finds one row, and reads no input without a value."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from specc.pipeline import compile_spec
from tests.seeds import Seeds, blocks
from tests.soundness.open_inputs import Findings, tried
from tests.soundness.running import compiled
from tests.soundness.specifications import Tree, specification
from tests.soundness.values import EXTREMES

ROOT = Path(__file__).parents[2]
WRITTEN = [
    *sorted((ROOT / "specs").glob("*.yaml")),
    *sorted((ROOT / "specs/skeletons").glob("*/*.yaml")),
    *sorted((ROOT / "tests/cases").glob("*/ok-*.yaml")),
]
REFUSED = {"irp_picking_as_published.yaml"}


@pytest.mark.long
@pytest.mark.parametrize(
    ("steps", "share"), [(20, 6), pytest.param(400, 1, marks=pytest.mark.long)]
)
def test_written_specifications(steps: int, share: int) -> None:
    without_classes = 0
    for path in WRITTEN[::share]:
        result = compile_spec(str(path))
        if path.name in REFUSED or not result.ok or result.system is None:
            continue
        findings = Findings()
        try:
            tried(result, "1", steps, findings, odd=EXTREMES)
        except ImportError:  # its types are classes of a module that nobody wrote
            without_classes += 1
            continue
        assert findings.faults == [], path
        assert findings.steps == steps, path
    assert without_classes < 10 < len(WRITTEN)


@pytest.mark.long
@pytest.mark.parametrize(
    ("steps", "share"), [(800, 0.1), pytest.param(4000, 0.3, marks=pytest.mark.long)]
)
def test_the_flagship_goes_through_most_of_its_states(steps: int, share: float) -> None:
    result = compile_spec(str(ROOT / "specs/irp_picking.yaml"))
    assert result.ok
    assert result.system is not None
    findings = Findings()
    tried(result, "2", steps, findings)
    assert findings.faults == []
    assert findings.visited > share * findings.states


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 4), long=10, each=20))
def test_random_specifications(seeds: Seeds, tmp_path: Path) -> None:
    findings = Findings()
    for seed in seeds:
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok and result.system is not None:
            tried(result, str(seed), 150, findings, odd=EXTREMES)
    assert findings.faults == []
    assert (findings.systems and findings.rows_taken) or seeds.are_fresh


def small(rows: dict[str, str]) -> Tree:
    """A subsystem with one state, whose rows ask about what a device reports."""
    return {
        "specc": 1,
        "system": "small",
        "agents": {
            "a": {
                "real_effectors": {"m": {"x": {"u": "real"}, "y": {"p": "real", "q": "real"}}},
                "control": {
                    "rate": "10 Hz",
                    "x": {"m": {"n": "int"}},
                    "behaviours": {"wait": {"terminal": "never"}},
                    "states": {"S0": "wait"},
                    "initial_state": "S0",
                },
                "virtual_effectors": {
                    "m": {
                        "rate": "10 Hz",
                        "x": {"E": {"p": "real", "q": "real"}},
                        "y": {"E": {"u": "real"}, "c": {"n": "int"}},
                        "conditions": {"initial": rows},
                        "functions": {"drive": {"y.E.u": "x.E.p", "y.c.n": 1}},
                        "behaviours": {"drive": {"functions": ["drive"], "terminal": "always"}},
                        "states": {"S0": "drive"},
                        "initial_state": "S0",
                        "transitions": [["S0", "terminal", name, "S0"] for name in rows],
                    }
                },
            }
        },
    }


@pytest.mark.parametrize(
    "rows",
    [
        {"low": "x.E.p < 0.5", "high": "x.E.p > 0.5"},
        {"low": "x.E.p <= 0.5", "high": "x.E.p >= 0.5"},
        {"less": "x.E.p < x.E.q", "more": "x.E.q < x.E.p"},
        {"near": "near(x.E.p, 1, 0.25)", "far": "x.E.p < 0.75 or x.E.p > 1.5"},
    ],
    ids=["gap", "overlap", "equality", "near"],
)
def test_the_steps_find_what_is_refused(rows: dict[str, str], tmp_path: Path) -> None:
    result = compiled(small(rows), tmp_path)
    assert not result.ok
    assert result.system is not None
    findings = Findings()
    tried(result, "1", 300, findings)
    assert findings.ended["undecided where it is not proved"]


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 4), long=10, each=20))
def test_random_specifications_with_constants_that_change(seeds: Seeds, tmp_path: Path) -> None:
    findings = Findings()
    for seed in seeds:
        tree = specification(Random(seed))
        tree["constants"] |= {
            "limit": {"is": "0.5[m]", "range": [0, 1], "live": True},
            "gain": {"is": 0.5, "range": [-1, 2], "live": True},
            "whole": {"is": 2, "range": [0, 3], "live": True},
        }
        result = compiled(tree, tmp_path)
        if result.ok and result.system is not None:
            tried(result, str(seed), 150, findings, odd=EXTREMES)
    assert findings.faults == []
    assert (findings.systems and findings.rows_taken) or seeds.are_fresh
