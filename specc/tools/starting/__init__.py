"""Starting a specification from the model of a robot."""

from specc.tools.starting.document import (
    Robot,
    added,
    bound,
    by_mocap,
    document,
    left_out,
    not_held,
)
from specc.tools.starting.facts import ModelFacts, NoFacts, facts_of
from specc.tools.starting.groups import NoGroup, grouped
from specc.tools.starting.receptors import receptors

__all__ = [
    "ModelFacts",
    "NoFacts",
    "NoGroup",
    "Robot",
    "added",
    "bound",
    "by_mocap",
    "document",
    "facts_of",
    "grouped",
    "left_out",
    "not_held",
    "receptors",
]
