"""The subsystem that a scenario is about, and what is refuted of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.analysis import Facts, Machine, RowVerdictAt
from specc.analysis.must_may import must_hold_part
from specc.checks.presence import absences
from specc.checks.rows import ending, situation
from specc.lower.names import Namespace
from specc.model.expr import Call, Expr, Unknown, has_unknown, walk
from specc.model.fsm import Behaviour, Cause, Condition, Trace, Transition
from specc.model.system import Operator, Subsystem, System
from specc.proof import InputName
from specc.search import Goal, runnable

# One subsystem by itself: what is left of a system, and code for it in which nothing is proved.


OPERATORS = "operators_of_the_scenario"
"""The module from which generated code gets its operators here."""


def isolated_subsystem(system: System, name: str) -> System:
    """One subsystem of a system, by its qualified name, with all operators in one module.

    What has errors in its text is left out: a condition holds where it surely does, an assignment
    is not made, an initial value is what an operator gives.

    Raises:
        KeyError: there is no subsystem of that name.
    """
    for agent in system.agents:
        for subsystem in agent.subsystems:
            if subsystem.qualified_name == name:
                reduced_agent = replace(agent, subsystems=(_without_errors(subsystem),), devices=())
                names = Namespace()
                operators = tuple(
                    replace(operator, python=f"{OPERATORS}:{names.new(operator.name)}")
                    for operator in (*system.operators, *_stand_ins(subsystem))
                )
                return replace(
                    system, operators=operators, agents=(reduced_agent,), plant=None, task=None
                )
    raise KeyError(name)


def _stand_ins(subsystem: Subsystem) -> Iterator[Operator]:
    """Operators that give initial values and lets whose text has errors."""
    unknowns = [item.init for item in subsystem.memory if has_unknown(item.init)]
    unknowns += [let.value for let in subsystem.lets if has_unknown(let.value)]
    for value in unknowns:
        call = _replace_unknown(value)
        assert isinstance(call, Call)  # there is something unknown in it
        yield Operator(call.operator, (), value.type, "", "", Trace(), subsystem.place)


def _replace_unknown(expr: Expr) -> Expr:
    """The expression, or a call of an operator of which nothing is known."""
    unknown = next((node for node in walk(expr) if isinstance(node, Unknown)), None)
    if unknown is None:
        return expr
    return Call(f"unknown_{re.sub(r'[^A-Za-z0-9]', '_', unknown.name)}", (), type=expr.type)


def _without_errors(subsystem: Subsystem) -> Subsystem:
    behaviours = {id(b): _legible_behaviour(b) for b in subsystem.behaviours}
    states = tuple(
        replace(s, behaviour=behaviours.get(id(s.behaviour)) or _legible_behaviour(s.behaviour))
        for s in subsystem.states
    )
    rows = (replace(r, condition=_legible_condition(r.condition)) for r in subsystem.transitions)
    return replace(
        subsystem,
        memory=tuple(replace(item, init=_replace_unknown(item.init)) for item in subsystem.memory),
        lets=tuple(
            replace(let, value=runnable(_replace_unknown(let.value))) for let in subsystem.lets
        ),
        behaviours=tuple(behaviours.values()),
        states=states,
        transitions=tuple(rows),
        conditions=tuple(map(_legible_condition, subsystem.conditions)),
    )


def _legible_behaviour(behaviour: Behaviour) -> Behaviour:
    """The behaviour without errors; a call becomes a behaviour of its own."""
    functions = (
        replace(f, assignments=tuple(a for a in f.assignments if not has_unknown(a.value)))
        for f in behaviour.functions
    )
    return replace(
        behaviour,
        functions=tuple(functions),
        terminal=_legible_condition(behaviour.terminal),
        errors=tuple((cause, _legible_condition(error)) for cause, error in behaviour.errors),
        generic=None,
        arguments=(),
    )


def _legible_condition(condition: Condition) -> Condition:
    return replace(condition, when=runnable(must_hold_part(condition.when)))


# What the checks have refuted of the machines of a system, as goals that a run can meet.


CODES = ("E0601", "E0602", "E0603", "E0701", "E0702", "E0703", "E0704")
"""Codes of findings that a run can show."""


@dataclass(frozen=True, slots=True)
class Refutation:
    """A finding that a run can show.

    Either none or several rows apply when a state ends by a cause, or an input is read that may
    have no value.

    Attributes:
        words: what is wrong, in words.
        goals: the witness about rows.
        rows: rows that apply; with none of them, no row does.
        absent: the input that is read; empty if it is about rows.
    """

    code: str
    subsystem: str
    state: str
    cause: Cause | None
    words: str
    goals: tuple[Goal, ...] = ()
    rows: tuple[Transition, ...] = ()
    absent: InputName | None = None


def refutations(facts: Facts) -> Iterator[Refutation]:
    """The refutations of a system, in the order of its states."""
    for decided in facts.row_verdicts:
        yield from _row_refutations(decided)
    for machine in facts.consistent_machines:
        yield from _absence_refutations(machine)


def _row_refutations(decided: RowVerdictAt) -> Iterator[Refutation]:
    """E0601, E0602, E0603."""
    verdict, state, cause = decided.verdict, decided.state, decided.cause
    gap, overlap = verdict.decision.gap, verdict.decision.overlap
    name, ended = decided.subsystem.qualified_name, ending(state.behaviour, cause)
    if gap and verdict.rows:
        words = f"no row of state `{state.name}` applies {situation(gap)}"
        yield Refutation("E0601", name, state.name, cause, words, gap.answers)
    elif decided.lacks_rows and state not in decided.machine.dead_ends:  # these have no rows yet
        words = f"state `{state.name}` can end {ended} and has no row for that"
        yield Refutation("E0603", name, state.name, cause, words)
    if overlap:
        rows = tuple(verdict.rows[index] for index in overlap.holding)
        words = f"two rows of state `{state.name}` apply {situation(overlap)}"
        yield Refutation("E0602", name, state.name, cause, words, overlap.answers, rows)


def _absence_refutations(machine: Machine) -> Iterator[Refutation]:
    """E0701 to E0704, once for each input and state."""
    reported = set()
    subsystem = machine.subsystem
    for absence in sorted(absences(machine), key=lambda absence: absence.code):
        state, name = absence.state or subsystem.initial_state, absence.reading.input.key
        if (absence.code, state, name) not in reported:
            reported.add((absence.code, state, name))
            input_ = f"`x.{name[0]}.{name[1]}`"
            words = f"{input_} may have no value {absence.where}, where {absence.what} reads it"
            owner = subsystem.qualified_name
            yield Refutation(absence.code, owner, state, None, words, absent=name)
