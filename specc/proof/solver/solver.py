"""The questions of a proof as questions to z3.

Numbers are integers and reals with linear arithmetic, vectors are taken by component, operators are
unknown functions. A quantifier is a fact of its own here, which may hold whatever its items are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import z3

from specc.proof.formula import Atom, Formula, atoms_of, in_order
from specc.proof.numbering import Numbering
from specc.proof.solver.arithmetic import Arithmetic
from specc.proof.variables import Arrival, Collection, EnumItem, Label, Quantity
from specc.proof.verdict import Answers, Decision, Facts, InputName, Witness

LONGEST_MS = 2000
"""Time for one question."""
MOST_FACTS = 24
"""Facts of a witness that are tried one by one for whether they matter."""


class UnsureError(Exception):
    """The solver gave no answer in time; the message says so."""


class Solver:
    """Answers the questions about one subsystem that are too hard for tables."""

    def __init__(self, numbering: Numbering) -> None:
        self._arithmetic = Arithmetic(numbering)
        self._known: dict[Formula, Any] = {}
        self._atoms: dict[Atom, Any] = {}

    def decide(self, conditions: Sequence[Formula], assumed: Sequence[Formula]) -> Decision:
        """Whether exactly one of the conditions holds where everything assumed does.

        Raises:
            UnsureError: the question is too hard.
        """
        formulas = [*conditions, *assumed]
        arrivals = {a.variable for a in atoms_of(formulas) if isinstance(a.variable, Arrival)}
        rows = [self._of(condition) for condition in conditions]
        context = [self._of(formula) for formula in assumed]
        context += self._arithmetic.bounds()
        asked = list(atoms_of(conditions))
        ensures = [self._ensured([*context, row], arrivals) for row in rows]
        return Decision(
            possible=self._holds(context),
            gap=self._gap(rows, context, asked),
            overlap=self._overlap(rows, context, asked),
            satisfiable=tuple(self._holds([*context, row]) for row in rows),
            ensures=tuple(ensures),
        )

    def _gap(self, rows: list[Any], context: list[Any], asked: list[Atom]) -> Witness | None:
        answers = self._answers([*context, *map(z3.Not, rows)], context, z3.Or(rows), asked)
        return None if answers is None else Witness(_facts(answers), answers=_said(answers))

    def _overlap(self, rows: list[Any], context: list[Any], asked: list[Atom]) -> Witness | None:
        for second, row in enumerate(rows):
            for first in range(second):
                both = z3.And(rows[first], row)
                answers = self._answers([*context, both], context, z3.Not(both), asked)
                if answers is not None:
                    return Witness(
                        _facts(answers), (first, second), repaired=second, answers=_said(answers)
                    )
        return None

    def _answers(
        self, fault: list[Any], context: list[Any], no_fault: Any, asked: list[Atom]
    ) -> list[tuple[Atom, bool]] | None:
        """Answers to what is asked that always lead to the fault; None if nothing does."""
        model = self._model(fault)
        if model is None:
            return None
        if any(isinstance(atom.variable, Collection) for atom in self._atoms):
            raise UnsureError("a quantifier in too large a question")
        answers = [(a, z3.is_true(model.eval(self._atom(a), True))) for a in asked if a.expr]
        kept = list(answers)
        for item in answers if len(answers) <= MOST_FACTS else ():
            rest = [other for other in kept if other is not item]
            if not self._holds([*context, no_fault, *(self._said(a, y) for a, y in rest)]):
                kept = rest
        return kept

    def _said(self, atom: Atom, yes: bool) -> Any:
        return self._atom(atom) if yes else z3.Not(self._atom(atom))

    def _ensured(self, context: list[Any], arrivals: Iterable[Any]) -> frozenset[InputName]:
        return frozenset(
            (arrival.peer, arrival.element)
            for arrival in arrivals
            if not self._holds([*context, z3.Not(_arrived(arrival, "present"))])
        )

    def _holds(self, parts: Sequence[Any]) -> bool:
        return self._model(parts) is not None

    def _model(self, parts: Sequence[Any]) -> Any:
        """Values with which all parts hold; None if there are none."""
        solver = z3.Solver()
        solver.set("timeout", LONGEST_MS)
        solver.add(*parts, *map(_lawful, self._atoms))
        found = solver.check()
        if found == z3.unknown:
            raise UnsureError("the solver found no answer in time")
        return solver.model() if found == z3.sat else None

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
                return z3.BoolVal(formula.kind == "true")
        assert formula.atom is not None
        atom = self._atom(formula.atom)
        return atom if formula.kind == "atom" else z3.Not(atom)

    def _atom(self, atom: Atom) -> Any:
        if atom not in self._atoms:
            self._atoms[atom] = self._question(atom)
        return self._atoms[atom]

    def _question(self, atom: Atom) -> Any:
        variable = atom.variable
        match variable:
            case Arrival():
                return _arrived(variable, atom.test)
            case EnumItem(members=members):
                item = z3.Int(f"item {variable.of}")
                return z3.Or([item == members.index(m) for m in sorted(atom.test)])
            case Label():
                return z3.String(f"text {variable.of}") == z3.StringVal(atom.test)
            case Quantity():
                return self._arithmetic.comparison(variable, atom)
        return z3.Bool(f"fact {variable.of} {atom.test.index if atom.test else ''}")


def _facts(answers: list[tuple[Atom, bool]]) -> Facts:
    return tuple((a.text, "true" if yes == a.text_holds else "false") for a, yes in answers)


def _said(answers: list[tuple[Atom, bool]]) -> Answers:
    return tuple((a.expr, yes == a.text_holds) for a, yes in answers if a.expr is not None)


def _arrived(arrival: Arrival, test: str) -> Any:
    return z3.Bool(f"{test} {arrival.peer}.{arrival.element}")


def _lawful(atom: Atom) -> Any:
    """What is true of a variable whatever its value."""
    variable = atom.variable
    match variable:
        case Arrival():
            present = _arrived(variable, "present")
            law = z3.Implies(_arrived(variable, "fresh"), present)
            return z3.And(law, present) if variable.always_present else law
        case EnumItem(members=members):
            item = z3.Int(f"item {variable.of}")
            return z3.And(item >= 0, item < len(members))
    return z3.BoolVal(True)
