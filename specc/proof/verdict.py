"""What the proofs say."""

from __future__ import annotations

from dataclasses import dataclass

from specc.model.expr import Expr
from specc.model.fsm import Transition

InputName = tuple[str, str]
"""Peer and name of an input element."""

Facts = tuple[tuple[str, str], ...]
"""Questions as the specification puts them, with their answers in words."""

Answers = tuple[tuple[Expr, bool], ...]
"""The same as expressions with their truth values."""


@dataclass(frozen=True, slots=True)
class Witness:
    """A situation in which not exactly one of several conditions holds.

    `facts` leave out what does not matter; `holding` are indices of conditions that all hold.
    `repair` is what a new condition, or instead of it the condition of index `repaired`, could ask;
    it is None where one of two equal conditions has to go. `answers` are the facts as expressions.
    """

    facts: Facts
    holding: tuple[int, ...] = ()
    repair: Expr | None = None
    repaired: int | None = None
    answers: Answers = ()


@dataclass(frozen=True, slots=True)
class Decision:
    """Whether exactly one of several conditions holds in a context.

    Where the question is too large, `unknown` says why, and everything is taken to be possible.
    """

    possible: bool = True
    """Whether the context can arise at all; if not, the rest holds of nothing."""
    gap: Witness | None = None
    """Where no condition holds."""
    overlap: Witness | None = None
    """Where two conditions hold."""
    unknown: str = ""
    way_out: str = ""
    """How to have it proved, where that depends on what is unknown."""
    satisfiable: tuple[bool, ...] = ()
    """For each condition, whether it can hold in the context."""
    ensures: tuple[frozenset[InputName], ...] = ()
    """For each condition, inputs that have a value whenever it holds in the context."""

    @property
    def proved(self) -> bool:
        """Whether neither a gap nor an overlap is possible."""
        return not (self.gap or self.overlap or self.unknown)


@dataclass(frozen=True, slots=True)
class RowVerdict:
    """A decision about the rows of one state and cause; its indices are those of `rows`."""

    rows: tuple[Transition, ...]
    decision: Decision

    @property
    def proved(self) -> bool:
        """Whether exactly one row applies whenever the cause occurs."""
        return self.decision.proved
