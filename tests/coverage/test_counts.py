"""`specc coverage` counts what the messages of the recordings say, of every specification."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from specc import pipeline
from tests.commands import ROOT, specc
from tests.coverage.counts import counted, evaluated, of_output
from tests.scenarios.runs import INSTALLED, SPECS

RUNS = {
    "conveyor_gate.yaml": ("8", "12"),
    "rovers.yaml": ("6",),
    "irp_picking.yaml": ("4",),
    "examples/tray_cell.yaml": ("16", "8"),
    "architectures/blackboard.yaml": ("8",),
    "architectures/reactive.yaml": ("8", "8"),
    "architectures/recovering_picking.yaml": ("3",),
    "architectures/sense_plan_act.yaml": ("12",),
    "architectures/services.yaml": ("12",),
    "architectures/subsumption.yaml": ("10",),
    "architectures/syndicate.yaml": ("10",),
    "architectures/teleoperation.yaml": ("12", "12"),
    "architectures/three_tier.yaml": ("25",),
    "architectures/two_cells.yaml": ("2",),
    "architectures/two_tier.yaml": ("10",),
    "examples/mobile_panda.yaml": ("4",),
    "examples/panda_bin.yaml": ("4",),
}
"""Simulated seconds of each run, of seeds from 0 on."""
EVALUATED = {
    "conveyor_gate.yaml": "12",
    "rovers.yaml": "8",
    "examples/tray_cell.yaml": "14",
    "architectures/reactive.yaml": "8",
    "architectures/services.yaml": "8",
    "architectures/syndicate.yaml": "8",
    "architectures/teleoperation.yaml": "20",
    "architectures/two_tier.yaml": "8",
}
"""Whose conditions call no operators."""
NOT_RUN = {"irp_picking_as_published.yaml", "examples/pick_cubes.yaml"}
WITH_MODELS = {"examples/mobile_panda.yaml", "examples/panda_bin.yaml"}
EACH = [
    pytest.param(name, marks=[INSTALLED] if name in WITH_MODELS else [], id=Path(name).stem)
    for name in RUNS
]


def test_all_specifications_that_run_are_counted() -> None:
    files = [
        file for of in ("*", "architectures/*", "examples/*") for file in SPECS.glob(f"{of}.yaml")
    ]
    assert {str(file.relative_to(SPECS)) for file in files} == RUNS.keys() | NOT_RUN


def test_counts_are_those_of_the_messages() -> None:
    compare(SPECS / "conveyor_gate.yaml", [ROOT / "tests/recording/conveyor_gate.mcap"])


@pytest.mark.long
@pytest.mark.no_replay("what runs do is replayed elsewhere")
@pytest.mark.parametrize("name", EACH)
def test_counts_are_those_of_the_messages_of_all(name: str, tmp_path: Path) -> None:
    files = [tmp_path / f"{seed}.mcap" for seed in range(len(RUNS[name]))]
    for seed, (file, duration_s) in enumerate(zip(files, RUNS[name], strict=True)):
        specc("run", SPECS / name, "--seed", seed, "--duration", duration_s, "--record", file)
    compare(SPECS / name, files)


@pytest.mark.long
@pytest.mark.no_replay("what runs do is replayed elsewhere")
@pytest.mark.parametrize("name", EVALUATED, ids=lambda name: Path(name).stem)
def test_truths_are_those_of_the_recorded_values(name: str, tmp_path: Path) -> None:
    file, duration_s = tmp_path / "run.mcap", EVALUATED[name]
    specc("run", SPECS / name, "--duration", duration_s, "--record", file, "--record-exact")
    result = pipeline.read_spec(str(SPECS / name))
    assert result.system is not None
    by_value = evaluated(result.system, file)
    content = json.loads(specc("coverage", file, "--format", "json").stdout)
    conditions = [item for item in content["items"] if item["kind"] == "condition"]
    assert len(conditions) > 10
    for item in conditions:
        key = "condition", item["subsystem"], item["name"], item["truth"]
        assert item["count"] == by_value[key], key


def compare(spec: Path, files: Sequence[Path]) -> None:
    """Compare what `specc coverage` says of recordings with what their messages say."""
    printed = specc("coverage", *files, "--format", "json")
    assert printed.returncode == 0, printed.stderr
    content = json.loads(printed.stdout)
    result = pipeline.read_spec(str(spec))
    assert result.system is not None
    by_hand, found = counted(result.system, result.sources, files), of_output(content["items"])
    assert by_hand.keys() <= found.keys()
    for key, count in found.items():
        if key[0] == "equation":  # steps here, runs there
            assert bool(count) is bool(by_hand[key]), key
        else:
            assert count == by_hand[key], key
    tried = [item for item in content["items"] if item["count"]]
    assert content["all"]["covered"] == len(tried)
    assert content["all"]["of"] == len(content["items"])
