"""What is not known of a machine because texts in it are missing or have errors."""

from __future__ import annotations

from specc.model.expr import Unknown
from specc.model.fsm import Behaviour, Cause, Transition
from specc.model.system import Subsystem


def is_vague(behaviour: Behaviour, cause: Cause) -> bool:
    """Whether it is unknown when a behaviour ends by a cause; an error goes before an end."""
    terminal, error = (isinstance(c.when, Unknown) for c in (behaviour.terminal, behaviour.error))
    return error or (terminal and cause == "terminal")


def row_is_vague(row: Transition) -> bool:
    """Whether the condition of a row is unknown."""
    return isinstance(row.condition.when, Unknown)


def has_vague_ways(subsystem: Subsystem) -> bool:
    """Whether something that leads from state to state is unknown."""
    behaviours = (state.behaviour for state in subsystem.states)
    ends = any(is_vague(behaviour, "terminal") for behaviour in behaviours)
    return ends or any(row_is_vague(row) for row in subsystem.transitions)
