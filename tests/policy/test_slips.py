"""Repairs change nothing but the slips: a text means what was meant, or is left as it is."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import pytest

from tests.policy.slips import Slip, mended, read, slips, specifications
from tests.seeds import SOAK

SMALL = ("conveyor_gate.yaml", "follow.yaml", "told.yaml", "services.yaml")


def wrong_repairs(paths: list[Path], seed: int, count: int) -> tuple[int, list[str]]:
    """How many slips were repaired, and which repairs changed what was meant."""
    good = {path: path.read_text(encoding="utf-8") for path in paths}
    meant = {path: read(str(path)) for path in paths}
    done, faults = 0, []
    for slip in islice(slips(paths, seed), count):
        outcome = mended(slip, good[slip.path], meant[slip.path])
        done += outcome.repaired
        if outcome.fault:
            faults.append(f"{slip.path.name}: {slip.right} -> {slip.wrong}: {outcome.fault}")
    return done, faults


FOUND = (  # file, what stands before the slip, what was meant, the slip
    ("told.yaml", "y: {c: {", "side", "Side"),  # which is also the name of its type
    ("told.yaml", "x: {eye: {", "side", "Side"),
    (
        "syndicate.yaml",
        "given_up]\n\n  ",
        "sequencers",
        "seQuencers",
    ),  # named with an index elsewhere
    ("reactive.yaml", "", "guidance", "guidannce"),  # a constant, which a requirement names
    ("told.yaml", "types: {", "Side", "side"),
    ("blackboard_messages.yaml", "operators:\n  ", "entry", "Entry"),  # also that of its type
    ("blackboard.yaml", "", "came_1", "cAme_1"),  # the nearest for one of four copies of a text
    ("blackboard.yaml", "", "came_4", "cae_4"),  # one of four that are named with an index
    (
        "way_drive.yaml",
        "let:\n    way: (x.c.goal if x.c.goal is not None else x.E.at) - x.E.at\n    ",
        "ahead",
        "aHead",
    ),  # a let, which one that is looked at before it names
    ("joint_arm.yaml", "where to go}\n      ", "halt", "hlt"),  # an event, which states ignore
    ("pose_tracker.yaml", "if present(x.c.T_d) else ", "False", "Fase"),  # beside `base`
)


@pytest.mark.long
def test_repairs_of_slips_that_were_found_change_nothing_else(tmp_path: Path) -> None:
    paths = {path.name: path for path in specifications(tmp_path)}
    faults = []
    for name, before, right, wrong in FOUND:
        good = paths[name].read_text(encoding="utf-8")
        start = good.index(before + right) + len(before)
        slip = Slip(paths[name], start, right, wrong)
        faults.append(mended(slip, good, read(str(paths[name]))).fault)
    assert not any(faults), faults


@pytest.mark.parametrize("count", [4, pytest.param(25, marks=pytest.mark.long)])
def test_repairs_change_nothing_else(count: int, tmp_path: Path) -> None:
    small = [path for path in specifications(tmp_path) if path.name in SMALL]
    done, faults = wrong_repairs(small, seed=1, count=count)
    assert not faults
    assert done > count / 3


@pytest.mark.parametrize(
    "count", [pytest.param(100, marks=pytest.mark.long), pytest.param(300, marks=SOAK)]
)
def test_repairs_of_many_slips_change_nothing_else(count: int, tmp_path: Path) -> None:
    done, faults = wrong_repairs(specifications(tmp_path), seed=2, count=count)
    assert not faults
    assert done > count / 2
