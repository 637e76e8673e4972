"""Tables of many runs: results of tests and folders of sweeps, which strangers may have written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from specc.refusal import Refused
from specc.tools.report.results import Section, results_at
from specc.tools.sweep.table import key_of

RUN = {"seed": 0, "passed": True, "violated": [], "fault": None, "recording": None}
SCENARIO = {
    "name": "stop",
    "because": "nobody is hit",
    "success": {"required": 2, "of": 2},
    "passed": False,
    "rate": {"passed": 1, "of": 2, "low": 0.09, "high": 0.91},
    "runs": [
        {**RUN, "recording": "stop-0.mcap"},
        {
            **RUN, "seed": 1, "passed": False, "recording": "stop-1.mcap",
            "violated": [{"formula": "always(a)", "time_s": 1.5, "margin": -0.25}],
        },
    ],
}  # fmt: skip


def _written(folder: Path, *scenarios: Any, **more: Any) -> Path:
    data = {"format": "specc-test", "version": 1, "specification": "a.yaml"}
    folder.mkdir(exist_ok=True)
    file = folder / "results.json"
    file.write_text(json.dumps({**data, "scenarios": scenarios, **more}), encoding="utf-8")
    return file


def _rows(table: Any) -> list[list[str]]:
    return [row["cells"] for row in table["rows"]]


def test_scenarios_have_their_rates_and_runs_lead_to_their_sections(tmp_path: Path) -> None:
    file = _written(tmp_path, SCENARIO)
    found = results_at(str(file))
    assert found is not None
    assert found.recordings == [tmp_path / "stop-1.mcap", tmp_path / "stop-0.mcap"]
    scenarios, runs = found.tables([Section(0, str(tmp_path / "stop-1.mcap"), None)])
    assert _rows(scenarios) == [
        ["stop", "failed", "nobody is hit", "2 of 2", "1 of 2", "9.0 % to 91.0 %"]
    ]
    assert _rows(runs) == [
        ["stop, seed 0", "passed", "", "", "", "", "stop-0.mcap (not in this report)"],
        ["stop, seed 1", "failed", "always(a)", "1.5 s", "-0.25", "", "stop-1.mcap"],
    ]
    assert [(row["is_bad"], row["run"]) for row in runs["rows"]] == [(False, None), (True, 0)]
    assert results_at(str(tmp_path)) is not None, "its folder stands for the file"


def test_a_scenario_that_was_cut_has_not_failed(tmp_path: Path) -> None:
    cut = {**SCENARIO, "passed": None, "success": {"required": 9, "of": 9}}
    found = results_at(str(_written(tmp_path, cut)))
    assert found is not None
    (row,) = found.tables([])[0]["rows"]
    assert (row["cells"][1], row["is_bad"]) == ("cut", False)


@pytest.mark.parametrize(
    "name",
    ["../other.mcap", "/etc/hostname.mcap", "a\0.mcap", "run.txt", "link/x.mcap", 3, None, ["a"]],
)
def test_a_recording_elsewhere_is_not_opened(name: object, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    file = _written(folder, {**SCENARIO, "runs": [{**RUN, "recording": name}]})
    (folder / "link").symlink_to(tmp_path)
    found = results_at(str(file))
    assert found is not None and found.recordings == []


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", "null", '{"format": "other"}', "[" * 100_000, '{"format": "specc-test"}'],
)
def test_what_is_no_result_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "results.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(Refused, match="specc test"):
        results_at(str(file))


ODD: list[Any] = [None, 3, "x", [], {}, {"runs": 3}, {"runs": [None, {}, {"violated": [1, {}]}]}]


@pytest.mark.parametrize("scenario", ODD)
def test_odd_results_have_tables_all_the_same(scenario: Any, tmp_path: Path) -> None:
    found = results_at(str(_written(tmp_path, scenario, {**SCENARIO, "rate": {"low": "a"}})))
    assert found is not None
    scenarios, _ = found.tables([])
    assert [row["cells"][0] for row in scenarios["rows"]][-1:] == ["stop"]


def _sweep(folder: Path) -> Path:
    folder.mkdir()
    run = {"success": True, "ended": "completed", "reason": "", "simulated_s": 6.0}
    lines = [
        {"set": {"v": v}, "seed": seed, "run": {**run, "success": v == "1[m]"}}
        for v in ("1[m]", "2[m]")
        for seed in (0, 1)
    ]
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    (folder / "runs.jsonl").write_text(f'{text}{{"set"', encoding="utf-8")
    return folder


def test_a_sweep_has_its_settings_and_runs(tmp_path: Path) -> None:
    folder = _sweep(tmp_path / "night")
    for word in (folder, folder / "runs.csv", folder / "sweep.json"):
        found = results_at(str(word))
        assert found is not None
        section = Section(4, "x.mcap", key_of({"v": "2000[mm]"}, 1))
        settings, runs = found.tables([section])
        assert [row[:3] for row in _rows(settings)] == [
            ["1[m]", "2", "100.0 %"],
            ["2[m]", "2", "0.0 %"],
        ]
        assert [row[:3] for row in _rows(runs)] == [
            ["seed 0", "yes", "1[m]"],
            ["seed 1", "yes", "1[m]"],
            ["seed 0", "no", "2[m]"],
            ["seed 1", "no", "2[m]"],
        ]
        assert [row["run"] for row in runs["rows"]] == [None, None, None, 4]


@pytest.mark.parametrize("line", ["{}", "[]", '{"set": {}, "seed": 0, "run": {}}', "[" * 100_000])
def test_lines_that_are_of_no_run_are_refused(line: str, tmp_path: Path) -> None:
    folder = _sweep(tmp_path / "night")
    (folder / "runs.jsonl").write_text(f"{line}\n", encoding="utf-8")
    with pytest.raises(Refused, match="line 1 is not of a run"):
        results_at(str(folder))


def test_a_recording_is_no_table(tmp_path: Path) -> None:
    assert results_at("run.mcap") is None
    with pytest.raises(Refused, match=r"neither results\.json"):
        results_at(str(tmp_path))
