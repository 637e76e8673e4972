"""Values that show a refutation, for messages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

from specc.analysis.definite_assignment import always_present
from specc.analysis.machine import Machine, RowVerdictAt
from specc.analysis.must_may import gap_view, is_incomplete, must_view
from specc.lang.kinds import first_value
from specc.lang.values import Value
from specc.model.expr import Expr, walk
from specc.model.system import Subsystem, System
from specc.model.types import Type, Vector
from specc.model.wires import Wires
from specc.proof import Witness
from specc.proof.prover import with_repair
from specc.proof.verdict import freshness
from specc.search import (
    NO_VALUE,
    FreeVariables,
    Goal,
    Interpreter,
    SearchBudget,
    Situation,
    refutation_goals,
    runnable,
)
from specc.search.example import Example, example, is_complete_answer

# Finding values that show what was refuted of rows.


MOST, MOST_AGAIN = 160, 40
"""Most situations that are tried for one finding, and then from other starts."""
EACH, MOST_IN_ALL = 10, 5000
"""What each finding may take in any case, and what all findings together may take."""
LARGE = 200
"""Parts of conditions that take twice the time; then half as many situations are looked at."""


class Examples:
    """Examples for the findings of one check."""

    def __init__(
        self, system: System, wires: Wires, machine_of: Callable[[Subsystem], Machine]
    ) -> None:
        self._system = system
        self._wires = wires
        self._machine_of = machine_of
        self._budget = SearchBudget(MOST_IN_ALL)
        self._interpreters: dict[str, Interpreter] = {}
        self._found: dict[object, Example | None] = {}

    def text(self, decided: RowVerdictAt, witness: Witness, facts: str) -> str:
        """Describe values of an example of a witness about rows.

        Where none are found, its `facts` in words are the example. Empty where the message says all
        of that already.
        """
        questions = (question for question, _ in witness.answers)
        is_in_message = witness.everywhere is None
        if is_in_message and all(map(is_complete_answer, questions)):
            return ""
        found = self.find(decided, witness)
        if found:
            return found.text
        return "" if is_in_message else facts

    def confirm(self, decided: RowVerdictAt) -> RowVerdictAt:
        """Add the refutations that some values show to a verdict that tables leave open."""
        verdict = decided.verdict
        if verdict.decision.open is None or not verdict.rows:
            return decided
        gap = self._witness_of_rows(decided, ())
        pairs = combinations(range(len(verdict.rows)), 2)
        overlap = next(filter(None, (self._witness_of_rows(decided, pair) for pair in pairs)), None)
        if not gap and not overlap:
            return decided
        if overlap:
            able = (i for i in reversed(overlap.holding) if self._witness_of_rows(decided, (i,)))
            overlap = replace(overlap, repaired=next(able, None))
        refuted = replace(verdict.decision, gap=gap, overlap=overlap, unknown="", open=None)
        repaired = with_repair(refuted, verdict.rows)
        return replace(decided, verdict=replace(verdict, decision=repaired))

    def _witness_of_rows(self, decided: RowVerdictAt, holding: tuple[int, ...]) -> Witness | None:
        """Search a witness of exactly these rows, by index, or of two of them and others."""
        open_ = decided.verdict.decision.open
        assert open_ is not None  # it is confirmed
        found = self.find(decided, Witness((), holding))
        if found is None:
            return None
        meaning = self._interpreters[decided.subsystem.qualified_name]

        def value(expr: Expr) -> Value:
            try:
                return meaning.value(runnable(expr), found.situation)
            except NO_VALUE:
                return None

        rows = decided.verdict.rows
        if len(holding) == 1 and sum(bool(value(row.condition.when)) for row in rows) > 1:
            return None
        return open_.witness_of(value, holding)

    def find(self, decided: RowVerdictAt, witness: Witness) -> Example | None:
        """Search an example of a witness: no row applies, or its rows and preferably no others.

        The same question about several states is searched once.
        """
        subsystem, state, cause = decided.subsystem, decided.state, decided.cause
        name = subsystem.qualified_name
        if name not in self._interpreters:
            self._interpreters[name] = Interpreter(self._system, subsystem)
        meaning = self._interpreters[name]
        machine = self._machine_of(subsystem)
        fresh = sorted(decided.verdict.arrivals & machine.availability.fresh)
        known = (*machine.invariants, *map(freshness, fresh))
        seen, given = subsystem, [(fact, True) for fact in known]
        if is_incomplete(
            subsystem, state, cause
        ):  # what is unknown is taken as the witness takes it
            seen, given = (must_view if witness.holding else gap_view)(cause).of(subsystem), []
        about = tuple(expr for expr, _ in witness.answers)
        answers = *witness.answers, *given
        every = tuple(refutation_goals(seen, state.name, cause, witness.holding, answers))
        always = always_present(subsystem, self._wires)
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
        if self._budget.remaining <= 0:
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
                with self._budget.share(most // size) as budget:
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
