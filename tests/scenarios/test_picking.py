"""Real picks, headless: the flagship as a user runs it."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc import pipeline
from tests.scenarios.runs import FLAGSHIP, run
from tests.seeds import SOAK
from tests.sweep.runs import swept, table


@pytest.mark.long
def test_a_beginning_without_faults_is_the_same_with_worker_and_with_operators_examined() -> None:
    """The short form of those of a whole pick, in which the objects are seen and the arm moves."""
    code, threaded = run(FLAGSHIP, "--seed", "0", "--duration", "1.5")
    _, inline = run(FLAGSHIP, "--seed", "0", "--duration", "1.5", "--inline", "--check-operators")
    assert (code, threaded["faults"], inline["faults"]) == (0, [], [])
    assert threaded["records_sha256"] == inline["records_sha256"]
    assert {"S1", "S2"} <= set(threaded["subsystems"]["irp.c"]["states_visited"])
    assert len(threaded["equations_executed"]) > 30


@pytest.mark.long
def test_a_cycle_picks_an_object() -> None:
    code, report = run(FLAGSHIP, "--seed", "0", "--cycles", "1")
    (cycle,) = report["cycles"]
    assert code == 0
    assert report["faults"] == []
    assert cycle["picked"]
    assert cycle["lift_height_m"] >= 0.15
    assert cycle["finger_clearance_m"] > 0.0
    assert cycle["max_force_N"] <= 20.0
    assert cycle["position_error_mm"] <= 3.0
    assert cycle["rotation_error_deg"] <= 3.0


@pytest.mark.parametrize(
    ("runs", "least"),
    [pytest.param(3, 3, marks=pytest.mark.long), pytest.param(10, 9, marks=SOAK)],
)
def test_nine_of_ten_picks_succeed(runs: int, least: int, tmp_path: Path) -> None:
    done = swept(tmp_path, FLAGSHIP, "--seeds", f"0:{runs}", "--cycles", "1")
    assert done.returncode == 0, done.stderr
    rows = table(tmp_path)
    assert [row["faults"] for row in rows] == ["0"] * runs
    good = [row for row in rows if row["success"] == "true"]
    assert len(good) >= least
    for row in good:
        assert float(row["cycle.max_force_N"]) <= 20.0
        assert float(row["cycle.finger_clearance_m"]) > 0.0
        assert float(row["cycle.position_error_mm"]) <= 3.0
        assert float(row["cycle.rotation_error_deg"]) <= 3.0


@pytest.mark.long
def test_a_dropped_object_is_found_and_picked_again() -> None:
    """The second cycle begins with the objects as the first one left them."""
    _, single = run(FLAGSHIP, "--seed", "0", "--cycles", "1")
    code, report = run(FLAGSHIP, "--seed", "0", "--cycles", "2")
    first, second = report["cycles"]
    assert code == 0
    assert report["faults"] == []
    assert first == single["cycles"][0]
    assert second["picked"]
    assert second["position_error_mm"] <= 3.0
    taken = report["subsystems"]["irp.c"]["transitions_taken"]
    assert set(taken.values()) == {2}


@pytest.mark.long
@pytest.mark.soak
def test_same_seed_same_records_with_worker_and_with_operators_examined_without() -> None:
    _, threaded = run(FLAGSHIP, "--seed", "0", "--cycles", "1")
    _, inline = run(FLAGSHIP, "--seed", "0", "--cycles", "1", "--inline", "--check-operators")
    assert inline["faults"] == []
    assert threaded["records_sha256"] == inline["records_sha256"]
    assert threaded["cycles"] == inline["cycles"]


@pytest.mark.long
def test_every_equation_of_the_paper_is_executed() -> None:
    _, report = run(FLAGSHIP, "--seed", "0", "--cycles", "1")
    assert set(range(4, 89)) - set(report["equations_executed"]) == set()


@pytest.mark.long
def test_every_state_is_visited() -> None:
    _, report = run(FLAGSHIP, "--seed", "0", "--cycles", "1")
    visited = {name: set(entry["states_visited"]) for name, entry in report["subsystems"].items()}
    result = pipeline.compile_spec(str(FLAGSHIP))
    assert result.system is not None
    for subsystem in result.system.subsystems:
        assert visited[subsystem.qualified_name] == {s.name for s in subsystem.states}


@pytest.mark.long
def test_without_a_graphics_stack() -> None:
    code, report = run(FLAGSHIP, "--seed", "2", "--cycles", "1", "--renderer", "raycast")
    assert code == 0
    assert report["cycles"][0]["picked"]
