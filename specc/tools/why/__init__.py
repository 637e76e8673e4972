"""Why conditions held or not at a moment of a recorded run: values, and reasons in words."""

from specc.lang.values import NotRecorded
from specc.tools.why.lines import Explainer, SeenStep, WhyLine
from specc.tools.why.moment import Moment, NotKnown, value_of
from specc.tools.why.reasons import Reasons, Steps, value_text, violation_reasons

__all__ = [
    "Explainer",
    "Moment",
    "NotKnown",
    "NotRecorded",
    "Reasons",
    "SeenStep",
    "Steps",
    "WhyLine",
    "value_of",
    "value_text",
    "violation_reasons",
]
