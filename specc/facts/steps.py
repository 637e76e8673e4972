"""The transition graph of a machine without the rows that can never be taken."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof import InputName, RowVerdict

CAUSES: tuple[Cause, ...] = ("terminal", "error")


@dataclass(frozen=True, slots=True)
class Step:
    """A row that can be taken, and the inputs that have a value whenever it is."""

    row: Transition
    ensures: frozenset[InputName]


def find_steps(subsystem: Subsystem, prove: Callable[[str, Cause], RowVerdict]) -> tuple[Step, ...]:
    """The rows whose cause and condition can hold together; `prove` says what of a state."""
    found: dict[int, Step] = {}
    for state in subsystem.states:
        for cause in CAUSES:
            verdict = prove(state.name, cause)
            decision = verdict.decision
            for row, possible, ensures in zip(
                verdict.rows, decision.satisfiable, decision.ensures, strict=True
            ):
                if possible:
                    found[id(row)] = Step(row, ensures)
    return tuple(found[id(row)] for row in subsystem.transitions if id(row) in found)


def reached_from(start: str, steps: Iterable[Step]) -> frozenset[str]:
    """The states that the steps lead to from `start`, itself included."""
    targets: dict[str, list[str]] = {}
    for step in steps:
        targets.setdefault(step.row.source, []).append(step.row.target)
    reached, open_ = {start}, [start]
    while open_:
        for target in targets.get(open_.pop(), ()):
            if target not in reached:
                reached.add(target)
                open_.append(target)
    return frozenset(reached)
