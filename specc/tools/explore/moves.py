"""A machine between two periods, its moves, and the branches of a period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from specc.model import expr as m
from specc.proof import InputName

OVER = -1
"""The clock of a machine that has failed: others go on until its outputs are due."""
STAYS = -2
"""In place of the clock of a machine that stays in its state: it is set by what steps it."""
SentValues = tuple[tuple[InputName, int], ...]
"""Outputs with the numbers of their values."""


class Local(NamedTuple):
    """A machine between two periods: memory in numbers, and answers about unknown values."""

    state: str
    clock: int
    memory: tuple[int, ...]
    answers: frozenset[int]


class Move(NamedTuple):
    """The step of a machine at a time stamp.

    `row` is an index, -1 for none. `free` are the conditions that could have turned out otherwise;
    `lost` are inputs that were fresh and not looked at, or came with a member that was not reacted
    to, which is named; `broken` are assumptions that failed.
    """

    source: str
    target: str
    row: int
    sent: SentValues
    free: tuple[str, ...] = ()
    lost: tuple[tuple[InputName, str], ...] = ()
    broken: tuple[int, ...] = ()


class Outcome(NamedTuple):
    """A possible result of a period: the number of the machine after it, and its move.

    If a fault `ends` the run, the machine has not moved.
    """

    local: int
    move: Move
    ends: bool = False


@dataclass(frozen=True, slots=True)
class Branch:
    """A branch of a period: the row, or -1, and the conditions that hold on it."""

    row: int
    target: str
    holds: tuple[m.Expr, ...]
    fails: bool = False
    """Whether the next condition cannot be computed, so that the step fails."""
