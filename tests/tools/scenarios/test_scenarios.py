"""Scenarios: their runs are those of `specc run`, and the results say what came of them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from specc import pipeline
from tests.commands import specc
from tests.tools.scenarios.belt import (
    START,
    STOP,
    STOPPED,
    SYSTEM,
    TASK,
    results_of,
    scenario,
    single,
    spec,
)

PASSES = "always(desk.c.v <= 0.2[m/s])"
FAILS = "within(2[s], desk.c.v > 0.3[m/s])"


def by_name(results: Any) -> dict[str, Any]:
    return {entry["name"]: entry for entry in results["scenarios"]}


@pytest.mark.long
def test_results_are_those_of_single_runs(tmp_path: Path) -> None:
    """Of the same seeds: records, verdicts, times and margins."""
    some = scenario(
        "some",
        STOPPED,
        "within(2.4[s], desk.c.v < 0.05[m/s] and not desk.R.panel.go)",
        "always(not desk.R.panel.go implies once(0.9[s], state(desk.c) == S0))",
        panel=f"{START}, {STOP}",
        more='    set: {fast: "0.15[m/s]"}\n    seeds: 2..3\n    success: 1 of 3\n',
    )
    spec(tmp_path, some)
    found = by_name(results_of(tmp_path, "--out", "specc-test"))
    assert {run["passed"] for run in found["some"]["runs"]} == {True, False}
    for run in found["some"]["runs"]:
        report = single(tmp_path, run["seed"], "belt.yaml", "--scenario", "some")
        violated = [
            {"formula": each["that"], "time_s": each["time_s"], "margin": each["margin"]}
            for each in report["requirements"]
            if each["verdict"] == "violated"
        ]
        assert run["records_sha256"] == report["records_sha256"]
        assert run["violated"] == violated
    assert len({run["records_sha256"] for run in found["some"]["runs"]}) > 1


def test_a_scenario_is_what_could_be_written_in_the_task(tmp_path: Path) -> None:
    """With what it sets on the command line, and what it expects among the requirements."""
    panel = f"{START}, {STOP}"
    usual = scenario("usual", STOPPED, panel=panel, more='    set: {fast: "0.15[m/s]"}\n')
    alone = scenario("alone", STOPPED, panel=panel, more="    undisturbed: true\n")
    spec(tmp_path, usual, alone)
    happens = (
        f"    - {START[:-1]}, because: of the test}}\n    - {STOP[:-1]}, because: of the test}}\n"
    )
    usually = '    - {at: "2[s]", adjust: {pace: 0.25}, because: of the test}\n'
    require = TASK[TASK.index("require:") :] + f"  - {{that: '{STOPPED}', because: of the test}}\n"
    for name, own in (("usual", usually), ("alone", "")):
        task = f"{TASK[: TASK.index('disturb:')]}disturb:\n{own}{happens}{require}"
        (tmp_path / "written.yaml").write_text(f"{SYSTEM}{task}")
        values = ["--set", "fast=0.15[m/s]"] if name == "usual" else []
        for seed in (1, 2):
            ours = single(tmp_path, seed, "belt.yaml", "--scenario", name)
            theirs = single(tmp_path, seed, "written.yaml", "--duration", 3, *values)
            for key in ("records_sha256", "disturbances", "panel", "set", "simulated_s"):
                assert ours.get(key) == theirs.get(key), (name, key)
            assert ours["requirements"] == theirs["requirements"]


def test_generated_code_does_not_depend_on_scenarios(tmp_path: Path) -> None:
    some = scenario("some", PASSES, panel=f"{START}, {STOP}")
    (tmp_path / "with").mkdir()
    (tmp_path / "without").mkdir()
    paths = spec(tmp_path / "with", some), spec(tmp_path / "without")
    files = [pipeline.build(str(path)).files for path in paths]
    assert files[0] and files[0] == files[1]


@pytest.mark.long
def test_what_is_open_or_did_not_happen_does_not_pass(tmp_path: Path) -> None:
    """What happens by chance need not happen."""
    never = '{when: "desk.c.v > 0.3[m/s]", turn: {go: false}}'
    spec(
        tmp_path,
        scenario("open", "within(9[s], desk.c.v > 0.3[m/s])"),
        scenario("waits", "always(desk.R.panel.go or state(desk.c) == S0)", panel=never),
        scenario("late", PASSES, panel='{at: "9[s]", press: start}'),
        scenario("chance", PASSES, panel='{at: "1[s]", probability: 0, press: start}'),
    )
    runs = {n: entry["runs"][0] for n, entry in by_name(results_of(tmp_path, code=1)).items()}
    assert {name: run["fault"] for name, run in runs.items()} == {
        "open": "undecided at the end of the run: within(9[s], desk.c.v > 0.3[m/s])",
        "waits": "never happened: turn desk.R.panel.go when desk.c.v > 0.3[m/s]",
        "late": "never happened: press desk.R.panel.start",
        "chance": None,
    }
    assert [name for name, run in runs.items() if run["passed"]] == ["chance"]
    assert not any(run["violated"] for run in runs.values())


@pytest.mark.long
def test_requirements_of_the_system_count_as_well(tmp_path: Path) -> None:
    path = spec(tmp_path, scenario("fast", "within(3[s], desk.c.v > 0.1[m/s])"))
    path.write_text(path.read_text().replace("desk.c.v < 0.21[m/s]", "desk.c.v < 0.19[m/s]"))
    run = by_name(results_of(tmp_path, code=1))["fast"]["runs"][0]
    assert [each["formula"] for each in run["violated"]] == ["always(desk.c.v < 0.19[m/s])"]
    assert run["violated"][0]["margin"] == pytest.approx(-0.01)


@pytest.mark.long
def test_the_share_of_runs_decides(tmp_path: Path) -> None:
    early = "always(desk.R.panel.go or once(0.9[s], state(desk.c) == S0))"
    seeds = "    seeds: 0..5\n"
    panel = f"{START}, {STOP}"
    every = scenario("every", early, panel=panel, more=seeds)
    few = scenario("few", early, panel=panel, more=f"{seeds}    success: 1 of 12\n")
    spec(tmp_path, every, few)
    done = specc("test", "belt.yaml", "--budget", 0, "--out", "all", cwd=tmp_path)
    assert done.returncode == 1
    found = by_name(json.loads((tmp_path / "all/results.json").read_text()))
    rates = [entry["rate"] for entry in found.values()]
    assert rates[0] == rates[1] and 0 < rates[0]["passed"] < rates[0]["of"] == 6
    assert rates[0]["low"] < rates[0]["passed"] / 6 < rates[0]["high"]
    assert (found["every"]["passed"], found["few"]["passed"]) == (False, True)
    assert found["few"]["success"] == {"required": 1, "of": 12}


@pytest.mark.long
def test_each_failure_is_recorded_and_named(tmp_path: Path) -> None:
    """What is told leads to the same violation again, and to the recording."""
    spec(tmp_path, scenario("broken", FAILS, more="    seeds: 3..4\n"), scenario("whole", PASSES))
    done = specc("test", "belt.yaml", "--budget", 0, cwd=tmp_path)
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines if "of" in line.split()[2:4]] == ["FAILED", "passed"]
    (again,) = (line.split("again: ")[1] for line in lines if "again: " in line)
    assert again == "specc run belt.yaml --scenario broken --seed 3"
    assert specc(*again.split()[1:], cwd=tmp_path).returncode == 1
    folder = tmp_path / "specc-test"
    assert {file.name for file in folder.iterdir()} == {
        "results.json",
        "broken-3.mcap",
        "broken-4.mcap",
    }
    runs = by_name(json.loads((folder / "results.json").read_text()))["broken"]["runs"]
    assert [run["recording"] for run in runs] == ["broken-3.mcap", "broken-4.mcap"]
    assert "specc view specc-test/broken-3.mcap --spec belt.yaml" in done.stdout
    replayed = specc("replay", folder / "broken-3.mcap", "--spec", "belt.yaml", cwd=tmp_path)
    assert "steps are the same" in replayed.stdout, replayed.stderr
    moment = f"{folder / 'broken-3.mcap'}@2.9"
    told = specc("why", moment, "--spec", "belt.yaml", cwd=tmp_path).stdout
    assert f"violated at 0 s: {FAILS}" in told and "because: of the test" in told


@pytest.mark.long
def test_results_of_an_earlier_test_do_not_stay(tmp_path: Path) -> None:
    path = spec(tmp_path, scenario("one", FAILS))
    assert results_of(tmp_path, code=1) is not None
    (tmp_path / "specc-test/mine.txt").write_text("mine")
    path.write_text(path.read_text().replace("0.3[m/s]", "0.1[m/s]"))
    assert results_of(tmp_path) is None
    assert [file.name for file in (tmp_path / "specc-test").iterdir()] == ["mine.txt"]


@pytest.mark.long
def test_those_that_failed_are_run_again(tmp_path: Path) -> None:
    path = spec(tmp_path, scenario("one", FAILS), scenario("two", PASSES), scenario("three", FAILS))
    results_of(tmp_path, code=1)
    path.write_text(path.read_text().replace("0.3[m/s]", "0.1[m/s]", 1))
    found = by_name(results_of(tmp_path, "--last-failed", code=1))
    assert {name: entry["passed"] for name, entry in found.items()} == {
        "one": True,
        "three": False,
    }
    assert by_name(results_of(tmp_path, "--last-failed", code=1)).keys() == {"three"}


@pytest.mark.long
def test_what_failed_in_another_specification_does_not_choose(tmp_path: Path) -> None:
    """It says what is run again, and runs all where nothing of it is there any more."""
    arguments = ("test", "belt.yaml", "--budget", 0, "--last-failed", "--out", "specc-test")
    spec(tmp_path, scenario("one", FAILS), scenario("two", PASSES))
    results_of(tmp_path, code=1)
    done = specc(*arguments, cwd=tmp_path)
    assert "run again: 1 scenario\n" in done.stderr
    spec(tmp_path, scenario("renamed", FAILS), scenario("two", PASSES))
    done = specc(*arguments, cwd=tmp_path)
    assert "those that did not pass are not there any more" in done.stderr
    found = by_name(json.loads((tmp_path / "specc-test/results.json").read_text()))
    assert found.keys() == {"renamed", "two"}
    spec(tmp_path, scenario("renamed", PASSES), scenario("two", PASSES), name="other")
    done = specc("test", "other.yaml", *arguments[2:], cwd=tmp_path)
    assert "nothing is known of scenarios that failed; all are run" in done.stderr
    assert "passed  two" in done.stdout


@pytest.mark.long
def test_names_choose(tmp_path: Path) -> None:
    spec(tmp_path, scenario("slow_belt", FAILS), scenario("fast_belt", PASSES))
    assert by_name(results_of(tmp_path, "-k", "slow", code=1)).keys() == {"slow_belt"}
    found = by_name(results_of(tmp_path, "-k", "fast"))
    assert {name: entry["passed"] for name, entry in found.items()} == {
        "slow_belt": False,
        "fast_belt": True,
    }
    assert (tmp_path / "specc-test" / found["slow_belt"]["runs"][0]["recording"]).exists()
    done = specc("test", "belt.yaml", "-k", "nothing", "--budget", 0, cwd=tmp_path)
    assert done.returncode == 2 and "no scenario has 'nothing' in its name" in done.stderr
    assert "there are slow_belt, fast_belt" in done.stderr


@pytest.mark.long
def test_the_first_failure_ends_the_test(tmp_path: Path) -> None:
    many = scenario("many", PASSES, more="    seeds: 0..400\n")
    spec(tmp_path, scenario("broken", FAILS), many)
    found = by_name(results_of(tmp_path, "--fail-fast", "--jobs", 1, code=1))
    assert not found["broken"]["passed"]
    assert found["broken"]["runs"][0]["recording"] == "broken-0.mcap"
    assert len(found["many"]["runs"]) < 401 and found["many"]["passed"] is None


@pytest.mark.long
def test_each_failure_is_recorded_once_after_the_first_one(tmp_path: Path) -> None:
    """Recordings take longer than the test waits between two looks at them."""
    long = scenario("long", FAILS, more="    seeds: 0..3\n").replace("3[s]", "400[s]")
    spec(tmp_path, long)
    found = by_name(results_of(tmp_path, "--fail-fast", "--jobs", 1, code=1))
    assert found["long"]["runs"][0]["recording"] == "long-0.mcap"


@pytest.mark.long
def test_a_specification_that_could_not_be_used_is_run_after_a_failure(tmp_path: Path) -> None:
    spec(tmp_path, scenario("one", FAILS))
    spec(tmp_path, scenario("two", "always(desk.c.speed < 1)"), name="other")
    assert specc("test", ".", "--budget", 0, cwd=tmp_path).returncode == 1
    spec(tmp_path, scenario("one", PASSES))
    spec(tmp_path, scenario("two", FAILS), name="other")
    done = specc("test", ".", "--budget", 0, "--last-failed", cwd=tmp_path)
    assert done.returncode == 1 and "could not be used the last time" in done.stderr
    assert "passed  one" in done.stdout and "FAILED  two" in done.stdout


@pytest.mark.long
def test_what_an_interrupted_test_has_found_is_written(tmp_path: Path) -> None:
    """What it did not decide is no failure, and is run with `--last-failed`."""
    endless = scenario("endless", PASSES).replace("3[s]", "86400[s]")
    spec(tmp_path, scenario("broken", FAILS), scenario("whole", PASSES), endless)
    arguments = ("belt.yaml", "--budget", "0", "--jobs", "2", "--junit", "all.xml")
    process = subprocess.Popen(
        [sys.executable, "-m", "specc", "test", *arguments],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while process.poll() is None and not (tmp_path / "specc-test/broken-0.mcap").exists():
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate()
    assert process.returncode == 130
    found = by_name(json.loads((tmp_path / "specc-test/results.json").read_text()))
    assert {name: entry["passed"] for name, entry in found.items()} == {
        "broken": False,
        "whole": True,
        "endless": None,
    }
    assert out.count("FAILED") == 1 and "1 scenario not run" in out
    cases = {case.get("name"): case for case in ET.parse(tmp_path / "all.xml").iter("testcase")}
    assert [name for name, case in cases.items() if case.find("failure") is not None] == ["broken"]
    assert [name for name, case in cases.items() if case.find("skipped") is not None] == ["endless"]
    spec(tmp_path, scenario("broken", PASSES), scenario("endless", PASSES))
    assert by_name(results_of(tmp_path, "--last-failed", "--out", "specc-test")).keys() == {
        "broken",
        "endless",
    }


def test_errors_in_a_specification_are_a_failure(tmp_path: Path) -> None:
    path = spec(tmp_path, scenario("one", "always(desk.c.speed < 1)"))
    done = specc("test", path, cwd=tmp_path)
    assert done.returncode == 1 and "`speed`" in done.stderr and "INVALID" in done.stdout
    done = specc("test", tmp_path / "none.yaml", cwd=tmp_path)
    assert done.returncode == 2 and "E0001" in done.stderr


def test_what_a_scenario_sets_may_be_refused(tmp_path: Path) -> None:
    spec(tmp_path, scenario("odd", PASSES, more="    set: {pace: 1.5}\n"))
    done = specc("test", "belt.yaml", "--budget", 0, cwd=tmp_path)
    assert done.returncode == 1
    assert "scenario odd cannot be run" in done.stderr and "error[" in done.stderr


@pytest.mark.long
def test_a_folder_has_results_for_each_specification(tmp_path: Path) -> None:
    spec(tmp_path, scenario("one", FAILS))
    (tmp_path / "inner").mkdir()
    spec(tmp_path / "inner", scenario("two", PASSES), name="other")
    done = specc("test", ".", "--budget", 0, "--junit", "all.xml", cwd=tmp_path)
    assert done.returncode == 1
    found = json.loads((tmp_path / "specc-test/belt/results.json").read_text())
    assert found["specification"] == "belt.yaml"
    assert not (tmp_path / "specc-test/inner").exists()
    suites = ET.parse(tmp_path / "all.xml").getroot()
    cases = [(s.get("name"), c.get("name"), c.find("failure") is None) for s in suites for c in s]
    assert set(cases) == {
        ("belt.yaml", "validate", True),
        ("belt.yaml", "one", False),
        ("inner/other.yaml", "validate", True),
        ("inner/other.yaml", "two", True),
    }


@pytest.mark.long
def test_it_explores(tmp_path: Path) -> None:
    spec(tmp_path)
    done = specc("test", "belt.yaml", "--junit", "all.xml", cwd=tmp_path)
    assert done.returncode == 0 and "explored" in done.stdout
    names = [case.get("name") for case in ET.parse(tmp_path / "all.xml").getroot().iter("testcase")]
    assert names == ["validate", "explore"]


def test_a_scenario_that_there_is_not_is_named(tmp_path: Path) -> None:
    spec(tmp_path, scenario("slow", PASSES))
    done = specc("run", "belt.yaml", "--scenario", "slwo", cwd=tmp_path)
    assert done.returncode == 2 and "did you mean `slow`?" in done.stderr


def test_a_specification_without_scenarios_says_so(tmp_path: Path) -> None:
    spec(tmp_path)
    done = specc("run", "belt.yaml", "--scenario", "slow", cwd=tmp_path)
    assert done.returncode == 2 and "has none" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--junit", "none/all.xml"), "none/all.xml cannot be written: there is no folder none"),
        (("--junit", "."), ". is a folder"),
        (("--out", "belt.yaml"), "belt.yaml is no folder"),
    ],
)
def test_where_nothing_can_be_written_nothing_is_run(
    tmp_path: Path, arguments: tuple[str, str], words: str
) -> None:
    spec(tmp_path, scenario("slow", PASSES))
    done = specc("test", "belt.yaml", *arguments, cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr
    assert not done.stdout and [each.name for each in tmp_path.iterdir()] == ["belt.yaml"]
