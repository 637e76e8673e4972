"""The cases of `scenarios`, by the interpreter of modes and by the compiler with its code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from specc_runtime.faults import UndecidedTransition
from specc_runtime.stepping import Stepper

from specc.pipeline import Result, compile_spec
from tests.seeds import every
from tests.soundness.modes.hierarchical import Failure, Machine, Written
from tests.soundness.modes.scenarios import CASES, REFUSED, Case
from tests.soundness.running import built, memory_of

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
    return str(value) if isinstance(value, (bool, str)) else f"{value:g}"


def wrong(case: Case, machine: Machine) -> str:
    """The first period in which an interpreter does not what the case says."""
    for number, (skipped, order, state, values) in enumerate(lines(case)):
        step = machine.step({ORDER: order}, {ORDER}, skipped)
        where = f"{case.name}: period {number}, {step}"
        if isinstance(step, Failure):
            found = f"! {step.cause} {len(step.rows)}"
            return "" if found == state else where
        seen = {name: shown(value) for name, value in step.memory} | {"cause": step.cause}
        if step.state != state or {name: seen[name] for name in values} != values:
            return where
    return ""


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_interpreter(case: Case) -> None:
    assert not wrong(case, Machine(Written(case.control)))


def errors_of(result: Result) -> list[str]:
    return [f"{d.code} {d.message}" for d in result.diagnostics if d.code[0] in "EO"]


@pytest.mark.parametrize("case", every(2, CASES), ids=lambda case: case.name)
def test_compiler(case: Case, tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(case.text, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    if case.refused:
        code, words = case.refused.split(" ", 1)
        assert any(text.startswith(code) and words in text for text in errors_of(result))
    else:
        assert errors_of(result) == []
    assert result.system is not None
    skips = any(skipped for skipped, *_ in lines(case))
    for proofs in (None, result.proofs)[: 1 + (not skips and not case.refused)]:
        with built(result.system, proofs) as made:
            machine: Any = made.scheduled("cell.c").subsystem
            check_generated(case, machine)


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case.name)
def test_refusals(case: Case, tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(case.text, encoding="utf-8")
    errors = errors_of(compile_spec(str(tmp_path / "spec.yaml")))
    code, _, words = case.refused.partition(" ")
    assert any(text.startswith(code) and words in text for text in errors), errors


def check_generated(case: Case, machine: Any) -> None:
    stepper = Stepper(machine)
    for number, (skipped, order, state, values) in enumerate(lines(case)):
        where = f"{case.name}: period {number}"
        stepper.skip(skipped)
        stepper.feed({"desk_order": order}, {}, ())
        if state.startswith("!"):
            _, cause, count = state.split()
            with pytest.raises(UndecidedTransition) as fault:
                stepper.step()
            assert fault.value.cause in (cause, "error"), where
            assert len(fault.value.rows) == int(count), where
            continue
        row = stepper.step()
        assert machine.state == state, where
        cause = machine.transitions[row].cause if row >= 0 else ""
        seen = {name: shown(value) for name, value in memory_of(machine)} | {"cause": cause}
        wanted = dict(values)
        if cause == "error":
            wanted.pop("cause", None)  # of one error condition that no row names
        assert {name: seen[name] for name in wanted} == wanted, where
