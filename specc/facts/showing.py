"""Finding values that show what was refuted of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from specc.example.exact import runnable
from specc.example.example import Example, Wanted, example
from specc.example.freedom import Freedom
from specc.example.patience import Patience
from specc.example.search import Goal
from specc.example.situation import NO_VALUE, Meaning, Situation
from specc.example.values import Value, first_value
from specc.facts.partial import is_vague, sure, unmet
from specc.model.expr import Expr, walk
from specc.model.fsm import Cause, State
from specc.model.system import Subsystem
from specc.model.types import Type, Vector
from specc.proof import InputName, Witness

if TYPE_CHECKING:
    from specc.facts.facts import Facts

MOST, MOST_AGAIN = 160, 40
"""Situations that are looked at for one finding, and then from other starts."""
EACH, MOST_IN_ALL = 10, 5000
"""What a finding takes in any case, and what all of them may take."""
LARGE = 200
"""Parts of conditions that take twice the time; then half as many situations are looked at."""


class Finder:
    """Finds examples in the subsystems of a system."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._left = Patience(MOST_IN_ALL)

    def find(
        self, subsystem: Subsystem, state: State, cause: Cause, witness: Witness
    ) -> Example | None:
        """An example of a witness: no row applies, or those that it names and, best, no other."""
        if self._left.left <= 0:
            return None
        self._left.spend(EACH)
        seen = _seen(subsystem, state, cause, witness)
        meaning = Meaning(self._facts.system, seen)
        freedom = self._freedom(subsystem, state.name)
        about = tuple(expr for expr, _ in witness.answers)
        most = MOST
        for goals in _goals(seen, state.name, cause, witness):
            size = 1 + sum(map(_size, (expr for expr, _ in goals))) // LARGE
            for number in (0.0, 1.0):  # by one, one can divide
                start = _start(meaning, number)
                with self._left.some(most // size) as patience:
                    found = example(Wanted(goals, about), meaning, start, freedom, patience)
                if found:
                    return found
                most = MOST_AGAIN
        return None

    def _freedom(self, subsystem: Subsystem, state: str) -> Freedom:
        changing = (a.name for b in subsystem.behaviours for a in b.assignments if not a.peer)
        always = self._facts.connections.always_present(subsystem)
        there = self._facts.presence(subsystem).in_conditions(state) | always
        return Freedom(frozenset(changing), True, True, frozenset(), there)


def _seen(subsystem: Subsystem, state: State, cause: Cause, witness: Witness) -> Subsystem:
    """The subsystem without unknowns, as the witness takes it."""
    if is_vague(subsystem, state, cause):
        subsystem = (sure if witness.holding else unmet)(cause).of(subsystem)
    lets = (replace(let, value=runnable(let.value)) for let in subsystem.lets)
    return replace(subsystem, lets=tuple(lets))


def _goals(
    subsystem: Subsystem, state: str, cause: Cause, witness: Witness
) -> Iterator[tuple[Goal, ...]]:
    """The state ends by the cause, the assumptions hold, and of its rows those of the witness."""
    behaviour = subsystem.state(state).behaviour
    given = [(behaviour.error.when, cause == "error")]
    if cause == "terminal":
        given.append((behaviour.terminal.when, True))
    given += [(axiom.that, True) for axiom in subsystem.axioms]
    given += witness.answers
    rows = [row.condition.when for _, row in subsystem.rows(state, cause)]
    held = [(when, index in witness.holding) for index, when in enumerate(rows)]
    yield _runnable([*given, *held])
    if len(rows) > len(witness.holding) > 0:
        yield _runnable([*given, *(goal for goal in held if goal[1])])


def _runnable(goals: Sequence[Goal]) -> tuple[Goal, ...]:
    return tuple((runnable(condition), yes) for condition, yes in goals)


def _size(expr: Expr) -> int:
    """The parts of an expression; what is asked of all items counts once for each of them."""
    size = 0
    for node in walk(expr):
        size += 1
        if isinstance(node.type, Vector):
            size += node.type.size
    return size


def _start(meaning: Meaning, number: float) -> Situation:
    """Everything is there, nothing is fresh, a period after the state was entered."""
    subsystem = meaning.subsystem
    inputs: dict[InputName, Value] = {
        (port.peer, element.name): first_value(element.type, number)
        for port in subsystem.ports
        if port.direction == "x"
        for element in port.elements
    }
    at = Situation(inputs, frozenset(inputs))
    for item in subsystem.memory:
        value = _value(meaning, item.init, item.type, at)
        at = replace(at, memory={**at.memory, item.name: value})
    return replace(at, periods=1)


def _value(meaning: Meaning, expr: Expr, type_: Type, at: Situation) -> Value:
    """The value of an expression, or any other of its type where it has none."""
    try:
        return meaning.value(expr, at)
    except NO_VALUE:
        return first_value(type_)
