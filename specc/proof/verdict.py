"""What was decided about the rows of a state and cause, and why something was not."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Protocol

from specc.model.expr import Expr, Fresh, Input, Present
from specc.model.fsm import Transition
from specc.model.types import Bool

# Why there is no answer.


class TooLargeError(Exception):
    """The formulas have too many combinations for tables; the message says how many of what."""


class SolverError(Exception):
    """The solver gave no answer within its bounds, or is not installed; the message says so."""

    def __init__(self, reason: str, way_out: str = "") -> None:
        super().__init__(reason)
        self.way_out = way_out


# What the proofs say.


InputName = tuple[str, str]
"""Peer and name of an input element."""
InputNames = frozenset[InputName]


def freshness(name: InputName) -> Fresh:
    """The condition that an input is fresh."""
    return Fresh(Input(*name, type=Bool()), type=Bool())


def presence(name: InputName) -> Present:
    """The condition that an input has a value."""
    return Present(Input(*name, type=Bool()), type=Bool())


FactTexts = tuple[tuple[str, str], ...]
"""Questions as the specification puts them, with their answers in words."""

TruthAssignment = tuple[tuple[Expr, bool], ...]
"""The same as expressions with their truth values."""


@dataclass(frozen=True, slots=True)
class Witness:
    """Situations in which not exactly one of several conditions holds.

    `facts` leave out what does not matter, and `answers` are the same as expressions. They are all
    the situations there are, or `everywhere` holds in all of them and in no other; where this would
    take too many words, the witness `is_partial`.

    `holding` are indices of conditions that all hold. `repair` is what replaces the condition of
    index `repaired`. It is None where one of the conditions that hold has to be removed, since
    others hold wherever it does.
    """

    facts: FactTexts
    holding: tuple[int, ...] = ()
    repair: Expr | None = None
    repaired: int | None = None
    answers: TruthAssignment = ()
    everywhere: Expr | None = None
    is_partial: bool = False

    def excludes_freshness(self, elements: Collection[InputName]) -> bool:
        """Whether it says that one of some inputs is not fresh."""
        return any(
            isinstance(question, Fresh) and not yes and question.input.key in elements
            for question, yes in self.answers
        )


@dataclass(frozen=True, slots=True)
class SolverAnswer:
    """What the solver says of an open question: what refutes it, or why it does not tell."""

    gap: Witness | None = None
    overlap: Witness | None = None
    unknown: str = ""
    way_out: str = ""

    @property
    def proved(self) -> bool:
        """Whether exactly one condition holds, whatever the floats of a run are."""
        return not (self.gap or self.overlap or self.unknown)


class OpenQuestion(Protocol):
    """Whether exactly one of several conditions holds, left open by tables."""

    def solve(self) -> SolverAnswer:
        """What the solver says, if it is installed."""

    def witness_of(self, value: Callable[[Expr], object], holding: tuple[int, ...]) -> Witness:
        """The witness of a situation in which the conditions `holding` do.

        `value` gives what expressions are worth in it; None where they have no value.
        """


@dataclass(frozen=True, slots=True)
class Decision:
    """Whether exactly one of several conditions holds in a context.

    Where the question is too large, `unknown` says why, and everything is taken to be possible.
    """

    possible: bool
    """Whether the context can arise at all; if not, the rest holds of nothing."""
    satisfiable: tuple[bool, ...]
    """For each condition, whether it can hold in the context."""
    ensures: tuple[frozenset[InputName], ...]
    """For each condition, inputs that have a value whenever it holds in the context."""
    gap: Witness | None = None
    """Where no condition holds."""
    overlap: Witness | None = None
    """Where two conditions hold."""
    unknown: str = ""
    """Why it is not decided."""
    way_out: str = ""
    """How to have it proved, where that depends on what is unknown."""
    open: OpenQuestion | None = field(default=None, compare=False, repr=False)
    """What the solver may answer of it, and values may show; the answer changes no other part."""

    @property
    def proved(self) -> bool:
        """Whether neither a gap nor an overlap is possible."""
        return not (self.gap or self.overlap or self.unknown)


@dataclass(frozen=True, slots=True)
class RowVerdict:
    """A decision about the rows of one state and cause; its indices are those of `rows`."""

    rows: tuple[Transition, ...]
    decision: Decision
    arrivals: frozenset[InputName] = frozenset()
    """Inputs that it depends on whether they have arrived."""

    def where_fresh(self, decision: Decision, fresh: Collection[InputName]) -> RowVerdict:
        """This verdict where some inputs are known to be fresh, with the `decision` then.

        Which rows may apply, and what they ensure, stays; so does a witness that may still be.
        """
        mine = self.decision
        if mine.open:
            return self.refuted_by(decision)
        gap, overlap = (
            None if now is None or was is None or was.excludes_freshness(fresh) else was
            for was, now in ((mine.gap, decision.gap), (mine.overlap, decision.overlap))
        )
        return self.refuted_by(
            replace(decision, gap=gap or decision.gap, overlap=overlap or decision.overlap)
        )

    def refuted_by(self, decision: Decision) -> RowVerdict:
        """This verdict with other refutations; which rows may apply and what they ensure stays."""
        mine = self.decision
        found = replace(
            decision,
            possible=mine.possible if self.rows else decision.possible,
            satisfiable=mine.satisfiable,
            ensures=mine.ensures,
        )
        return RowVerdict(self.rows, found, self.arrivals)

    @property
    def proved(self) -> bool:
        """Whether exactly one row applies whenever the cause occurs."""
        return self.decision.proved


# Where tables do not tell.


INSTALL = (
    "the generated code checks it in every run; to know whether it can fail, "
    "`pip install '.[proof]'` in a checkout of specc"
)
ROUNDED = (
    "the generated code checks it in every run; to have it proved, compare one and the same sum "
    "in all rows, as in `a + b < c` and `not (a + b < c)`"
)
TIMED = (
    "the generated code checks it in every run; to have it proved, compare `elapsed` itself with "
    "constants"
)


def untracked_time(refuted: Decision, question: str) -> Decision:
    """A refutation that is taken back: proofs do not follow how the question changes with time."""
    return replace(
        refuted,
        gap=None,
        overlap=None,
        unknown=f"proofs do not follow how `{question}` changes with the time",
        way_out=TIMED,
    )
