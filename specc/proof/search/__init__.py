"""The one search for values of inputs, memory and operators: for examples, and for tests that fail.

`showing` says what a situation has to meet that shows a refutation; `find` changes one that is at
hand, as far as it has the `Freedom`, until it meets that; `Semantics` evaluates expressions in it.
"""

from specc.lang.kinds import first_value, others
from specc.lang.samples import Fields, Token, Value, alike, spelled
from specc.proof.search.search import Goal, came, find, present, showing
from specc.proof.search.situation import (
    NO_VALUE,
    Answer,
    Freedom,
    LagKey,
    Semantics,
    Situation,
    lag_key,
    runnable,
)
from specc.proof.search.thresholds import SearchBudget

__all__ = [
    "NO_VALUE",
    "Answer",
    "Fields",
    "Freedom",
    "Goal",
    "LagKey",
    "SearchBudget",
    "Semantics",
    "Situation",
    "Token",
    "Value",
    "alike",
    "came",
    "find",
    "first_value",
    "lag_key",
    "others",
    "present",
    "runnable",
    "showing",
    "spelled",
]
