"""What is said of parts of conditions, of time and of things that are the same is so in runs."""

from __future__ import annotations

from pathlib import Path

from specc.pipeline import compile_spec
from tests.soundness.claims import claims_of, held_against_runs

CASES = Path(__file__).parents[1] / "cases"
CLAIMING = ("W0332", "W0333", "W0617", "W0618")


def test_no_claim_about_a_random_system_is_refuted(tmp_path: Path) -> None:
    tally = held_against_runs(15, "claims", tmp_path, 60)
    assert tally.refuted == []
    assert tally.claims > 5


def test_findings_of_cases_are_claims_that_runs_can_refute() -> None:
    for case in sorted(CASES.glob("*/*.yaml")):
        if case.name.startswith(CLAIMING):
            system = compile_spec(str(case)).system
            assert system is not None
            assert sum(found.count for found in claims_of(system).values()) > 0, case.name
