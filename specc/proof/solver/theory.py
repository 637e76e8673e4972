"""What answers to questions have to do with each other, whatever the structure of conditions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import z3

from specc.limits import OUT_OF_STEPS, left, spend
from specc.model.expr import Among, LetRef, Quantifier, children
from specc.model.types import Bool, ListOf
from specc.proof.formula import Atom
from specc.proof.numbering import Numbering
from specc.proof.relations import Answered, UnsureError
from specc.proof.solver.conditions import Conditions, TooManyItemsError, arrived
from specc.proof.variables import Arrival, EnumItem, Quantity

_STEPS = "rlimit count"
MOST_STEPS = 400_000
"""Steps of the solver for one question; steps and not seconds, so that all machines agree."""


class Theory:
    """Answers to the questions of some atoms that are possible together.

    With `exact`, numbers are taken as exact ones; what is impossible then may be possible with
    rounded ones.
    """

    def __init__(
        self,
        numbering: Numbering,
        atoms: Sequence[Atom],
        *,
        exact: bool,
    ) -> None:
        if left("proof") <= 0:
            raise UnsureError(OUT_OF_STEPS)
        items, reached = _quantified(atoms, numbering)
        self._conditions = Conditions(numbering, items, exact=exact)
        try:
            for (
                value
            ) in numbering.named():  # so that no chain of lets is followed by deep recursion
                if id(value) in reached:
                    self._conditions.prepare(value)
            terms = [self._term(atom) for atom in atoms]
        except TooManyItemsError:
            raise UnsureError("a quantifier goes over a long vector") from None
        rounding = self._conditions.rounding
        if rounding.is_large:
            raise UnsureError("too many sums are compared in one table")
        self.rounds = rounding.matters
        facts = [*self._conditions.laws, *rounding.facts()]
        facts += [_arrival(atom.variable) for atom in atoms if _is_arrival(atom)]
        # In a context of its own, so that an answer does not depend on earlier questions.
        self.context = z3.Context()
        self._solver = z3.Solver(ctx=self.context)
        self._counted = 0
        self._solver.set("rlimit", MOST_STEPS)
        # Python minds Ctrl-C itself; the solver would only say that it found no answer.
        self._solver.set("ctrl_c", False)
        self._solver.add(z3.And(facts).translate(self.context))
        self._answers = {
            atom: z3.Bool(f"answer {index}", self.context) for index, atom in enumerate(atoms)
        }
        for answer, term in zip(self._answers.values(), terms, strict=True):
            self._solver.add(answer == term.translate(self.context))

    def conflict(self, answers: Sequence[Answered]) -> tuple[Answered, ...] | None:
        """Some of the answers that are impossible together, as few as suffice; None if possible."""
        core = self._core(answers)
        if core is None:
            return None
        for answer in core:
            rest = [other for other in core if other is not answer]
            if len(rest) < len(core) and (smaller := self._core(rest)) is not None:
                core = smaller
        return tuple(core)

    def _core(self, answers: Sequence[Answered]) -> list[Answered] | None:
        """Some answers that are impossible together, not the fewest; None if all are possible."""
        # The terms are kept: z3 gives the identity of one that nobody holds to the next.
        said = [self.said(*answer) for answer in answers]
        if self._check(said):
            return None
        needed = {term.get_id() for term in self._solver.unsat_core()}
        return [a for a, term in zip(answers, said, strict=True) if term.get_id() in needed]

    def model(self, terms: Sequence[Any]) -> Any:
        """Values with which all terms, of the context of this, hold; None if there are none.

        Raises:
            UnsureError: that takes too long.
        """
        self._solver.push()
        try:
            self._solver.add(*terms)
            return self._solver.model() if self._check(()) else None
        finally:
            self._solver.pop()

    def said(self, atom: Atom, yes: bool) -> Any:
        """The term that the answer to the question of an atom is yes, or no."""
        return self._answers[atom] if yes else z3.Not(self._answers[atom])

    def arrived(self, arrival: Arrival, test: str) -> Any:
        """The term that an input is fresh, or present."""
        return arrived(arrival.peer, arrival.element, test).translate(self.context)

    def _check(self, assumed: Sequence[Any]) -> bool:
        allowed = left("proof")
        if allowed < MOST_STEPS:
            self._solver.set("rlimit", max(allowed, 1))
        found = self._solver.check(*assumed)
        spend("proof", self._steps())
        if found == z3.unknown:
            within = "bounds" if allowed >= MOST_STEPS else "the steps that this run has left"
            raise UnsureError(f"the solver found no answer within {within}")
        return bool(found == z3.sat)

    def _steps(self) -> int:
        """Steps since this was asked before."""
        before, statistics = self._counted, self._solver.statistics()
        keys = statistics.keys()
        self._counted = statistics.get_key_value(_STEPS) if _STEPS in keys else before
        return self._counted - before

    def _term(self, atom: Atom) -> Any:
        variable = atom.variable
        match variable:
            case Arrival(peer=peer, element=element):
                return arrived(peer, element, atom.test)
            case EnumItem(expr=item) if item is not None:
                return self._conditions.boolean(Among(item, atom.test, type=Bool()))
            case Quantity(kind="periods"):
                return self._conditions.in_periods(atom.expr, atom.test[1], atom.text_holds)
        if atom.expr is None:
            return z3.Bool(f"fact {variable} {atom.test}")
        term = self._conditions.boolean(atom.expr)
        return term if atom.text_holds else z3.Not(term)


def _is_arrival(atom: Atom) -> bool:
    return isinstance(atom.variable, Arrival)


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
            expr = numbering.looked_through(expr)
        if id(expr) in seen:
            continue
        seen.add(id(expr))
        if isinstance(expr, Quantifier):
            if isinstance(expr.over.type, ListOf):
                over = numbering.number(numbering.looked_through(expr.over))
                found.setdefault(over, set()).add(numbering.number(expr))
            open_.append(expr.over)
        else:
            open_ += children(expr)
    return found, seen
