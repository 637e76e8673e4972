"""Asks z3 for answers to questions with which a formula holds: the one door to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import z3

from specc.limits import OUT_OF_STEPS, remaining, spend
from specc.model.expr import IsOneOf, LetRef, Quantifier, children
from specc.model.types import Bool, ListOf
from specc.proof.formula import (
    Answered,
    Arrival,
    Atom,
    EnumItem,
    Formula,
    Quantity,
    in_order,
)
from specc.proof.numbering import Numbering
from specc.proof.solver.conditions import Conditions, arrived
from specc.proof.verdict import SolverError

_STEPS = "rlimit count"
MOST_STEPS = 400_000
"""Steps of the solver for one question; steps and not seconds, so that all machines agree."""
_OF_A_THEORY = 5_000
"""Steps of proofs that making one takes, beside its terms."""


class Theory:
    """Finds answers to the questions of some atoms with which a formula holds.

    With `exact`, numbers are taken as exact ones; what is impossible then may be possible with
    rounded ones. It has a context of z3 of its own, so that an answer does not depend on others.
    """

    def __init__(self, numbering: Numbering, atoms: Sequence[Atom], *, exact: bool) -> None:
        if not spend("proof", _OF_A_THEORY):
            raise SolverError(OUT_OF_STEPS)
        items, reached = _quantified(atoms, numbering)
        self._conditions = Conditions(numbering, items, exact=exact)
        # In order of dependence, so that no chain of lets is followed by deep recursion.
        for value in numbering.named_values():
            if id(value) in reached:
                self._conditions.prepare(value)
        terms = [self._term(atom) for atom in atoms]
        rounding = self._conditions.rounding
        if rounding.is_large:
            raise SolverError("too many sums are compared in one table")
        facts = [*self._conditions.laws, *rounding.facts()]
        facts += [_arrival(a.variable) for a in atoms if isinstance(a.variable, Arrival)]
        self._context = z3.Context()
        # What z3.Solver would ask, too, as there are assumptions; its strategies take time to make.
        self._solver = z3.SimpleSolver(ctx=self._context)
        self._solver.set("rlimit", MOST_STEPS)
        # Python minds Ctrl-C itself; the solver would only say that it found no answer.
        self._solver.set("ctrl_c", False)
        self._solver.add(z3.And(facts).translate(self._context))
        self._counted = 0
        self._answers = {
            atom: z3.Bool(f"answer {index}", self._context) for index, atom in enumerate(atoms)
        }
        for answer, term in zip(self._answers.values(), terms, strict=True):
            self._solver.add(answer == term.translate(self._context))

    def find_model(self, formula: Formula) -> list[Answered] | None:
        """Answers to all questions with which a formula holds; None if there are none.

        Raises:
            SolverError: the solver does not say.
        """
        allowed = remaining("proof")
        if allowed < MOST_STEPS:
            self._solver.set("rlimit", max(allowed, 1))
        self._solver.push()
        try:
            self._solver.add(self._formula(formula))
            found = self._solver.check()
            model = self._solver.model() if found == z3.sat else None
        finally:
            spend("proof", self._steps())
            self._solver.pop()
        if found == z3.unknown:
            within = "bounds" if allowed >= MOST_STEPS else "the steps that this run has left"
            raise SolverError(f"the solver found no answer within {within}")
        if model is None:
            return None
        return [
            (atom, z3.is_true(model.eval(answer, model_completion=True)))
            for atom, answer in self._answers.items()
        ]

    def _steps(self) -> int:
        """Steps since this was asked before."""
        before = self._counted
        with suppress(z3.Z3Exception):  # there are none yet
            self._counted = self._solver.statistics().get_key_value(_STEPS)
        return self._counted - before

    def _formula(self, formula: Formula) -> Any:
        terms: dict[Formula, Any] = {}
        for part in in_order((formula,)):
            parts = [terms[each] for each in part.parts]
            match part.kind:
                case "and":
                    terms[part] = z3.And(parts)
                case "or":
                    terms[part] = z3.Or(parts)
                case "true" | "false":
                    terms[part] = z3.BoolVal(part.kind == "true", self._context)
                case _:
                    assert part.atom is not None  # it is one, or its negation
                    answer = self._answers[part.atom]
                    terms[part] = answer if part.kind == "atom" else z3.Not(answer)
        return terms[formula]

    def _term(self, atom: Atom) -> Any:
        variable = atom.variable
        match variable:
            case Arrival(peer=peer, element=element):
                return arrived(peer, element, atom.test)
            case EnumItem(expr=item) if item is not None:
                return self._conditions.boolean(IsOneOf(item, atom.test, type=Bool()))
            case Quantity(kind="periods"):
                return self._conditions.in_periods(atom.expr, atom.test[1], atom.holds_if)
        if atom.expr is None:
            return z3.Bool(f"fact {variable} {atom.test}")
        term = self._conditions.boolean(atom.expr)
        return term if atom.holds_if else z3.Not(term)


def _arrival(variable: Any) -> Any:
    fresh, present = (arrived(variable.peer, variable.element, t) for t in ("fresh", "present"))
    return present if variable.always_present else z3.Implies(fresh, present)


def _quantified(
    atoms: Iterable[Atom], numbering: Numbering
) -> tuple[dict[int, set[int]], set[int]]:
    """Numbers of lists, and of the quantifiers over each that are in no other quantifier.

    With the identities of the expressions that this has looked at.
    """
    found: dict[int, set[int]] = {}
    seen: set[int] = set()
    open_ = [atom.expr for atom in atoms if atom.expr is not None]
    items = [atom.variable.expr for atom in atoms if isinstance(atom.variable, EnumItem)]
    open_ += [item for item in items if item is not None]
    while open_:
        expr = open_.pop()
        if isinstance(expr, LetRef):
            expr = numbering.resolve(expr)
        if id(expr) in seen:
            continue
        seen.add(id(expr))
        if isinstance(expr, Quantifier):
            if isinstance(expr.over.type, ListOf):
                over = numbering.number(numbering.resolve(expr.over))
                found.setdefault(over, set()).add(numbering.number(expr))
            open_.append(expr.over)
        else:
            open_ += children(expr)
    return found, seen
