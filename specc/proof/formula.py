"""Propositional formulas over atoms, shared: two equal formulas of one factory are one object."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

from specc.expr import show
from specc.model.expr import Expr
from specc.proof.variables import Variable


@dataclass(frozen=True, slots=True)
class Atom:
    """A question about the value of a variable; `expr` is how the specification asks it.

    `text_holds` says for which answer that is true: `x > 1` stands for the atom x <= 1 with False.
    An `unsure` one may have other answers in a run than proofs take to be possible.
    """

    variable: Variable
    test: Any
    expr: Expr | None = field(compare=False, default=None)
    text_holds: bool = field(compare=False, default=True)
    unsure: bool = field(compare=False, default=False)

    @property
    def text(self) -> str:
        """The question in the language."""
        return "" if self.expr is None else show(self.expr)


@dataclass(frozen=True, slots=True, eq=False)
class Formula:
    """In negation normal form: only atoms are negated. `index` orders parts before wholes."""

    kind: Literal["true", "false", "atom", "negated", "and", "or"]
    index: int
    atom: Atom | None = None
    parts: tuple[Formula, ...] = ()


class Formulas:
    """Makes formulas, simplified as far as constants and repetition go."""

    def __init__(self) -> None:
        self._made: dict[object, Formula] = {}
        self._negations: dict[Formula, Formula] = {}
        self.true = self._make("true")
        self.false = self._make("false")
        self._negations |= {self.true: self.false, self.false: self.true}

    def constant(self, value: bool) -> Formula:
        """True or false."""
        return self.true if value else self.false

    def atom(self, atom: Atom) -> Formula:
        """The formula that is true when the answer to the atom's question is yes."""
        return self._make("atom", atom)

    def negation(self, formula: Formula) -> Formula:
        """`not formula`."""
        known = self._negations.get(formula)
        if known is None:
            known = self._negations[formula] = self._negate(formula)
            self._negations[known] = formula
        return known

    def conjunction(self, parts: Iterable[Formula]) -> Formula:
        """All of `parts`."""
        return self._join("and", parts, self.true, self.false)

    def disjunction(self, parts: Iterable[Formula]) -> Formula:
        """Any of `parts`."""
        return self._join("or", parts, self.false, self.true)

    def choice(self, test: Formula, then: Formula, otherwise: Formula) -> Formula:
        """`then if test else otherwise`."""
        if then is otherwise:
            return then
        held = self.conjunction((test, then))
        return self.disjunction((held, self.conjunction((self.negation(test), otherwise))))

    def _negate(self, formula: Formula) -> Formula:
        if formula.kind == "atom":
            return self._make("negated", formula.atom)
        parts = [self.negation(part) for part in formula.parts]
        return self.disjunction(parts) if formula.kind == "and" else self.conjunction(parts)

    def _join(
        self, kind: Literal["and", "or"], parts: Iterable[Formula], none: Formula, end: Formula
    ) -> Formula:
        kept: dict[Formula, None] = {}
        for part in parts:
            kept |= dict.fromkeys(part.parts if part.kind == kind else (part,))
        kept.pop(none, None)
        if end in kept or any(self._negations.get(part) in kept for part in kept):
            return end
        if len(kept) < 2:
            return next(iter(kept), none)
        ordered = tuple(sorted(kept, key=lambda part: part.index))
        return self._make(kind, None, ordered)

    def _make(
        self, kind: Any, atom: Atom | None = None, parts: tuple[Formula, ...] = ()
    ) -> Formula:
        key = (kind, atom, parts)
        if key not in self._made:
            self._made[key] = Formula(kind, len(self._made), atom, parts)
        return self._made[key]


def in_order(formulas: Iterable[Formula]) -> list[Formula]:
    """The formulas and all their parts, each once, parts first."""
    found: set[Formula] = set()
    open_ = list(formulas)
    while open_:
        formula = open_.pop()
        if formula not in found:
            found.add(formula)
            open_ += formula.parts
    return sorted(found, key=lambda formula: formula.index)


def atoms_of(formulas: Iterable[Formula]) -> Iterator[Atom]:
    """Every atom of the formulas, each once, in the order in which they were made."""
    seen: set[Atom] = set()
    for formula in in_order(formulas):
        if formula.atom is not None and formula.atom not in seen:
            seen.add(formula.atom)
            yield formula.atom
