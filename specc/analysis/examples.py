"""Values that show a refutation, for messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from specc.analysis.definite_assignment import always_present
from specc.analysis.facts import Facts
from specc.analysis.machine import RowVerdictAt
from specc.analysis.must_may import gap_view, is_incomplete, must_view
from specc.lang.kinds import first_value
from specc.lang.values import Value
from specc.model.expr import Expr, walk
from specc.model.fsm import Cause, State
from specc.model.system import Subsystem
from specc.model.types import Type, Vector
from specc.proof import Witness
from specc.search import (
    NO_VALUE,
    FreeVariables,
    Goal,
    Interpreter,
    SearchBudget,
    Situation,
    showing,
)
from specc.search.example import Example, example, says_all

# Finding values that show what was refuted of rows.


MOST, MOST_AGAIN = 160, 40
"""Most situations that are tried for one finding, and then from other starts."""
EACH, MOST_IN_ALL = 10, 5000
"""What each finding may take in any case, and what all findings together may take."""
LARGE = 200
"""Parts of conditions that take twice the time; then half as many situations are looked at."""


class Examples:
    """Examples for the findings of one check."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._budget = SearchBudget(MOST_IN_ALL)
        self._interpreters: dict[str, Interpreter] = {}
        self._found: dict[object, Example | None] = {}

    def text(self, decided: RowVerdictAt, witness: Witness, facts: str) -> str:
        """Values of an example of a witness about rows, in words.

        Where none are found, its `facts` in words are the example. Empty where the message says all
        of that already.
        """
        is_said = witness.everywhere is None
        if is_said and all(says_all(asked) for asked, _ in witness.answers):
            return ""
        found = self.find(decided.subsystem, decided.state, decided.cause, witness)
        if found:
            return found.text
        return "" if is_said else facts

    def find(
        self, subsystem: Subsystem, state: State, cause: Cause, witness: Witness
    ) -> Example | None:
        """An example of a witness: no row applies, or those that it names and preferably no other.

        The same question about several states is searched once.
        """
        name = subsystem.qualified_name
        if name not in self._interpreters:
            self._interpreters[name] = Interpreter(self._facts.system, subsystem)
        meaning = self._interpreters[name]
        machine = self._facts.of(subsystem)
        seen, given = subsystem, [(fact, True) for fact in machine.invariants]
        if is_incomplete(
            subsystem, state, cause
        ):  # what is unknown is taken as the witness takes it
            seen, given = (must_view if witness.holding else gap_view)(cause).of(subsystem), []
        about = tuple(expr for expr, _ in witness.answers)
        answers = *witness.answers, *given
        every = tuple(showing(seen, state.name, cause, witness.holding, answers))
        always = always_present(subsystem, self._facts.wires)
        present = machine.presence.in_conditions(state.name) | always
        key = name, every, about, present
        if key not in self._found:
            freedom = FreeVariables(meaning.changing, present)
            self._found[key] = self._search(every, about, meaning, freedom)
        return self._found[key]

    def _search(
        self,
        every: Sequence[tuple[Goal, ...]],
        about: Sequence[Expr],
        meaning: Interpreter,
        freedom: FreeVariables,
    ) -> Example | None:
        if self._budget.left <= 0:
            return None
        self._budget.spend(EACH)
        most = MOST
        for goals in every:
            size = 1 + sum(_size(condition) for condition, _ in goals) // LARGE
            for number in (0.0, 1.0):  # by one, one can divide
                # Everything is there, nothing is fresh, a period after the state was entered.
                at = meaning.blank(number)
                for item in meaning.subsystem.memory:
                    value = _value(meaning, item.init, item.type, at)
                    at = replace(at, memory={**at.memory, item.name: value})
                start = replace(at, periods=1)
                with self._budget.some(most // size) as budget:
                    found = example(goals, about, meaning, start, freedom, budget)
                if found:
                    return found
                most = MOST_AGAIN
        return None


def _size(expr: Expr) -> int:
    """The number of parts of an expression; a vector counts with all its items."""
    size = 0
    for node in walk(expr):
        size += 1
        if isinstance(node.type, Vector):
            size += node.type.size
    return size


def _value(meaning: Interpreter, expr: Expr, type_: Type, at: Situation) -> Value:
    """The value of an expression, or any other of its type where it has none."""
    try:
        return meaning.value(expr, at)
    except NO_VALUE:
        return first_value(type_)
