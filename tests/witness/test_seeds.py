"""Faults seeded into sound specifications: each scenario fails as reported, and passes without."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from specc_runtime.faults import UndecidedTransition

from bench.seeding.fault import Seed
from bench.seeding.machine_faults import FAULTS
from bench.seeding.score import Bed, beds, spread
from specc.pipeline import compile_spec
from tests.witness.runs import ROOT, run, states_of, written

SPECS = ROOT / "specs"
CODES = {"E0601", "E0602", "E0603"}
MOST = 2
"""Faults of each class that are seeded into each file."""


def seeded() -> Iterator[tuple[str, Bed, Seed]]:
    for bed in beds(SPECS):
        for fault in FAULTS:
            if fault.codes & CODES:
                for number, seed in enumerate(spread(list(fault.seeds(bed.sheet)), MOST)):
                    yield f"{Path(bed.sheet.path).stem}: {fault.name} {number}", bed, seed


CASES = list(seeded())


def firsts() -> Iterator[bool]:
    """Whether a case is the first in the smallest specification whose fault has its codes."""
    chosen: dict[frozenset[str], tuple[int, str]] = {}
    for name, bed, _ in CASES:
        own = len(bed.sheet.text), name
        chosen[_codes(name)] = min(own, chosen.get(_codes(name), own), key=lambda each: each[0])
    return (chosen[_codes(name)][1] == name for name, _, _ in CASES)


def _codes(name: str) -> frozenset[str]:
    fault = name.partition(": ")[2].rpartition(" ")[0]
    return next(each.codes & CODES for each in FAULTS if each.name == fault)


FIRST_OF_EACH = [
    pytest.param(bed, seed, id=name, marks=() if is_first else pytest.mark.long)
    for (name, bed, seed), is_first in zip(CASES, firsts(), strict=True)
]


@pytest.mark.parametrize(("bed", "seed"), FIRST_OF_EACH)
def test_scenarios_of_seeded_faults(bed: Bed, seed: Seed, tmp_path: Path) -> None:
    specs = tmp_path / "specs"
    shutil.copytree(SPECS, specs, ignore=shutil.ignore_patterns("*.png", "*.ply", "*.npz"))
    part = specs / Path(bed.sheet.path).relative_to(SPECS)
    part.write_text(seed.text(bed.sheet), encoding="utf-8")
    system = specs / Path(bed.system).relative_to(SPECS)
    told = [d for d in compile_spec(str(system)).diagnostics if d.code in CODES]
    scenarios = written(system, tmp_path / "out")
    # Each agent of a kind has a scenario of its own, and the finding about all is told once.
    without_agents = {scenario.stem.split("__", 1)[1] for scenario in scenarios}
    assert len(without_agents) == sum(map(states_of, told))
    for scenario in scenarios:
        error = run(scenario, tmp_path)
        assert isinstance(error, UndecidedTransition)
        assert (len(error.rows) > 1) == scenario.stem.endswith("E0602")
        assert scenario.stem[:-7].endswith(f"{error.state}__{error.cause}")
    part.write_text(bed.sheet.text, encoding="utf-8")
    assert [run(scenario, tmp_path) for scenario in scenarios] == [None] * len(scenarios)
