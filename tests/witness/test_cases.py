"""A scenario of every case fails for the reason reported, and passes once that is mended."""

from __future__ import annotations

from pathlib import Path

import pytest
from specc_runtime.faults import UndecidedTransition

from specc.pipeline import compile_spec
from tests.seeds import short
from tests.witness.runs import CASES, mended, run, states_of, written

MACHINES = CASES / "machines"
FILES = sorted(path for code in ("E0601", "E0602", "E0603") for path in MACHINES.glob(f"{code}-*"))


def rows_named(case: Path, state: str) -> tuple[str, ...]:
    """The rows of a state that the report says apply together; none if it says that none does."""
    result = compile_spec(str(case))
    (finding,) = result.diagnostics
    if finding.code != "E0602":
        return ()
    assert result.system is not None
    places = finding.primary, finding.related[0].place
    table = (row for s in result.system.subsystems for row in s.transitions)
    return tuple(row.label for row in table if row.place in places and row.source == state)


@pytest.mark.parametrize("case", short(FILES, *range(0, len(FILES), 5)), ids=lambda path: path.stem)
def test_it_fails_for_the_reason_reported(case: Path, tmp_path: Path) -> None:
    scenarios = written(case, tmp_path / "out")
    (finding,) = compile_spec(str(case)).diagnostics
    assert len(scenarios) == states_of(finding)
    for scenario in scenarios:
        error = run(scenario, tmp_path)
        assert isinstance(error, UndecidedTransition)
        assert case.stem[:5] in scenario.name
        assert f"__{error.state}__{error.cause}__" in scenario.name
        if len(scenarios) == 1:
            assert error.rows == rows_named(case, error.state)
        else:
            assert len(error.rows) == (2 if case.stem.startswith("E0602") else 0)


@pytest.mark.parametrize("case", short(FILES, *range(1, len(FILES), 5)), ids=lambda path: path.stem)
def test_the_repair_of_the_report_makes_it_pass(case: Path, tmp_path: Path) -> None:
    copy = tmp_path / "spec.yaml"
    copy.write_text(case.read_text(encoding="utf-8"), encoding="utf-8")
    scenarios = written(copy, tmp_path / "out")
    before = [scenario.read_bytes() for scenario in scenarios]
    assert all(run(scenario, tmp_path) for scenario in scenarios)
    (finding,) = compile_spec(str(copy)).diagnostics
    copy.write_text(mended(copy.read_text(encoding="utf-8"), finding), encoding="utf-8")
    failures = [run(scenario, tmp_path) for scenario in scenarios]
    assert not any(failures) or left(copy, finding.code)
    assert [scenario.read_bytes() for scenario in scenarios] == before


def left(spec: Path, code: str) -> bool:
    """Whether other pairs of rows still overlap: a repair narrows one row."""
    return [d.code for d in compile_spec(str(spec)).diagnostics] == [code] == ["E0602"]


def test_the_failure_names_the_places_in_the_specification(tmp_path: Path) -> None:
    (scenario,) = written(MACHINES / "E0602-both-fresh.yaml", tmp_path / "out")
    error = run(scenario, tmp_path)
    assert error is not None
    notes = [note.rpartition("/")[2] for note in error.__notes__]
    assert notes == [
        "E0602-both-fresh.yaml:38: state S0",
        "E0602-both-fresh.yaml:41: S0 terminal d_came -> S0",
        "E0602-both-fresh.yaml:42: S0 terminal go_came -> S0",
    ]


def test_an_assumption_repairs_as_well(tmp_path: Path) -> None:
    copy = tmp_path / "spec.yaml"
    text = (MACHINES / "E0602-both-fresh.yaml").read_text(encoding="utf-8")
    copy.write_text(text, encoding="utf-8")
    (scenario,) = written(copy, tmp_path / "out")
    assume = 'assume: [{that: "not (fresh(x.c.d) and fresh(x.c.go))", because: they alternate}]'
    copy.write_text(f"{text}        {assume}\n", encoding="utf-8")
    assert run(scenario, tmp_path) is None


def test_scenarios_are_the_same_every_time(tmp_path: Path) -> None:
    case = MACHINES / "E0601-equal.yaml"
    texts = [written(case, tmp_path / "out")[0].read_bytes() for _ in range(2)]
    assert texts[0] == texts[1]
