"""Starting a specification from the model of a robot."""

from specc.tools.starting.document import (
    Robot,
    bound_parts,
    drift_warning,
    mocap_warnings,
    omissions,
    specification,
    specification_with_agent,
)
from specc.tools.starting.facts import ModelFacts, NoFacts, read_facts
from specc.tools.starting.groups import NoGroup, actuator_groups, receptors

__all__ = [
    "ModelFacts",
    "NoFacts",
    "NoGroup",
    "Robot",
    "actuator_groups",
    "bound_parts",
    "drift_warning",
    "mocap_warnings",
    "omissions",
    "read_facts",
    "receptors",
    "specification",
    "specification_with_agent",
]
