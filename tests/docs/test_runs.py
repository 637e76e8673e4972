"""`docs/runs.md` lists every key of reports: those of the code, no more and no fewer."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import specc_runtime.faults as faults
from specc_runtime.disturbances import Disturbances
from specc_runtime.live import Change
from specc_runtime.report import (
    Report,
    Statistics,
    TakenTransition,
    Tally,
    real_time_data,
    subsystem_data,
)
from specc_runtime.task import Cycles
from specc_runtime.timing import Quantiles

from tests.commands import ROOT, specc

PAGE = (ROOT / "docs/runs.md").read_text()


def _tables(page: str) -> list[list[str]]:
    """The names in the first column of each table whose head is `key`."""
    found = re.findall(r"^\| key \| .*\n\| --- .*\n((?:\|.*\n)+)", page, re.MULTILINE)
    return [
        [name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1])]
        for table in found
    ]


def _section(title: str) -> str:
    return PAGE.split(f"## {title}\n", 1)[1].split("\n## ", 1)[0]


def test_every_key_is_told() -> None:
    system: Any = SimpleNamespace(task=None)
    cycles = Cycles(system, None, lambda: 1.0)
    cycles.end("fault")
    subsystem: Any = SimpleNamespace(name="a.c", transitions=(), modes={"S0": ("m",)})
    keys = [
        [part.name for part in fields(Report)],
        list(cycles.results[0]),
        list(subsystem_data(Tally(subsystem, "S0"), 0.0, 0.0)),
        [part.name for part in fields(TakenTransition)],
        ["because", "began_s", "times"],
        [*(part.name for part in fields(Change)), "time_s"],
    ]
    assert [sorted(names) for names in _tables(_section("Report"))] == list(map(sorted, keys))
    told: Any = Disturbances.__new__(Disturbances)
    told._all = [SimpleNamespace(what=SimpleNamespace(because="why"), first_s=None, times=0)]
    assert sorted(told.as_data()[0]) == sorted(keys[-2])


def test_every_key_of_faults_outputs_and_requirements_is_told(tmp_path: Path) -> None:
    run = tmp_path / "run.json"
    specc("run", ROOT / "specs/conveyor_gate.yaml", "--duration", 0.2, "--report", run)
    report = json.loads(run.read_text())
    (told,) = _tables(_section("Safe outputs"))
    assert all(sorted(told) == sorted(output) for output in report["last_outputs"].values())
    told = _tables(_section("Faults"))[0]
    fault = faults.Fault("a.c", "S0", "it failed")
    fault.modes = ("m",)
    assert sorted(told) == sorted(fault.as_data())
    (told,) = _tables(PAGE.split("## Report\n")[0])
    assert report["requirements"]
    assert all(
        sorted(told) == sorted({*each, "name", "contract"}) for each in report["requirements"]
    )
    (told,) = _tables(_section("Real time"))
    besides = "tick_us", "ticks", "steps", "punctual"
    assert sorted(told) == sorted((*real_time_data(Quantiles(), {}, None), *besides))


def test_the_last_rows_and_the_time_in_states() -> None:
    """Repetitions are one entry; what a snapshot keeps goes on as it was."""
    rows = ("a terminal x -> b", "b terminal x -> a", "a terminal y -> a")
    modes = {"a": ("inner", "outer"), "b": ("outer",)}
    subsystem: Any = SimpleNamespace(name="m.c", transitions=rows, modes=modes)
    system: Any = SimpleNamespace(subsystems=[SimpleNamespace(subsystem=subsystem)])
    whole, first = Statistics(system), Statistics(system)
    steps = [(-1, "a"), (2, "a"), (2, "a"), (0, "b"), (-1, "b"), (1, "a"), (0, "b")]
    second = Statistics(system)
    for i, (row, state) in enumerate(steps):
        record: Any = SimpleNamespace(subsystem="m.c", transition=row, state=state, time_s=0.1 * i)
        whole(record)
        (first if i < 4 else second)(record)
        if i == 3:
            second.restore(first.saved())
    tally = whole.tallies["m.c"]
    told = subsystem_data(tally, 0.0, 0.75)
    assert told == subsystem_data(second.tallies["m.c"], 0.0, 0.75)
    assert told["time_in_states_s"] == {"a": 0.4, "b": 0.35}
    assert told["time_in_modes_s"] == {"inner": 0.4, "outer": 0.75}
    assert [(t["transition"], t["times"]) for t in told["last_transitions"]] == [
        (rows[2], 2), (rows[0], 1), (rows[1], 1), (rows[0], 1),
    ]  # fmt: skip
    old = first.saved()
    for key in ("since", "spent", "recent"):
        del old["m.c"][key]
    for _ in range(2):  # a recording of such a run does not know them either
        later = Statistics(system)
        later.restore(old)
        assert "time_in_states_s" not in subsystem_data(later.tallies["m.c"], 0.0, 0.75)
        old = later.saved()
