"""Conditions that never change: by what their own subsystem does, or by time."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts, Machine
from specc.analysis.constancy import ConstantConditions, ConstantPart
from specc.analysis.durations import OverdueExit
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import in_ms, join_words
from specc.lang import show
from specc.model.fsm import Condition
from specc.model.logic import negation
from specc.model.system import Subsystem
from specc.source import Place

# A declared condition, and every part of it, holds in some situation and fails in another.


def conditions_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0613 and W0617; what cannot be meant in a condition is `expressions_meant`'s matter."""
    told: set[Place] = set()
    for machine in facts.complete_machines:
        for finding in machine.results_of(_findings):
            if finding.primary not in told:
                told.add(finding.primary)
                yield finding


def _findings(machine: Machine) -> Iterator[Diagnostic]:
    for condition in machine.subsystem.conditions:
        settled = machine.constant_value(condition)
        if settled is None:
            parts = (part for part in machine.results_of(_parts) if part.condition is condition)
            yield from (_part(machine, part) for part in parts)
        elif not machine.suspicious.is_in(condition.when):
            word = "always" if settled else "never"
            yield Diagnostic(
                "W0613",
                f"{condition.kind} condition `{condition.name}` {word} holds",
                condition.place,
                _time(machine, condition, settled),
                help=f"write `{word}` where it is used, or correct the condition",
            )
    yield from (_part(machine, part) for part in ConstantConditions(machine).parts_elsewhere())


def _parts(machine: Machine) -> Iterator[ConstantPart]:
    constancy = ConstantConditions(machine)
    for condition in machine.subsystem.conditions:
        if machine.constant_value(condition) is None:
            yield from constancy.parts(condition)


def memory_is_written(facts: Facts) -> Iterator[Diagnostic]:
    """W0623: memory that conditions read, where it is not the reason of W0617."""
    told: set[Place] = set()
    for machine in facts.complete_machines:
        reported = {name for part in machine.results_of(_parts) for name in part.unwritten}
        for item in machine.subsystem.memory:
            if item.name not in machine.value_ranges.unwritten.keys() - reported:
                continue
            of = machine.dependences.of
            reading = [
                c for c in machine.subsystem.exit_conditions if item.name in of(c.when).memory
            ]
            if reading and item.place not in told:
                told.add(item.place)
                yield Diagnostic(
                    "W0623",
                    f"nothing writes memory element `{item.name}`, which conditions read",
                    item.place,
                    f"it stays {show(item.init)}",
                    (Related(reading[0].place, f"`{reading[0].name}` reads it"),),
                    "let a function write it, or declare it under `constants`",
                )


def _time(machine: Machine, condition: Condition, settled: bool) -> str:
    """The remark that time decides a condition, if it does."""
    when = condition.when
    never = negation(when) if settled else when
    if not machine.dwell_times.is_time_the_cause(never):
        return ""
    first = in_ms(1 / machine.subsystem.rate_hz)
    return f"its times decide it; conditions are first evaluated after {first}"


def _part(machine: Machine, part: ConstantPart) -> Diagnostic:
    word = "always" if part.holds else "never"
    condition = part.condition
    place = part.text.place(part.expr)
    help_text = (
        "correct it, or leave it out" if part.holds else "correct it, or leave out what it decides"
    )
    memory = {item.name: item for item in machine.subsystem.memory}
    unwritten = tuple(
        Related(memory[name].place, f"nothing writes memory element `{name}`")
        for name in part.unwritten
    )
    if unwritten:
        help_text = "let a function write the memory, or name a constant instead"
    if condition is None:
        return Diagnostic("W0617", f"`{show(part.expr)}` {word} holds", place, help=help_text)
    elsewhere = place.route[: len(condition.place.route)] != condition.place.route
    named = f"{condition.kind} condition `{condition.name}`"
    return Diagnostic(
        "W0617",
        f"`{show(part.expr)}` {word} holds",
        place,
        "" if elsewhere else f"a part of {named}",
        (*([Related(condition.place, f"{named} uses it")] if elsewhere else ()), *unwritten),
        help_text,
    )


# No condition waits for a time at which its state is over.


def conditions_in_time(facts: Facts) -> Iterator[Diagnostic]:
    """W0618, once for each condition or row.

    What ends a state by mistake is the matter of `conditions_vary` and `expressions_meant`.
    """
    for machine in facts.complete_machines:
        yield from machine.results_of(_out_of_time)


def _out_of_time(machine: Machine) -> Iterator[Diagnostic]:
    told = set[Place]()
    for state in machine.subsystem.states:
        for late in machine.dwell_times.overdue_exits(state):
            if any(_is_mistaken(machine, condition) for condition in late.ended_by):
                continue
            finding = _finding(late, machine.subsystem)
            if finding.primary not in told:
                told.add(finding.primary)
                yield finding


def _is_mistaken(machine: Machine, condition: Condition) -> bool:
    settled = machine.constant_value(condition) is not None
    return settled or machine.suspicious.is_in(condition.when)


def _finding(late: OverdueExit, subsystem: Subsystem) -> Diagnostic:
    """About the condition that ends a state at once, or else about the one that comes too late."""
    state, ends = late.state, late.ended_by
    asked = Related(late.condition.place, f"`{late.condition.name}`")
    behaviour = Related(state.behaviour.place, f"behaviour `{state.behaviour.name}`")
    if late.end_s == 1 / subsystem.rate_hz and ends == (state.behaviour.error,) and not late.row:
        return Diagnostic(
            "W0618",
            f"error condition `{ends[0].name}` always holds when it is first evaluated",
            ends[0].place,
            f"so `{late.condition.name}` never ends state `{state.name}`",
            (asked, behaviour),
            "error conditions are evaluated first: reverse the comparison, or use a later time",
        )
    return Diagnostic(
        "W0618",
        _too_late(late),
        late.row.place if late.row else late.condition.place,
        "never taken" if late.row else "never ends it",
        (
            *(Related(condition.place, _timed_part(condition, late)) for condition in ends),
            asked if late.row else behaviour,
        ),
        "change one of the two times"
        if late.is_timed
        else f"let the state last longer, or change `{late.condition.name}`",
    )


def _too_late(late: OverdueExit) -> str:
    """The message; a condition without a time that ends a state does so at once."""
    state, name, over = late.state.name, late.condition.name, in_ms(late.end_s)
    if late.is_timed:
        return f"state `{state}` has ended, after {over}, before `{name}` can hold"
    ends = join_words([f"`{condition.name}`" for condition in late.ended_by], "or")
    return f"{ends} ends state `{state}` in its first period, {over}, before `{name}` can hold"


def _timed_part(condition: Condition, late: OverdueExit) -> str:
    if len(late.ended_by) > 1:
        return f"`{condition.name}` or the other one has ended it by then"
    return f"`{condition.name}` has ended it by then"


CHECKS = (conditions_vary, conditions_in_time)
USES = (memory_is_written,)
