"""One period: priority of errors, choice of the row, faults, monitors."""

from __future__ import annotations

from typing import Any

import pytest
from specc_runtime.faults import UndecidedTransition

from tests.lower.models import Spec, running


def spec() -> Spec:
    return Spec(x={"c.a": "real", "c.b": "real"}, y={"E.u": "real"})


def stepped(subsystem: Any, a: float, b: float) -> int:
    subsystem.x.c_a, subsystem.x.c_b = a, b
    return subsystem.step()


def machine(proved: bool) -> Any:
    s = spec()
    system = s.system(
        [
            s.behaviour("one", {"E.u": "1"}, terminal="x.c.a > 0", error="x.c.b > 0"),
            s.behaviour("two", {"E.u": "2"}, terminal="x.c.a > 0"),
            s.behaviour("three", {"E.u": "3"}),
        ],
        [
            ("one", "terminal", "x.c.a > 5", "two"),
            ("one", "terminal", "x.c.a < 5", "three"),
            ("one", "error", "True", "three"),
            ("two", "terminal", "True", "one"),
            ("three", "terminal", "True", "one"),
        ],
    )
    return running(system, {}, proved=proved)[0]


@pytest.mark.parametrize("proved", [True, False])
def test_error_has_priority_and_one_row_is_taken(proved: bool) -> None:
    subsystem = machine(proved)
    found = []
    for a, b in ((9, 9), (0, 0), (9, 0), (0, 0), (1, 0), (1, 0), (9, 9), (1, 0), (1, 0)):
        found.append((stepped(subsystem, a, b), subsystem.state, subsystem.y.E_u))
    assert found == [
        (-1, "one", 1),
        (-1, "one", 1),
        (0, "two", 2),
        (-1, "two", 2),
        (3, "one", 1),
        (1, "three", 3),
        (4, "one", 1),
        (1, "three", 3),
        (4, "one", 1),
    ]


def test_no_enabled_row_is_a_fault_unless_it_was_proved_impossible() -> None:
    subsystem = machine(proved=False)
    stepped(subsystem, 0, 0)
    with pytest.raises(UndecidedTransition) as fault:
        stepped(subsystem, 5, 0)
    assert fault.value.rows == ()
    assert (fault.value.state, fault.value.cause) == ("one", "terminal")
    assert fault.value.inputs["c_a"] == 5
    assert subsystem.state == "one"


def test_two_enabled_rows_are_a_fault_that_names_them() -> None:
    s = spec()
    system = s.system(
        [s.behaviour("go", {"E.u": "1"})],
        [("go", "terminal", "x.c.a > 0", "go"), ("go", "terminal", "x.c.b > 0", "go")],
    )
    subsystem, _ = running(system, {}, proved=False)
    stepped(subsystem, 0, 0)
    assert stepped(subsystem, 1, 0) == 0
    assert stepped(subsystem, 0, 1) == 1
    with pytest.raises(UndecidedTransition, match=r"2 of its rows apply: .*row_0.*; .*row_1"):
        stepped(subsystem, 1, 1)


def test_a_cause_without_rows_is_a_fault() -> None:
    s = spec()
    system = s.system([s.behaviour("go", {"E.u": "1"}, terminal="x.c.a > 0")], [])
    subsystem, _ = running(system, {}, proved=True)
    assert [stepped(subsystem, 0, 0) for _ in range(2)] == [-1, -1]
    with pytest.raises(UndecidedTransition):
        stepped(subsystem, 1, 0)


def test_axioms_are_monitored_in_every_period_with_conditions() -> None:
    s = spec()
    system = s.system(
        [s.behaviour("go", {"E.u": "1"}, terminal="False")],
        [],
        axioms=["not (x.c.a > 0 and x.c.b > 0)", "elapsed < 0.005[s]"],
    )
    subsystem, _ = running(system, {}, proved=True)
    assert subsystem.axioms == ("not (x.c.a > 0.0 and x.c.b > 0.0)", "elapsed < 0.005[s]")
    seen = []
    for a, b in ((1, 1), (1, 1), (1, 0), (1, 1)):
        subsystem.violations = ()
        stepped(subsystem, a, b)
        seen.append(subsystem.violations)
    assert seen == [(), (0,), (), (0, 1)]


def test_elapsed_is_the_decimal_that_it_is_compared_with() -> None:
    s = Spec(x={"c.a": "real"}, y={"E.u": "real"})
    waits = s.behaviour("waits", {"E.u": "1"}, terminal="elapsed > 0.018[s]")
    system = s.system([waits], [("waits", "terminal", "True", "waits")])
    subsystem = running(system, {}, proved=True)[0]
    rows = [subsystem.step() for _ in range(12)]
    assert rows.index(0) == 10  # the tenth period of 2 ms; 9 * 0.002 is more than 0.018
