"""The work cycle by the book: what a subsystem does in one period (section 2.3)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from specc.example.situation import NO_VALUE, Meaning, Situation
from specc.example.values import Value
from specc.model.expr import Expr
from specc.model.fsm import Cause
from specc.proof import InputName


@dataclass(frozen=True, slots=True)
class Ending:
    """How a state ends: the cause, and the rows that apply, by their index in the table."""

    cause: Cause
    rows: tuple[int, ...]


class StrayError(Exception):
    """A period does not go as wanted; the message says why."""


class AbsentError(StrayError):
    """An input is read that has no value."""

    def __init__(self, name: InputName) -> None:
        super().__init__(f"x.{'.'.join(name)} has no value")
        self.name = name


def ending(meaning: Meaning, state: str, at: Situation) -> Ending | None:
    """How a state ends in a situation; None if it goes on.

    Raises:
        StrayError: a condition has no value.
    """
    subsystem = meaning.subsystem
    behaviour = subsystem.state(state).behaviour
    asked: tuple[tuple[Cause, Expr], ...] = (
        ("error", behaviour.error.when),
        ("terminal", behaviour.terminal.when),
    )
    for cause, condition in asked:
        if _surely(meaning, condition, at):
            rows = subsystem.rows(state, cause)
            held = (i for i, row in rows if _surely(meaning, row.condition.when, at))
            return Ending(cause, tuple(held))
    return None


def executed(meaning: Meaning, state: str, at: Situation) -> Situation:
    """The situation after the functions of a state, one period later, when nothing has come.

    Raises:
        StrayError: a function has no value.
    """
    changed = {}
    for assignment in meaning.subsystem.state(state).behaviour.assignments:
        value = value_of(meaning, assignment.value, at)
        if not assignment.peer:
            changed[assignment.name] = value
    later = {**at.memory, **changed}
    return replace(at, memory=later, fresh=frozenset(), periods=at.periods + 1)


def begun(meaning: Meaning, at: Situation) -> Situation:
    """The situation in the first period with the memory that the subsystem begins with.

    Raises:
        StrayError: an initial value has no value.
    """
    memory = {item.name: value_of(meaning, item.init, at) for item in meaning.subsystem.memory}
    return replace(at, memory=memory, periods=0)


def axioms_hold(meaning: Meaning, at: Situation) -> bool:
    """Whether all assumptions hold."""
    return all(meaning.holds(axiom.that, at) for axiom in meaning.subsystem.axioms)


def watched(meaning: Meaning, at: Situation) -> list[bool]:
    """Which assumptions hold; a run watches all of them.

    Raises:
        StrayError: one has no value.
    """
    return [_surely(meaning, axiom.that, at) for axiom in meaning.subsystem.axioms]


def _surely(meaning: Meaning, condition: Expr, at: Situation) -> bool:
    return bool(value_of(meaning, condition, at))


def value_of(meaning: Meaning, expr: Expr, at: Situation) -> Value:
    """The value of an expression.

    Raises:
        StrayError: it has none.
    """
    try:
        return meaning.value(expr, at, strictly=True)
    except KeyError as error:
        if error.args[0] in at.inputs:
            raise AbsentError(error.args[0]) from error
        raise StrayError(f"{error} has no value") from error
    except NO_VALUE as error:
        raise StrayError(str(error)) from error
