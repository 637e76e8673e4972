"""Combinations of a table that may come about: those that the solver refutes are struck off."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from specc.proof.formula import Formula
from specc.proof.relations import Answered, Judge, UnsureError
from specc.proof.table import Table

Refute = Callable[[Sequence[Answered]], tuple[Answered, ...] | None]

MOST_CHECKS = 300
"""Combinations of one table that are shown to the solver."""


class Cases:
    """The combinations in which everything assumed holds."""

    def __init__(
        self,
        table: Table,
        assumed: Sequence[Formula],
        judge: Judge | None,
        context: Sequence[Formula] = (),
    ) -> None:
        """Without a judge, all combinations may come about. The `context` is assumed, too."""
        self._table = table
        self._judge = judge
        self._checks = 0
        self.allowed = table.full
        for formula in assumed:
            self.allowed &= table.bits(formula)
        self._rounded = 0
        self.context = tuple(context)

    @property
    def conceivable(self) -> int:
        """The combinations that exact or rounded numbers may bring about."""
        return self.allowed | self._rounded

    def some(self, bits: int) -> int:
        """`bits` without combinations that cannot be, so that the first one left can be; or 0.

        Raises:
            UnsureError: the solver does not say.
        """
        while bits := bits & self.allowed:
            core = self._conflict(self._judge.exact.conflict, bits) if self._judge else None
            if core is None:
                return bits
            assert self._judge is not None  # it found the conflict
            struck = self._having(core)
            if self._judge.rounded.conflict(core) is None:
                self._rounded |= struck & self.allowed
            self.allowed &= ~struck
        return 0

    def some_rounded(self, bits: int) -> int:
        """Like `some`, of the combinations that only rounded numbers can bring about."""
        while bits := bits & self._rounded:
            assert self._judge is not None  # only a judge knows of rounding
            core = self._conflict(self._judge.rounded.conflict, bits)
            if core is None:
                return bits
            self._rounded &= ~self._having(core)
        return 0

    def _conflict(self, refute: Refute, bits: int) -> tuple[Answered, ...] | None:
        self._checks += 1
        if self._checks > MOST_CHECKS:
            raise UnsureError("too many numbers are compared in one table")
        return refute(self._answers(bits))

    def _answers(self, bits: int) -> list[Answered]:
        """The answers in the first combination."""
        combination = (bits & -bits).bit_length() - 1
        answers = zip(self._table.columns, self._table.answers_at(combination), strict=True)
        return [
            answered
            for column, answer in answers
            for answered in zip(column.atoms, column.answers[answer], strict=True)
        ]

    def _having(self, answers: Sequence[Answered]) -> int:
        bits = self._table.full
        for atom, yes in answers:
            asked = self._table.bits_of(atom)
            bits &= asked if yes else self._table.full ^ asked
        return bits
