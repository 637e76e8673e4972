"""Which changes of a text leave runs of it to be counted with those of another one."""

from __future__ import annotations

import pytest

from specc import pipeline
from specc.model.system import System
from specc.source import real_path
from specc.tools.coverage.same import differences
from tests.scenarios.runs import SPECS

SPEC = SPECS / "examples/tray_cell.yaml"
SAME = {
    "a comment": ("# A cell with an arm", "# Once more a cell with an arm"),
    "a disturbance": ("- every: 3[s]\n      when: historically(0.5", "- when: historically(0.5"),
    "a scene": ('part.x: ["0.3[m]", "0.36[m]"]', 'part.x: ["0.31[m]", "0.36[m]"]'),
    "a cycle": ("from: retreating, to: waiting", "from: homing, to: waiting"),
}
OTHER = {
    "a row": (
        "[task,               halted,   always,    paused]",
        "[task, halted, always, stopped]",
    ),
    "a condition": ("error: {lost: x.hand.w <= thin}", "error: {lost: x.hand.w >= thin}"),
    "a constant": ("most: {is: 3,", "most: {is: 4,"),
    "a function": ("close: {y.hand.w_d: 0}", "close: {y.hand.w_d: opened}"),
    "a requirement": ("that: always(cell.c.tries <= most)", "that: always(cell.c.tries < most)"),
    "a binding": ('noise: "1[mm]"', 'noise: "2[mm]"'),
}


def read(*change: str) -> System:
    text = SPEC.read_text(encoding="utf-8")
    if change:
        assert text.count(change[0]) == 1
        text = text.replace(*change)
    system = pipeline.read_spec(str(SPEC), {real_path(str(SPEC)): text}).system
    assert system is not None
    return system


@pytest.mark.long
def test_circumstances_of_runs_may_differ() -> None:
    assert {name: differences(read(), read(*change)) for name, change in SAME.items()} == {
        name: [] for name in SAME
    }


@pytest.mark.long
def test_machines_and_requirements_may_not() -> None:
    for name, change in OTHER.items():
        assert differences(read(), read(*change)), name
