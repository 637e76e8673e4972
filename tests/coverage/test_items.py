"""What a step covers: rows as they are written, both truths of conditions, foreign passages."""

from __future__ import annotations

import pytest
from specc_runtime.recording.steps import passage_of
from specc_runtime.subsystem import Transition

from specc import pipeline
from specc.model.system import System
from specc.tools.coverage import Coverage, ForeignRunError
from tests.scenarios.runs import SPECS


def system_of(name: str) -> System:
    system = pipeline.read_spec(str(SPECS / name)).system
    assert system is not None
    return system


def covered(system: System, name: str, *passages: tuple[str, str, str]) -> set[tuple[object, ...]]:
    """What passages cover, each with the label of its row."""
    (subsystem,) = [s for s in system.subsystems if s.qualified_name == name]
    labels = {"", *(row.label for row in subsystem.transitions)}
    assert {label for _, label, _ in passages} <= labels
    found = Coverage(system)
    found.add({name: dict.fromkeys(passages, 1)}, {})
    items = [item for item, count in found.counts.items() if count]
    return {
        (i.kind, i.name) if i.truth is None else (i.kind, i.name, i.truth)
        for i in items
        if i.kind != "function"
    }


def test_a_row_of_a_mode_is_one_in_all_its_states() -> None:
    system = system_of("examples/tray_cell.yaml")
    rows = [
        (state, f"{state} error tripped always -> stopped", "stopped")
        for state in ("lifting", "waiting")
    ]
    expected = {
        ("state", "stopped"),
        ("row", "powered error tripped always -> stopped"),
        ("condition", "powered.tripped", True),
    }
    assert covered(system, "cell.c", *rows) == expected == covered(system, "cell.c", rows[0])


def test_conditions_after_the_one_that_held_are_not_asked() -> None:
    system = system_of("examples/tray_cell.yaml")
    late = "approaching", "approaching error late always -> gave_up", "gave_up"
    assert covered(system, "cell.c", late) == {
        ("state", "gave_up"),
        ("row", "task error late always -> gave_up"),
        ("condition", "powered.tripped", False),
        ("condition", "task.halted", False),
        ("condition", "task.late", True),
    }


def test_a_row_that_resumes_is_one_for_all_states() -> None:
    system = system_of("examples/tray_cell.yaml")
    rows = [
        ("paused", f"paused terminal always -> {state} by resume(task)", state)
        for state in ("carrying", "lifting")
    ]
    found = [covered(system, "cell.c", row) for row in rows]
    (row,) = {item for item in found[0] & found[1] if item[0] == "row"}
    assert row == ("row", "paused terminal always -> resume(task)")


def test_of_several_rows_one_held_and_the_others_did_not() -> None:
    system = system_of("architectures/three_tier.yaml")
    row = "overseeing", "overseeing terminal more_goals -> taking_next", "taking_next"
    assert covered(system, "planner.c", row) >= {
        ("condition", "more_goals", True),
        ("condition", "blocked", False),
        ("condition", "more_commands", False),
    }


def test_the_first_period_asks_nothing() -> None:
    system = system_of("conveyor_gate.yaml")
    assert covered(system, "gate.c", ("", "", "closed")) == {("state", "closed")}


@pytest.mark.parametrize(
    ("name", "passage"),
    [
        ("gate.d", ("", "", "closed")),
        ("gate.c", ("", "", "open")),
        ("gate.c", ("closed", "", "halting")),
        ("gate.c", ("closed", "halting terminal always -> opening", "halting")),
        ("gate.c", ("closed", "closed terminal never -> halting", "halting")),
        ("gate.c", ("closed", "closed terminal always -> halting", "closed")),
    ],
)
def test_what_the_specification_does_not_have_is_refused(
    name: str, passage: tuple[str, str, str]
) -> None:
    with pytest.raises(ForeignRunError):
        Coverage(system_of("conveyor_gate.yaml")).add({name: {passage: 1}}, {})


def test_rows_that_resume_a_mode_share_their_condition_in_messages() -> None:
    rows = [
        Transition("paused", "terminal", condition, target, "task" if condition == "ok" else "")
        for condition, target in (("ok", "lifting"), ("ok", "carrying"), ("otherwise", "homing"))
    ]
    ends = {"paused": ("pause.terminal", "never", "")}
    for number, row in enumerate(rows):
        conditions = passage_of(rows, ends, "paused", number, row.target)["conditions"]
        assert conditions["ok"] is (row.condition == "ok")
        assert conditions["otherwise"] is (row.condition == "otherwise")
