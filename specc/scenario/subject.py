"""One subsystem by itself: what is left of a system, and code for it in which nothing is proved."""

from __future__ import annotations

from dataclasses import replace

from specc.emit import filled
from specc.lower import lower
from specc.model.expr import FALSE, Unknown
from specc.model.fsm import Behaviour, Cause, Condition
from specc.model.system import Subsystem, System

OPERATORS = "operators_of_the_scenario"
"""The module from which generated code gets its operators here."""


class NothingProved:
    """Leaves every check of rows in the generated code."""

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """False."""
        return False


def alone(system: System, name: str) -> System:
    """One subsystem of a system, by its qualified name, with all operators in one module.

    What has errors in its text is left out: such a condition never holds, such an assignment is not
    made.

    Raises:
        KeyError: there is no subsystem of that name.
    """
    for agent in system.agents:
        for subsystem in agent.subsystems:
            if subsystem.qualified_name == name:
                kept = replace(agent, subsystems=(_legible(subsystem),), devices=())
                operators = tuple(
                    replace(operator, python=f"{OPERATORS}:{operator.name}")
                    for operator in system.operators
                )
                return replace(system, operators=operators, agents=(kept,), plant=None, task=None)
    raise KeyError(name)


def unproved(system: System) -> dict[str, str]:
    """Generated code of a system that checks all rows while it runs, by path in its package."""
    return filled(lower(system, NothingProved()))


def _legible(subsystem: Subsystem) -> Subsystem:
    behaviours = {id(b): _legible_behaviour(b) for b in subsystem.behaviours}
    states = tuple(
        replace(s, behaviour=behaviours.get(id(s.behaviour)) or _legible_behaviour(s.behaviour))
        for s in subsystem.states
    )
    rows = (row for row in subsystem.transitions if not isinstance(row.condition.when, Unknown))
    return replace(
        subsystem,
        behaviours=tuple(behaviours.values()),
        states=states,
        transitions=tuple(rows),
        conditions=tuple(map(_legible_condition, subsystem.conditions)),
    )


def _legible_behaviour(behaviour: Behaviour) -> Behaviour:
    functions = (
        replace(
            function,
            assignments=tuple(a for a in function.assignments if not isinstance(a.value, Unknown)),
        )
        for function in behaviour.functions
    )
    return replace(
        behaviour,
        functions=tuple(functions),
        terminal=_legible_condition(behaviour.terminal),
        error=_legible_condition(behaviour.error),
    )


def _legible_condition(condition: Condition) -> Condition:
    return replace(condition, when=FALSE) if isinstance(condition.when, Unknown) else condition
