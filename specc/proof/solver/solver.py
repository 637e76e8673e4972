"""The search for values that make conditions true: the one door to z3."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
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
    atoms_of,
    in_order,
)
from specc.proof.numbering import Numbering
from specc.proof.solver.conditions import Conditions, arrived
from specc.proof.verdict import Decision, InputName, UnsureError, Witness, rounding

# What answers to questions have to do with each other, whatever the structure of conditions.


_STEPS = "rlimit count"
MOST_STEPS = 400_000
"""Steps of the solver for one question; steps and not seconds, so that all machines agree."""
_OF_A_THEORY = 1_000
"""Steps of proofs that making one takes, beside its terms."""


class Session:
    """A context of z3, which takes longer to make than most answers, and the steps spent in it.

    Each subsystem has its own, so that an answer does not depend on questions about others.
    """

    def __init__(self) -> None:
        self.context = z3.Context()
        self._counted = 0

    def steps(self, solver: Any) -> int:
        """Steps since this was asked before."""
        before = self._counted
        with suppress(z3.Z3Exception):  # there are none yet
            self._counted = solver.statistics().get_key_value(_STEPS)
        return self._counted - before


class Theory:
    """Which answers to the questions of some atoms are satisfiable together.

    With `exact`, numbers are taken as exact ones; what is impossible then may be possible with
    rounded ones.
    """

    def __init__(
        self,
        session: Session,
        numbering: Numbering,
        atoms: Sequence[Atom],
        *,
        exact: bool,
    ) -> None:
        if not spend("proof", _OF_A_THEORY):
            raise UnsureError(OUT_OF_STEPS)
        items, reached = _quantified(atoms, numbering)
        self._conditions = Conditions(numbering, items, exact=exact)
        for value in numbering.named():  # so that no chain of lets is followed by deep recursion
            if id(value) in reached:
                self._conditions.prepare(value)
        terms = [self._term(atom) for atom in atoms]
        rounding = self._conditions.rounding
        if rounding.is_large:
            raise UnsureError("too many sums are compared in one table")
        self.rounds = rounding.matters
        facts = [*self._conditions.laws, *rounding.facts()]
        facts += [_arrival(atom.variable) for atom in atoms if _is_arrival(atom)]
        self._session, self.context = session, session.context
        # What z3.Solver would ask, too, as there are assumptions; its strategies take time to make.
        self._solver = z3.SimpleSolver(ctx=self.context)
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
        said = [self.literal(*answer) for answer in answers]
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

    def literal(self, atom: Atom, yes: bool) -> Any:
        """The term that the answer to the question of an atom is yes, or no."""
        return self._answers[atom] if yes else z3.Not(self._answers[atom])

    def arrived(self, arrival: Arrival, test: str) -> Any:
        """The term that an input is fresh, or present."""
        return arrived(arrival.peer, arrival.element, test).translate(self.context)

    def _check(self, assumed: Sequence[Any]) -> bool:
        allowed = remaining("proof")
        if allowed < MOST_STEPS:
            self._solver.set("rlimit", max(allowed, 1))
        found = self._solver.check(*assumed)
        spend("proof", self._session.steps(self._solver))
        if found == z3.unknown:
            within = "bounds" if allowed >= MOST_STEPS else "the steps that this run has left"
            raise UnsureError(f"the solver found no answer within {within}")
        return bool(found == z3.sat)

    def _term(self, atom: Atom) -> Any:
        variable = atom.variable
        match variable:
            case Arrival(peer=peer, element=element):
                return arrived(peer, element, atom.test)
            case EnumItem(expr=item) if item is not None:
                return self._conditions.boolean(IsOneOf(item, atom.test, type=Bool()))
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


# The questions of a proof that are too large for tables, as questions to z3.


MOST_FACTS = 24
"""Facts of a witness that are tried one by one for whether they matter."""
MOST_QUESTIONS = 400
"""Questions to z3 for one decision."""


def solve(
    rounded: Theory,
    exact: Callable[[], Theory],
    conditions: Sequence[Formula],
    assumed: Sequence[Formula],
) -> Decision:
    """Whether exactly one of the conditions holds where everything assumed does.

    The theory of `exact` numbers is asked where that of floats, which all runs satisfy, refutes.
    What exact numbers refute is a fault; which rows may apply is always a question about floats.

    Raises:
        UnsureError: the question is too hard.
    """
    decision = _Question(rounded, conditions, assumed).decision()
    witness = decision.gap or decision.overlap
    if witness is None or not rounded.rounds:
        return decision
    without_rounding = _Question(exact(), conditions, assumed).decision()
    if without_rounding.proved:
        return rounding(decision, witness.facts)
    return replace(decision, gap=without_rounding.gap, overlap=without_rounding.overlap)


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
        """The condition of a pair that can be narrowed, since it holds where no other one does.

        Narrowed, it still holds there, so it does not become equal to another one.
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
        told = [z3.BoolVal(True, self._theory.context)]  # there may be no answer
        told += [self._theory.literal(*answer) for answer in answers]
        some = self._may_hold([*self._context, fault, z3.Not(z3.And(told))])
        return Witness(facts, answers=said, some=some)

    def _answers(self, fault: list[Any], no_fault: Any) -> list[Answered] | None:
        """Answers to what is asked that always lead to the fault; None if nothing does."""
        model = self._model(fault)
        if model is None:
            return None
        answers = [
            (atom, z3.is_true(model.eval(self._theory.literal(atom, True), model_completion=True)))
            for atom in self._asked
            if atom.expr
        ]
        kept = list(answers)
        for item in answers if len(answers) <= MOST_FACTS else ():
            rest = [other for other in kept if other is not item]
            said = [self._theory.literal(*other) for other in rest]
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
        """Whether something may be possible; no verdict depends on it."""
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
        return self._theory.literal(formula.atom, formula.kind == "atom")
