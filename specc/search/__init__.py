"""Search for values of inputs, memory, time and operators with which conditions hold or fail.

`refutation_goals` gives the goals that show a refutation; `find` changes a situation, as far as its
`FreeVariables` allow, until it meets the goals; the `Interpreter` evaluates expressions in it.
"""

from specc.search.search import Goal, SearchBudget, find, refutation_goals
from specc.search.situation import (
    NO_VALUE,
    FreeVariables,
    Interpreter,
    LagKey,
    OperatorAnswer,
    Situation,
    lag_key,
    runnable,
)

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
    "refutation_goals",
    "runnable",
]
