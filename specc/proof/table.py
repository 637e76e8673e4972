"""Truth tables over the answers that are consistent with each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from specc.limits import OUT_OF_STEPS, spend
from specc.proof.formula import (
    Answered,
    Answers,
    Atom,
    Formula,
    ItemCollection,
    Variable,
    in_order,
)
from specc.proof.verdict import TooLargeError

# Truth tables as long integers: bit i is the value of a formula in the i-th combination.
#
# Combinations range over the consistent answers to the questions about each variable, so exclusive
# atoms never hold together.


LIMIT = 2**18
"""Most combinations that are tried."""
MOST_KINDS = 2**14
"""Most kinds of items, times answers about all of them, that are tried for one collection."""


@dataclass(frozen=True, slots=True)
class Column:
    """The answers to the atoms of a variable; consecutive ones are `stride` combinations apart."""

    variable: Variable
    atoms: tuple[Atom, ...]
    answers: tuple[Answers, ...]
    stride: int


class Table:
    """The combinations of all atoms of some formulas.

    Raises:
        TooLargeError: there are more than `LIMIT`.
    """

    def __init__(self, formulas: Iterable[Formula]) -> None:
        groups: dict[Variable, dict[Atom, None]] = {}
        parts = in_order(formulas)
        for atom in (part.atom for part in parts if part.atom is not None):
            groups.setdefault(atom.variable, {})[atom] = None
        walked = 3 * len(parts)  # for what they are about, what they ask and their bits
        steps = walked + sum(1 + len(atoms) ** 2 for atoms in groups.values())
        if not spend("proof", steps):
            raise TooLargeError(OUT_OF_STEPS)
        columns: list[Column] = []
        self.size = 1
        for variable, atoms in groups.items():
            tests = [atom.test for atom in atoms]
            if isinstance(variable, ItemCollection):
                answers = _collection_answers(variable, tests)
            else:
                answers = variable.answers(tests)
            columns.append(Column(variable, tuple(atoms), tuple(answers), self.size))
            self.size *= len(answers)
            if self.size > LIMIT:
                raise TooLargeError(f"more than {LIMIT} combinations of {len(groups)} facts")
        # An operation on bits takes about 1 us for as many.
        if not spend("proof", len(columns) * (1 + self.size // 50_000)):
            raise TooLargeError(OUT_OF_STEPS)
        self.columns = tuple(columns)
        self.full = (1 << self.size) - 1
        self._bits: dict[Formula, int] = {}

    def bits(self, formula: Formula) -> int:
        """The combinations in which a formula holds."""
        if formula not in self._bits:
            for part in in_order((formula,)):
                if part not in self._bits:
                    self._bits[part] = self._compute(part)
        return self._bits[formula]

    def all_of(self, formulas: Iterable[Formula]) -> int:
        """The combinations in which all formulas hold."""
        bits = self.full
        for formula in formulas:
            bits &= self.bits(formula)
        return bits

    def bits_of(self, atom: Atom) -> int:
        """The combinations in which the answer to the question of an atom is yes."""
        return self._atoms[atom]

    def where_answered(self, answers: Iterable[Answered]) -> int:
        """The combinations with some answers."""
        bits = self.full
        for atom, yes in answers:
            bits &= self.bits_of(atom) if yes else self.full ^ self.bits_of(atom)
        return bits

    def where(self, column: Column, answer: int) -> int:
        """The combinations with one answer of a column."""
        return self._repeated(column, ((1 << column.stride) - 1) << (answer * column.stride))

    def answers_at(self, combination: int) -> tuple[int, ...]:
        """The answer of each column in a combination."""
        return tuple(combination // c.stride % len(c.answers) for c in self.columns)

    def _compute(self, formula: Formula) -> int:
        match formula.kind:
            case "true":
                return self.full
            case "false":
                return 0
            case "and":
                bits = self.full
                for part in formula.parts:
                    bits &= self._bits[part]
                return bits
            case "or":
                bits = 0
                for part in formula.parts:
                    bits |= self._bits[part]
                return bits
        assert formula.atom is not None
        bits = self._atoms[formula.atom]
        return bits if formula.kind == "atom" else self.full ^ bits

    @cached_property
    def _atoms(self) -> dict[Atom, int]:
        found = {}
        for column in self.columns:
            block = (1 << column.stride) - 1
            for index, atom in enumerate(column.atoms):
                yes = [i for i, answer in enumerate(column.answers) if answer[index]]
                period = sum(block << (i * column.stride) for i in yes)
                found[atom] = self._repeated(column, period)
        return found

    def _repeated(self, column: Column, period: int) -> int:
        bits, length = period, column.stride * len(column.answers)
        while length < self.size:
            bits |= bits << length
            length *= 2
        return bits & self.full


def _collection_answers(variable: ItemCollection, tests: list[Formula]) -> list[Answers]:
    """Which tests some item passes: for every set of kinds of items that can be there."""
    kinds = _kinds_of_items(tests)
    fewest = {(False,) * len(tests): 0}
    for kind in kinds:
        if len(fewest) * len(kinds) > MOST_KINDS:
            raise TooLargeError(f"{len(tests)} quantifiers over {len(kinds)} kinds of items")
        for answer, count in list(fewest.items()):
            both = tuple(a or b for a, b in zip(answer, kind, strict=True))
            fewest[both] = min(count + 1, fewest.get(both, count + 1))
    nothing = (False,) * len(tests)
    if variable.size is None:
        found = list(fewest)
        return found if not variable.nonempty or nothing in kinds else found[1:]
    possible = [a for a, count in fewest.items() if count <= variable.size and a != nothing]
    return possible + ([nothing] if nothing in kinds or not variable.size else [])


def _kinds_of_items(tests: list[Formula]) -> list[Answers]:
    """The answers that one item can give to all tests."""
    table = Table(tests)
    kinds: list[tuple[Answers, int]] = [((), table.full)]
    for test in tests:
        bits = table.bits(test)
        split = [(((*k, True)), left & bits) for k, left in kinds]
        split += [(((*k, False)), left & ~bits) for k, left in kinds]
        kinds = [(kind, left) for kind, left in split if left]
        if len(kinds) ** 2 > MOST_KINDS:
            raise TooLargeError(f"quantifiers over more than {len(kinds)} kinds of items")
    return [kind for kind, _ in kinds]
