"""The questions of a proof that are too large for tables, as questions to z3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import z3

from specc.proof.doubt import rounding
from specc.proof.formula import Formula, atoms_of, in_order
from specc.proof.relations import Answered, Judge, UnsureError
from specc.proof.solver.theory import Theory
from specc.proof.variables import Arrival
from specc.proof.verdict import Decision, InputName, Witness

MOST_FACTS = 24
"""Facts of a witness that are tried one by one for whether they matter."""
MOST_QUESTIONS = 400
"""Questions to z3 for one decision."""


def solve(judge: Judge, conditions: Sequence[Formula], assumed: Sequence[Formula]) -> Decision:
    """Whether exactly one of the conditions holds where everything assumed does.

    Raises:
        UnsureError: the question is too hard.
    """
    rounded = _Question(judge.rounded, conditions, assumed)
    decision = rounded.decision()
    if decision.proved or judge.rounded is judge.exact:
        return decision
    exact = _Question(judge.exact, conditions, assumed).decision()
    witness = decision.gap or decision.overlap
    return exact if witness is None or not exact.proved else rounding(witness.facts)


class _Question:
    def __init__(
        self, theory: Theory, conditions: Sequence[Formula], assumed: Sequence[Formula]
    ) -> None:
        self._theory = theory
        self._known: dict[Formula, Any] = {}
        self._questions = 0
        self._rows = [self._of(condition) for condition in conditions]
        self._context = [self._of(formula) for formula in assumed]
        self._asked = list(atoms_of(conditions))
        atoms = atoms_of([*conditions, *assumed])
        self._arrivals = {a.variable for a in atoms if isinstance(a.variable, Arrival)}

    def decision(self) -> Decision:
        rows, context = self._rows, self._context
        known = Decision(
            possible=self._holds(context),
            satisfiable=tuple(self._holds([*context, row]) for row in rows),
            ensures=tuple(self._ensured([*context, row]) for row in rows),
        )
        return replace(known, gap=self._gap(), overlap=self._overlap())

    def _gap(self) -> Witness | None:
        applies = z3.Or([z3.BoolVal(False, self._theory.context), *self._rows])
        answers = self._answers([*self._context, z3.Not(applies)], applies)
        return None if answers is None else self._witness(answers, z3.Not(applies))

    def _overlap(self) -> Witness | None:
        for second, row in enumerate(self._rows):
            for first in range(second):
                both = z3.And(self._rows[first], row)
                answers = self._answers([*self._context, both], z3.Not(both))
                if answers is not None:
                    found = self._witness(answers, self._several())
                    pair = first, second
                    return replace(found, holding=pair, repaired=self._narrowed(pair))
        return None

    def _several(self) -> Any:
        """That at least two of the conditions hold."""
        return z3.AtLeast(*self._rows, 2)

    def _narrowed(self, pair: tuple[int, int]) -> int | None:
        """The condition of a pair that could ask for less, since it holds where no other one does.

        Without the other one it still asks for what none of them asks, and so never for the same.
        """
        for index in reversed(pair):
            others = [z3.Not(row) for number, row in enumerate(self._rows) if number != index]
            if self._may_hold([*self._context, self._rows[index], *others]):
                return index
        return None

    def _witness(self, answers: Sequence[Answered], fault: Any) -> Witness:
        """The answers as facts, and whether there are other situations with the fault."""
        facts = tuple((a.text, "true" if yes == a.text_holds else "false") for a, yes in answers)
        said = tuple((a.expr, yes == a.text_holds) for a, yes in answers if a.expr is not None)
        told = [self._theory.said(*answer) for answer in answers]
        some = self._may_hold([*self._context, fault, z3.Not(z3.And(told))])
        return Witness(facts, answers=said, some=some)

    def _answers(self, fault: list[Any], no_fault: Any) -> list[Answered] | None:
        """Answers to what is asked that always lead to the fault; None if nothing does."""
        model = self._model(fault)
        if model is None:
            return None
        answers = [
            (atom, z3.is_true(model.eval(self._theory.said(atom, True), model_completion=True)))
            for atom in self._asked
            if atom.expr
        ]
        kept = list(answers)
        for item in answers if len(answers) <= MOST_FACTS else ():
            rest = [other for other in kept if other is not item]
            said = [self._theory.said(*other) for other in rest]
            if not self._holds([*self._context, no_fault, *said]):
                kept = rest
        return kept

    def _ensured(self, context: list[Any]) -> frozenset[InputName]:
        return frozenset(
            (arrival.peer, arrival.element)
            for arrival in sorted(self._arrivals, key=lambda a: (a.peer, a.element))
            if not self._holds([*context, z3.Not(self._theory.arrived(arrival, "present"))])
        )

    def _holds(self, parts: Sequence[Any]) -> bool:
        return self._model(parts) is not None

    def _may_hold(self, parts: Sequence[Any]) -> bool:
        """Whether something is not known to be impossible; no verdict depends on it."""
        try:
            return self._holds(parts)
        except UnsureError:
            return True

    def _model(self, parts: Sequence[Any]) -> Any:
        self._questions += 1
        if self._questions > MOST_QUESTIONS:
            raise UnsureError("the solver found no answer within bounds")
        return self._theory.model(parts)

    def _of(self, formula: Formula) -> Any:
        for part in in_order((formula,)):
            if part not in self._known:
                self._known[part] = self._translated(part)
        return self._known[formula]

    def _translated(self, formula: Formula) -> Any:
        parts = [self._known[part] for part in formula.parts]
        match formula.kind:
            case "and":
                return z3.And(parts)
            case "or":
                return z3.Or(parts)
            case "true" | "false":
                return z3.BoolVal(formula.kind == "true", self._theory.context)
        assert formula.atom is not None
        return self._theory.said(formula.atom, formula.kind == "atom")
