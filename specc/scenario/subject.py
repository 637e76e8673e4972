"""One subsystem by itself: what is left of a system, and code for it in which nothing is proved."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from specc.emit import filled
from specc.example.exact import runnable
from specc.facts.bounds import surely
from specc.lower import lower
from specc.model.expr import Call, Expr, Unknown, has_unknown, walk
from specc.model.fsm import Behaviour, Cause, Condition
from specc.model.system import Operator, Subsystem, System
from specc.model.trace import Trace

OPERATORS = "operators_of_the_scenario"
"""The module from which generated code gets its operators here."""


class NothingProved:
    """Leaves every check of rows in the generated code."""

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """False."""
        return False


def alone(system: System, name: str) -> System:
    """One subsystem of a system, by its qualified name, with all operators in one module.

    What has errors in its text is left out: a condition holds where it surely does, an assignment
    is not made, an initial value is what an operator gives.

    Raises:
        KeyError: there is no subsystem of that name.
    """
    for agent in system.agents:
        for subsystem in agent.subsystems:
            if subsystem.qualified_name == name:
                kept = replace(agent, subsystems=(_legible(subsystem),), devices=())
                operators = tuple(
                    replace(operator, python=f"{OPERATORS}:{operator.name}")
                    for operator in (*system.operators, *_stand_ins(subsystem))
                )
                return replace(system, operators=operators, agents=(kept,), plant=None, task=None)
    raise KeyError(name)


def unproved(system: System) -> dict[str, str]:
    """Generated code of a system that checks all rows while it runs, by path in its package."""
    return filled(lower(system, NothingProved(), stand_ins=True))


def _stand_ins(subsystem: Subsystem) -> Iterator[Operator]:
    """Operators that give initial values and lets whose text has errors."""
    unknowns = [item.init for item in subsystem.memory if has_unknown(item.init)]
    unknowns += [let.value for let in subsystem.lets if has_unknown(let.value)]
    for value in unknowns:
        call = _standing_in(value)
        assert isinstance(call, Call)  # there is something unknown in it
        yield Operator(call.operator, (), value.type, "", "", Trace(), subsystem.place)


def _standing_in(expr: Expr) -> Expr:
    """The expression, or a call of an operator of which nothing is known."""
    unknown = next((node for node in walk(expr) if isinstance(node, Unknown)), None)
    if unknown is None:
        return expr
    return Call(f"unknown_{re.sub(r'[^A-Za-z0-9]', '_', unknown.name)}", (), type=expr.type)


def _legible(subsystem: Subsystem) -> Subsystem:
    behaviours = {id(b): _legible_behaviour(b) for b in subsystem.behaviours}
    states = tuple(
        replace(s, behaviour=behaviours.get(id(s.behaviour)) or _legible_behaviour(s.behaviour))
        for s in subsystem.states
    )
    rows = (replace(r, condition=_legible_condition(r.condition)) for r in subsystem.transitions)
    return replace(
        subsystem,
        memory=tuple(replace(item, init=_standing_in(item.init)) for item in subsystem.memory),
        lets=tuple(replace(let, value=runnable(_standing_in(let.value))) for let in subsystem.lets),
        behaviours=tuple(behaviours.values()),
        states=states,
        transitions=tuple(rows),
        conditions=tuple(map(_legible_condition, subsystem.conditions)),
    )


def _legible_behaviour(behaviour: Behaviour) -> Behaviour:
    functions = (
        replace(f, assignments=tuple(a for a in f.assignments if not has_unknown(a.value)))
        for f in behaviour.functions
    )
    return replace(
        behaviour,
        functions=tuple(functions),
        terminal=_legible_condition(behaviour.terminal),
        error=_legible_condition(behaviour.error),
    )


def _legible_condition(condition: Condition) -> Condition:
    return replace(condition, when=runnable(surely(condition.when)))
