"""Formulas over the unknowns of a subsystem: questions, answers, Boolean structure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, Literal

from specc.lang import show
from specc.limits import spend
from specc.model.expr import COMPARISONS, Expr
from specc.reachable import reachable

# What conditions ask about. Atoms of one variable are related; those of different ones are not.


Answers = tuple[bool, ...]
"""Answers to the questions about one variable, in the order of the questions."""

ValueNumber = int
"""A value number: equal for expressions that have the same value (see `specc.proof.numbering`)."""


@dataclass(frozen=True, slots=True)
class Flag:
    """A truth value about which nothing else is known; its only question is None."""

    number: ValueNumber

    def answers(self, tests: Sequence[None]) -> list[Answers]:
        """False and true."""
        return [(False,) * len(tests), (True,) * len(tests)]


@dataclass(frozen=True, slots=True)
class EnumItem:
    """One member of an enum; a question is a set of members."""

    number: ValueNumber
    members: tuple[str, ...]
    expr: Expr | None = field(compare=False, default=None)

    @property
    def text(self) -> str:
        """The item in the language."""
        return "" if self.expr is None else show(self.expr)

    def answers(self, tests: Sequence[frozenset[str]]) -> list[Answers]:
        """One for every member that the questions tell apart."""
        return _distinct([tuple(m in test for test in tests) for m in self.members])


@dataclass(frozen=True, slots=True)
class Label:
    """A text; a question is a text that it may be equal to."""

    number: ValueNumber

    def answers(self, tests: Sequence[str]) -> list[Answers]:
        """Equal to one of the texts or to none."""
        return [(False,) * len(tests)] + [tuple(a == b for a in tests) for b in tests]


@dataclass(frozen=True, slots=True)
class Arrival:
    """An element of an input buffer: without a value, with an old one, or fresh."""

    peer: str
    element: str
    always_present: bool

    def answers(self, tests: Sequence[Literal["fresh", "present"]]) -> list[Answers]:
        """A fresh element is present."""
        states = [{"present"}, {"fresh", "present"}]
        if not self.always_present:
            states.insert(0, set())
        return _distinct([tuple(test in state for test in tests) for state in states])


Threshold = tuple[str, float]
"""One of <, <= and ==, and the constant to compare with."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number; a question compares it with a constant."""

    kind: Literal["value", "difference", "distance", "periods"]
    numbers: tuple[ValueNumber, ...]
    """One number of a value; two of a difference, or of the distance that `near` judges; none of
    the number of periods that the state has lasted."""
    is_integer: bool
    """Whether it is an integer."""
    least: float | None = None
    """A lower bound by its nature, as of a length."""

    def answers(self, tests: Sequence[Threshold]) -> list[Answers]:
        """The possible answers to all tests.

        There is one for each threshold that the quantity can equal, and one for each gap between
        thresholds that it can lie in.
        """
        thresholds = sorted({value for _, value in tests})
        found = []
        below = -math.inf
        for value in thresholds:
            if self._has_value_between(below, value):
                found.append(tuple(t >= value and op != "==" for op, t in tests))
            is_possible = self.least is None or value >= self.least
            if is_possible and (not self.is_integer or value == math.floor(value)):
                found.append(tuple(COMPARISONS[op](value, t) for op, t in tests))
            below = value
        if below < math.inf:
            found.append((False,) * len(tests))
        return _distinct(found)

    def _has_value_between(self, below: float, above: float) -> bool:
        """Whether a value lies between, both ends excluded."""
        if above == -math.inf:
            return False
        if self.least is not None and self.least > below:
            return self.least < above if not self.is_integer else math.ceil(self.least) < above
        if below == -math.inf:
            return True
        if self.is_integer:
            return math.floor(below) + 1 < above
        # Beyond this size a whole number may lie between two floats.
        return abs(below) >= _ALL_WHOLE or math.nextafter(below, math.inf) < above


_ALL_WHOLE = 2.0**53


@dataclass(frozen=True, slots=True)
class PoseDistance:
    """How far two poses are from each other; a question has a distance and an angle."""

    numbers: tuple[ValueNumber, ValueNumber]

    def answers(self, tests: Sequence[tuple[float, float]]) -> list[Answers]:
        """Within which distances and angles: what is within one is within every larger one."""
        distances = [*sorted({d for d, _ in tests if d >= 0.0}), math.inf]
        angles = [*sorted({a for _, a in tests if a >= 0.0}), math.inf]
        return _distinct(
            [tuple(d <= e and a <= b for e, b in tests) for d in distances for a in angles]
        )


@dataclass(frozen=True, slots=True)
class ItemCollection:
    """Items of a vector or list; a question is a formula, asked of any item.

    Its answers need the tables of `specc.proof.table`.
    """

    number: ValueNumber
    size: int | None
    """Number of items; None for a list, which may be empty unless it is `nonempty`."""
    nonempty: bool = False


Variable = Flag | EnumItem | Label | Arrival | Quantity | PoseDistance | ItemCollection


def _distinct(answers: list[Answers]) -> list[Answers]:
    return list(dict.fromkeys(answers))


# Propositional formulas over atoms, shared: two equal formulas of one factory are one object.


@dataclass(frozen=True, slots=True)
class Atom:
    """A question about the value of a variable; `expr` is how the specification asks it.

    `holds_if` says for which answer that is true: `x > 1` stands for the atom x <= 1 with False.
    An uncertain one may have other answers in a run than proofs take to be possible.
    """

    variable: Variable
    test: Any
    expr: Expr | None = field(compare=False, default=None)
    holds_if: bool = field(compare=False, default=True)
    is_uncertain: bool = field(compare=False, default=False)

    @property
    def text(self) -> str:
        """The question in the language."""
        return "" if self.expr is None else show(self.expr)


Answered = tuple[Atom, bool]
"""A question, and whether the answer is yes."""


@dataclass(frozen=True, eq=False, slots=True)
class Formula:
    """In negation normal form: only atoms are negated. `index` orders parts before wholes."""

    kind: Literal["true", "false", "atom", "negated", "and", "or"]
    index: int
    atom: Atom | None = None
    parts: tuple[Formula, ...] = ()


_JOINED_IN_A_STEP = 2
"""Parts of a formula that are joined in about the time of a step of a proof."""


class Formulas:
    """Makes formulas, simplified as far as constants and repetition go.

    Parts that are joined count as steps of proofs. Whoever makes formulas asks whether they are
    used up before it makes more.
    """

    def __init__(self) -> None:
        self._formulas: dict[object, Formula] = {}
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
        if formula not in self._negations:
            for part in in_order((formula,), without=self._negations.keys()):
                if part not in self._negations:  # nor is it the negation of an earlier one
                    opposites = [self._negations[each] for each in part.parts]
                    match part.kind:
                        case "atom":
                            negated = self._make("negated", part.atom)
                        case "and":
                            negated = self.disjunction(opposites)
                        case _:
                            negated = self.conjunction(opposites)
                    self._negations[part] = negated
                    self._negations[negated] = part
        return self._negations[formula]

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
        then_case = self.conjunction((test, then))
        return self.disjunction((then_case, self.conjunction((self.negation(test), otherwise))))

    def substituted(self, formula: Formula, answer: Callable[[Atom], bool | None]) -> Formula:
        """The formula with answers to the questions of atoms; None leaves a question open."""
        found: dict[Formula, Formula] = {}
        for part in in_order((formula,)):
            parts = [found[each] for each in part.parts]
            if part.kind == "and":
                found[part] = self.conjunction(parts)
            elif part.kind == "or":
                found[part] = self.disjunction(parts)
            else:
                value = answer(part.atom) if part.atom is not None else None
                found[part] = (
                    part if value is None else self.constant(value == (part.kind == "atom"))
                )
        return found[formula]

    def _join(
        self, kind: Literal["and", "or"], parts: Iterable[Formula], none: Formula, end: Formula
    ) -> Formula:
        joined = dict.fromkeys(parts)
        if any(self._negations.get(part) in joined for part in joined):
            return end
        every = [part.parts if part.kind == kind else (part,) for part in joined]
        spend("proof", sum(map(len, every)) // _JOINED_IN_A_STEP)
        operands: dict[Formula, None] = {}
        for each in every:
            operands |= dict.fromkeys(each)
        operands.pop(none, None)
        if end in operands or any(self._negations.get(part) in operands for part in operands):
            return end
        if len(operands) < 2:
            return next(iter(operands), none)
        ordered = tuple(sorted(operands, key=lambda part: part.index))
        return self._make(kind, None, ordered)

    def _make(
        self, kind: Any, atom: Atom | None = None, parts: tuple[Formula, ...] = ()
    ) -> Formula:
        key = (kind, atom, parts)
        if key not in self._formulas:
            self._formulas[key] = Formula(kind, len(self._formulas), atom, parts)
        return self._formulas[key]


def in_order(formulas: Iterable[Formula], without: Set[Formula] = frozenset()) -> list[Formula]:
    """The formulas and all their parts, each once, parts first; nothing below those `without`."""

    def parts(formula: Formula) -> Iterator[Formula]:
        return (part for part in formula.parts if part not in without)

    found = reachable(formulas, parts if without else attrgetter("parts"))
    return sorted(found, key=attrgetter("index"))


def atoms_of(formulas: Iterable[Formula]) -> Iterator[Atom]:
    """Every atom of the formulas, each once, in the order in which they were made."""
    found = {id(atom): atom for f in in_order(formulas) if (atom := f.atom) is not None}
    yield from found.values()
