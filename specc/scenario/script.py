"""What a scenario does, period by period."""

from __future__ import annotations

from collections.abc import Mapping

from specc.example.situation import Answer, Situation, Value
from specc.frozen import frozen
from specc.model.fsm import Transition
from specc.proof import InputName


@frozen
class Step:
    """One period, or several ones that are alike.

    Attributes:
        arrives: elements that come in this period, with their values.
        there: elements that have these values without having come in this period.
        absent: elements that are taken away.
        into: the state that the step leads to; empty in the last step, which has to decide.
        way: the row that is taken, in words.
    """

    arrives: Mapping[InputName, Value]
    there: Mapping[InputName, Value]
    absent: tuple[InputName, ...] = ()
    into: str = ""
    way: str = ""
    periods: int = 1


@frozen
class Placed:
    """What is put in place before the last step because no run was found that leads there.

    `state` and `periods` are None where the run did lead to the state, or long enough.
    """

    state: str | None
    memory: Mapping[str, Value]
    periods: int | None


@frozen
class Script:
    """A run: steps, what is put in place, and the last step, which is to fail."""

    steps: tuple[Step, ...]
    placed: Placed | None
    last: Step
    answers: tuple[Answer, ...]
    rows: tuple[int, ...]
    """Rows that apply in the last step, by their index in the table."""


def row_words(row: Transition) -> str:
    """A row as faults of a run name it."""
    return f"{row.source} {row.cause} {row.condition.name} -> {row.target}"


def step_between(before: Situation | None, at: Situation, into: str = "", way: str = "") -> Step:
    """The step that makes a situation of the one before; None stands for the beginning."""
    known = {} if before is None else {n: before.inputs[n] for n in before.present}
    present = sorted(at.present)
    there = {
        name: at.inputs[name]
        for name in present
        if name not in at.fresh
        and (name not in known or repr(known[name]) != repr(at.inputs[name]))
    }
    arrives = {name: at.inputs[name] for name in present if name in at.fresh}
    return Step(arrives, there, tuple(sorted(known.keys() - at.present)), into, way)
