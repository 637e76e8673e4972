"""A fault surfaces when its result would have become visible, the same wherever it was computed."""

from __future__ import annotations

import pytest
from specc_runtime.faults import AxiomViolated, Fault, StepFailed, UndecidedTransition
from specc_runtime.subsystem import Transition

from tests.runtime.tiny import TICK_S, Node, Run, system


def _fail_at(step: int, error: Exception):
    def compute(node: Node) -> int:
        if node.steps == step:
            raise error
        return node.steps

    return compute


@pytest.mark.parametrize("inline", [True, False])
def test_fault_surfaces_at_the_next_stamp(inline: bool) -> None:
    slow = Node("slow", 30, (), _fail_at(2, ValueError("no solution")))
    run = Run(system(Node("fast"), slow), 200, inline=inline)
    assert run.executor.tick == 90
    assert [r.stamp for r in run.of("slow")] == [0, 1]
    assert [r.stamp for r in run.of("fast")] == list(range(90))
    (fault,) = run.executor.faults
    assert isinstance(fault, StepFailed)
    assert (fault.subsystem, fault.state, fault.stamp, fault.time_s) == ("slow", "run", 2, 0.12)
    assert str(fault) == "slow in run at 0.1200 s (stamp 2): ValueError: no solution"
    assert fault.as_data()["place"].startswith("compute (test_faults.py:")
    assert fault.as_data()["line"] == "self.y.value = self.compute(self)"


def test_the_line_of_the_module_is_told_wherever_it_failed() -> None:
    def nothing(node: Node) -> None:
        node.steps += None  # type: ignore[operator]  # that is the fault

    (fault,) = Run(system(Node("a", 1, (), nothing)), 5).executor.faults
    assert fault.as_data()["line"] == "self.y.value = self.compute(self)"
    (fault,) = Run(system(Node("a", 1, (), _of_two)), 5).executor.faults
    assert "_of_two() missing 1 required positional argument" in str(fault)
    assert fault.as_data()["line"] == "self.y.value = self.compute(self)"


def _of_two(node: Node, other: Node) -> int:
    return node.steps - other.steps


def test_worker_and_inline_agree_on_records_and_faults() -> None:
    runs = []
    for inline in (True, False):
        nodes = [
            Node("a", 1, ("b", "c")),
            Node("b", 30, ("a",), _fail_at(3, ValueError("b"))),
            Node("c", 40, ("a",), _fail_at(2, ValueError("c"))),
        ]
        runs.append(Run(system(*nodes), 500, inline=inline))
    first, second = runs
    assert first.sha256 == second.sha256
    assert [f.as_data() for f in first.executor.faults] == [
        f.as_data() for f in second.executor.faults
    ]
    assert [f.subsystem for f in first.executor.faults] == ["b", "c"]


def test_fault_under_way_at_the_end_is_not_lost() -> None:
    run = Run(system(Node("a", 10, (), _fail_at(1, ValueError("late")))), 12)
    assert run.executor.tick == 12
    assert [f.stamp for f in run.executor.faults] == [1]


def test_violated_axiom_is_a_fault_that_comes_before_others() -> None:
    def compute(node: Node) -> int:
        if node.steps == 7:
            node.violated(0)
            raise ValueError("because of that")
        return 0

    run = Run(system(Node("a", 1, (), compute)), 20)
    (fault,) = run.executor.faults
    assert isinstance(fault, AxiomViolated)
    assert fault.axioms == ("the step number is not 7",)
    assert isinstance(fault.__cause__, StepFailed)
    assert fault.time_s == 7 * TICK_S


def test_undecided_transition_carries_its_rows_and_inputs() -> None:
    class Torn(Node):
        transitions = (
            Transition("run", "terminal", "hot", "run"),
            Transition("run", "terminal", "cold", "run"),
        )

    def compute(node: Node) -> int:
        if node.steps == 3:
            raise node.undecided("terminal", (0, 1))
        return 0

    run = Run(system(Node("w"), Torn("a", 1, ("w",), compute)), 20)
    (fault,) = run.executor.faults
    assert isinstance(fault, UndecidedTransition)
    assert fault.inputs == {"w": 2, "fresh_w": True, "present_w": True}
    assert fault.as_data()["rows"] == [
        "run terminal hot -> run",
        "run terminal cold -> run",
    ]
    assert "2 of its rows apply" in fault.message


def test_faults_are_of_one_kind() -> None:
    assert all(issubclass(kind, Fault) for kind in (StepFailed, AxiomViolated, UndecidedTransition))
