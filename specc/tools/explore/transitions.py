"""A machine between two periods, its transitions, and the branches of a period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from specc.model import expr as m
from specc.proof import InputName

FAILED = -1
"""The clock of a machine that has failed: others go on until its outputs are due."""
SAME_STATE = -2
"""The clock of a machine that stays in its state; the caller sets the real one."""
SentValues = tuple[tuple[InputName, int], ...]
"""Outputs with the numbers of their values."""


class MachineState(NamedTuple):
    """A machine between two periods: memory in numbers, and answers about unknown values."""

    state: str
    clock: int
    memory: tuple[int, ...]
    answers: frozenset[int]


class Transition(NamedTuple):
    """The step of a machine at a time stamp.

    `row` is an index, -1 for none. `choices` are the conditions that could have been false;
    `lost` are fresh inputs that were not read, or the member of an event without a reaction;
    `broken` are assumptions that failed. `counts` are numbers in memory that are assigned, and of
    which only a region is known before or after, each with the least amount by which it surely
    grows, or shrinks; 0 for neither.
    """

    source: str
    target: str
    row: int
    sent: SentValues
    choices: tuple[str, ...] = ()
    lost: tuple[tuple[InputName, str], ...] = ()
    broken: tuple[int, ...] = ()
    counts: tuple[tuple[str, float], ...] = ()


class Successor(NamedTuple):
    """A possible result of a period: the number of the machine after it, and its move.

    If a fault `ends_run`, the machine has not moved.
    """

    state: int
    transition: Transition
    ends_run: bool = False


@dataclass(frozen=True, slots=True)
class Branch:
    """A branch of a period: the row, or -1, and the conditions that hold on it."""

    row: int
    target: str
    conditions: tuple[m.Expr, ...]
    may_fail: bool = False
    """Whether the next condition cannot be computed, so that the step fails."""
