"""What is said of parts of conditions, of time and of things that are the same is so in runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from tests.seeds import blocks
from tests.soundness.claims import claims_of, held_against_runs

CASES = Path(__file__).parents[1] / "cases"
CLAIMING = ("W0332", "W0333", "W0617", "W0618")


@pytest.mark.long
def test_no_claim_about_a_few_random_systems_is_refuted(tmp_path: Path) -> None:
    no_claim_is_refuted(3, 0, tmp_path)


@pytest.mark.parametrize("seeds", blocks((), also=[0], long=1, each=2)[1:])
def test_no_claim_about_a_random_system_is_refuted(seeds: Sequence[int], tmp_path: Path) -> None:
    for seed in seeds:
        no_claim_is_refuted(8, seed, tmp_path)


def no_claim_is_refuted(systems: int, seed: int, folder: Path) -> None:
    tally = held_against_runs(systems, f"claims {seed}", folder, 60)
    assert tally.refuted == []
    assert tally.claims


def test_findings_of_cases_are_claims_that_runs_can_refute() -> None:
    """Those about formulas of requirements are claims about no machine."""
    for case in sorted(CASES.glob("*/*.yaml")):
        if case.name.startswith(CLAIMING) and case.parent.name != "requirements":
            system = compile_spec(str(case)).system
            assert system is not None
            assert sum(found.count for found in claims_of(system).values()) > 0, case.name
