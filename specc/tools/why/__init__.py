"""Why conditions held or not at a moment of a recorded run: values, and reasons in words."""

from specc.lang.values import NotRecorded
from specc.tools.why.moment import Moment, NotKnown, value_of
from specc.tools.why.reasons import Reasons, value_text, violation_reasons

__all__ = [
    "Moment",
    "NotKnown",
    "NotRecorded",
    "Reasons",
    "value_of",
    "value_text",
    "violation_reasons",
]
