"""Why conditions held or not at a moment of a recorded run: values, and reasons in words."""

from specc.lang.values import NotRecorded
from specc.tools.why.moment import Moment, NotKnown, value_of
from specc.tools.why.reasons import Reasons, reasons_of_violation, shown

__all__ = [
    "Moment",
    "NotKnown",
    "NotRecorded",
    "Reasons",
    "reasons_of_violation",
    "shown",
    "value_of",
]
