"""The limits of what specc reads, and of the steps that it spends.

Files come from strangers. What is larger or deeper than a limit is refused with a diagnostic that
names the limit. Work that does not follow from the size of a file, such as proofs, has allowances
for a whole run, counted in steps and not in seconds, so that all machines find the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

MAX_BYTES = 2_000_000
"""Of a specification file."""
MAX_VALUES = 100_000
"""In the files of one specification, with aliases written out."""
MAX_KEYS = 2_000
"""Of one mapping: of the states of a subsystem, say, or of the constants of a file."""
MAX_PARTS = 400
"""Agents, subsystems and devices that a file describes."""
MAX_COPIES = 1_000
"""That `for` makes of one part."""
MAX_ASSUMPTIONS = 400
"""Of a subsystem."""
MAX_REQUIREMENTS = 400
"""Of a system."""
MAX_DISTURBANCES = 100
"""Of a task, or of a scenario."""
MAX_SEEDS = 10_000
"""Of a scenario."""
MAX_DURATION_S = 86_400
"""Of a run of a scenario."""
MAX_SPAN_S = 600
"""Over which a temporal operator reaches: what a run must remember."""
MAX_DEPTH = 64
"""Levels of values, of types in types, of modes in modes, and of files that use files."""
MAX_FILES = 200
"""That one specification uses."""
MAX_ENTRIES = 100_000
"""Files and folders below a folder that a specification names."""
MAX_TYPE_PARTS = 2_000
"""Of a type with the types in it written out."""
MAX_EXPRESSION_PARTS = 2_000
"""Of an expression with the constants of a description written out."""
MAX_SPREAD_PARTS = 10_000
"""Of an expression that is written out for each of many peers."""
MAX_IGNORED = 20
"""Codes of one comment that suppresses findings."""
MAX_FAULTS = 999
"""Of the text of one file, and of its shape; what comes after the last is not looked at."""
MAX_SHOWN = 1_000
"""Findings that a report shows; the others are counted."""
MAX_LETTERS = 200_000
"""Of the messages in them: names in a file may be long."""

WorkKind = Literal["names compared", "proof", "parts", "folding", "modules"]
ALLOWED: dict[WorkKind, int] = {
    "names compared": 50_000,
    "proof": 1_000_000,
    "parts": 60_000,
    "folding": 500_000,
    "modules": 400_000,
}
"""Steps of a run: comparisons of names; steps of proofs, about 1 us each; parts of expressions and
declarations, each time that they are given a meaning or written out for many, or in the place of
names, and the names of a file for each one that uses it, eight to a part; steps and items of
constants that are computed; letters of Python modules that are parsed.
"""

OUT_OF_PARTS = f"written out, all of this together has more than {ALLOWED['parts']:,} parts"
DESCRIBE_LESS = "describe less in one system, or compute more in operators"
OUT_OF_STEPS = "the proofs of this run have used up their search budget"

_spent: ContextVar[dict[WorkKind, int] | None] = ContextVar("spent", default=None)


@contextmanager
def one_run() -> Iterator[None]:
    """Work inside counts against the budget of one run; a run within a run shares its budget."""
    if _spent.get() is not None:
        yield
        return
    token = _spent.set({})
    try:
        yield
    finally:
        _spent.reset(token)


class TooMuchError(ArithmeticError):
    """A run has no allowance for the steps of some work."""


def spend_or_raise(work: WorkKind, steps: int) -> None:
    """Count steps before they are made. Raises TooMuchError if they are not allowed."""
    if not spend(work, steps):
        raise TooMuchError(too_many_steps(work))


def too_many_steps(work: WorkKind) -> str:
    """What is said where steps are not allowed, after the thing that they are for."""
    return f"all of it takes more than {ALLOWED[work]:,} steps"


def remaining(work: WorkKind) -> int:
    """Steps that the run may still spend; outside of a run it may spend all."""
    spent = _spent.get()
    return ALLOWED[work] - (spent.get(work, 0) if spent is not None else 0)


def is_used_up(work: WorkKind) -> bool:
    """Whether steps of the run were refused: what follows would be done about a part of it only."""
    return remaining(work) < 0


def spend(work: WorkKind, steps: int) -> bool:
    """Whether the steps were allowed; they count as spent either way."""
    spent = _spent.get()
    if spent is None:
        return steps <= ALLOWED[work]
    spent[work] = spent.get(work, 0) + steps
    return spent[work] <= ALLOWED[work]
