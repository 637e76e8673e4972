"""The cases of `scenarios`, by the interpreter of modes and by the compiler with its code."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from tests.soundness.modes.hierarchical import Failure, Machine, Written
from tests.soundness.modes.scenarios import CASES, Case

ORDER = ("desk", "order")


def lines(case: Case) -> list[tuple[int, str, str, dict[str, str]]]:
    """Of each period: those skipped before it, the order, the state, and the values."""
    found, skipped = [], 0
    for line in case.script.strip().splitlines():
        if line.startswith("skip"):
            skipped = int(line.split()[1])
            continue
        order, state, values = (part.strip() for part in line.split("|"))
        found.append((skipped, order, state, dict(v.split("=") for v in values.split())))
        skipped = 0
    return found


def shown(value: Any) -> str:
    return str(value) if isinstance(value, bool) else f"{value:g}"


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_interpreter(case: Case) -> None:
    machine = Machine(Written(case.control), Fraction(1))
    for number, (skipped, order, state, values) in enumerate(lines(case)):
        step = machine.step({ORDER: order}, {ORDER}, skipped)
        where = f"{case.name}: period {number}, {step}"
        if state.startswith("!"):
            _, cause, count = state.split()
            assert isinstance(step, Failure), where
            assert (step.cause, len(step.rows)) == (cause, int(count)), where
            continue
        assert step.state == state, where
        seen = {name: shown(value) for name, value in step.memory} | {"cause": step.cause}
        assert {name: seen[name] for name in values} == values, where
