"""What earlier analyses of a text found out, for editors: what a change leaves alone is not redone.

An answer is kept with all that it follows from, and holds for as long as that is the same. A fresh
analysis gives the same answers; it only takes longer.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

_MOST = 1_000
"""Answers; of more the one that nobody has asked for the longest is dropped."""


@dataclass(slots=True)
class AnswerCache:
    """The last answer to each question. `spent` bounds the steps of proofs behind all of them."""

    spent: int = 0
    _answers: dict[str, tuple[object, Any]] = field(default_factory=dict)

    def answer(self, question: str, given: object) -> Any:
        """The answer that was kept, or None if it followed from anything but what is given."""
        known = self._answers.pop(question, None)
        if known is None or known[0] != given:
            return None
        self._answers[question] = known
        return known[1]

    def keep(self, question: str, given: object, answer: object) -> None:
        """Keep an answer, which is not None, and forget an earlier one."""
        self._answers.pop(question, None)
        self._answers[question] = given, answer
        if len(self._answers) > _MOST:
            del self._answers[next(iter(self._answers))]
