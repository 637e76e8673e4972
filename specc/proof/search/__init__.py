"""The one search for values of inputs, memory and operators: for examples, and for tests that fail.

`showing` says what a situation has to meet that shows a refutation; `find` changes one that is at
hand, as far as it has the `Freedom`, until it meets that; `Semantics` evaluates expressions in it.
"""

from specc.proof.search.search import Goal, find, showing
from specc.proof.search.situation import (
    NO_VALUE,
    FreeVariables,
    Interpreter,
    LagKey,
    OperatorAnswer,
    Situation,
    lag_key,
    runnable,
)
from specc.proof.search.thresholds import SearchBudget

__all__ = [
    "NO_VALUE",
    "FreeVariables",
    "Goal",
    "Interpreter",
    "LagKey",
    "OperatorAnswer",
    "SearchBudget",
    "Situation",
    "find",
    "lag_key",
    "runnable",
    "showing",
]
