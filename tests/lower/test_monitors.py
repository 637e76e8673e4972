"""Assumptions of all kinds become monitors that say which of them does not hold."""

from __future__ import annotations

from typing import Any

import pytest
from specc_runtime.buffers import slots

from tests.lower.models import Spec, running


def square(d: float) -> float:
    return d * d


SQUARE = ("(d: real) -> real", square)
GOOD: dict[str, Any] = {"c_d": 1.0, "c_e": 2.0, "fresh_c_d": False, "fresh_c_e": False}


def monitored(axiom: str) -> Any:
    """A subsystem that has had its first period, with one assumption."""
    s = Spec(
        x={"c.d": "real", "c.e": "real", "c.b": "vector[2, Mode]"},
        y={"E.u": "real"},
        memory={"n": ("int", "0")},
        lets={"both": "x.c.d + x.c.e"},
        operators={"SQUARE": SQUARE},
    )
    behaviour = s.behaviour("go", {"E.u": "1", "n": "n + 1"}, terminal="False")
    system = s.system([behaviour], [], axioms=["True or x.c.d > 0", axiom])
    subsystem, _ = running(system, {"SQUARE": square}, proved=True)
    subsystem.x.c_b = ("u", "u")
    return subsystem


def violations(subsystem: Any, **values: Any) -> tuple[int, ...]:
    """What is violated in one period with these inputs."""
    for name, value in (GOOD | values).items():
        if name in slots(subsystem.x):
            setattr(subsystem.x, name, value)
    subsystem.violations = ()
    subsystem.step()
    found: tuple[int, ...] = subsystem.violations
    return found


CASES = {
    "fresh flags": (
        "not (fresh(x.c.d) and fresh(x.c.e))",
        {"fresh_c_d": True},
        {"fresh_c_d": True, "fresh_c_e": True},
    ),
    "a let": ("both < 5", {}, {"c_d": 4.0}),
    "an operator": ("SQUARE(x.c.d) < 9", {"c_d": -2.0}, {"c_d": 3.0}),
    "a quantifier": (
        "all(v != s for v in x.c.b)",
        {"c_b": ("u", "c")},
        {"c_b": ("u", "s")},
    ),
    "a guard": ("not present(x.c.d) or x.c.d > 0", {"c_d": 1.0}, {"c_d": -1.0}),
}


@pytest.mark.parametrize(("axiom", "good", "bad"), CASES.values(), ids=CASES)
def test_a_violation_is_told_when_it_happens(
    axiom: str, good: dict[str, Any], bad: dict[str, Any]
) -> None:
    subsystem = monitored(axiom)
    present = {"present_c_d": True} if "present" in axiom else {}
    assert violations(subsystem, **bad | present) == ()  # in the first period none is evaluated
    assert violations(subsystem, **good | present) == ()
    assert violations(subsystem, **bad | present) == (1,)
    assert violations(subsystem, **good | present) == ()


def test_memory_is_that_of_the_beginning_of_the_period() -> None:
    subsystem = monitored("n < 3")
    assert [violations(subsystem) for _ in range(5)] == [(), (), (), (1,), (1,)]


def test_nothing_is_read_before_it_is_there() -> None:
    subsystem = monitored("not present(x.c.d) or x.c.d > 0")
    subsystem.step()
    subsystem.step()  # x.c.d has no value yet
    assert subsystem.violations == ()
