"""The approach of Table 11 onto the top of a box, which only a force can end (eq. 57)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.scenarios.runs import Change, run, variant

LOW_HAND: Change = (
    "X_EF:\n    type: pose[E, F]\n    is: identity()",
    'X_EF:\n    type: pose[E, F]\n    is: "translation(0, 0, -0.03[m])"',
)
"""The hand believes its fingers shorter than they are: its palm meets the box before they are
where they should be."""

FORCE_ALONE: Change = (
    "near(x.m.T_c, X_BEg, grasp_tolerance, rotation_tolerance) or x.m.F_c.z > contact_force",
    "x.m.F_c.z > contact_force",
)
ONE_CYCLE = ("--seed", "0", "--cycles", "1")


@pytest.mark.long
def test_a_gentle_contact_ends_the_approach(tmp_path: Path) -> None:
    """It is the force that ends it: nothing changes when the pose no longer can."""
    _, report = run(variant(tmp_path / "low", LOW_HAND), *ONE_CYCLE)
    _, forced = run(variant(tmp_path / "forced", LOW_HAND, FORCE_ALONE), *ONE_CYCLE)
    (cycle,) = report["cycles"]
    assert report["faults"] == []
    assert cycle["ended"] == "completed"
    assert 1.0 <= cycle["max_force_N"] <= 20.0
    assert cycle["finger_clearance_m"] > 0.0
    assert forced["cycles"] == report["cycles"]
    assert forced["records_sha256"] == report["records_sha256"]
