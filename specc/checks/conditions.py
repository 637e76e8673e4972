"""Conditions and parts of expressions that never change, and conditions that are the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.analysis import Facts, Machine
from specc.analysis.reads import ExpressionText, text_of
from specc.analysis.state_timing import OverdueExit
from specc.diagnostics import Diagnostic, Related, first_at_each_place
from specc.diagnostics.phrases import in_ms, join_words
from specc.lang import show
from specc.lang.ranges import ANY
from specc.model.expr import (
    LITERALS,
    Choice,
    Expr,
    LazyByDependence,
    LetRef,
    Quantifier,
    children,
    has_free_variable,
    has_unknown,
    junction,
    negation,
    walk,
)
from specc.model.fsm import Condition, mode_of
from specc.model.system import Subsystem
from specc.model.types import Bool, Real
from specc.proof import EvaluationPoint
from specc.reachable import grouped

# Conditions, the lets that they name and time count, and so does memory that is only ever assigned
# literals, or that keeps within bounds. In conditions memory that nothing writes counts if it
# begins with a literal, and not with what is measured or computed. Literal `True` and `False`,
# constants, and what is given to parameters are taken as intended; what peers happen to send may
# change, which is the matter of assumptions.


MOST_PARTS = 64
"""Most parts of one condition that are examined; a longer condition is skipped."""


@dataclass(frozen=True, slots=True)
class ConstantPart:
    """A part of an expression, or of a let that it names, that always or never holds."""

    condition: Condition | None
    text: ExpressionText
    expr: Expr
    holds: bool
    context: tuple[Expr, ...] = ()
    """The tests of choices and the quantifiers in which the part stands, from outside."""
    unwritten: tuple[str, ...] = ()
    """The memory that nothing writes, if the part depends on nothing else."""

    @property
    def proposition(self) -> Expr:
        """The part or its opposite, under the tests around it: this always holds."""
        holding = self.expr if self.holds else negation(self.expr)
        for outer in reversed(self.context):
            if isinstance(outer, Quantifier):
                holding = replace(outer, kind="all", body=holding, type=Bool())
            else:
                holding = junction("or", (negation(outer), holding))
        return holding


class ConstantConditions:
    """Finds constant parts in the expressions of one subsystem without unknowns."""

    def __init__(self, machine: Machine) -> None:
        subsystem = machine.subsystem
        self._subsystem = subsystem
        self._machine = machine
        lets = {item.name: item for item in subsystem.lets}
        self._of_lets = LazyByDependence(
            {name: item.value for name, item in lets.items()},
            lambda name: self._find_parts(text_of(lets[name]), lets[name].value, None),
        )
        self._found: list[tuple[ExpressionText, Expr, bool, tuple[Expr, ...]]] = []
        self._in_conditions = True
        self._memory = machine.value_ranges
        self._reals = {item.name for item in subsystem.memory if isinstance(item.type, Real)}
        self._dependences = machine.dependences

    def parts(self, condition: Condition) -> Iterator[ConstantPart]:
        """The innermost parts of a condition that are constant; the condition itself may be."""
        return self._parts_of(text_of(condition), condition)

    def parts_elsewhere(self) -> Iterator[ConstantPart]:
        """The constant parts of functions and of lets that no condition names, by truth tables."""
        self._in_conditions = False
        for item in (item for each in self._subsystem.functions for item in each.assignments):
            if not isinstance(item.value, LITERALS):
                yield from self._parts_of(text_of(item))
        for let in self._subsystem.lets:
            self._found = []
            self._of_lets[let.name]
            yield from (ConstantPart(None, *found) for found in self._found)

    def _parts_of(
        self, text: ExpressionText, condition: Condition | None = None
    ) -> Iterator[ConstantPart]:
        nodes = list(walk(text.expr))
        truths = sum(1 for node in nodes if isinstance(node.type, Bool))
        if truths > MOST_PARTS or not (truths or any(isinstance(n, LetRef) for n in nodes)):
            return
        self._found = []
        self._find_parts(text, text.expr, condition)
        for found in self._found:
            yield ConstantPart(condition, *found, self._unwritten(found[1]))

    def _find_parts(
        self,
        text: ExpressionText,
        expr: Expr,
        condition: Condition | None,
        context: tuple[Expr, ...] = (),
    ) -> bool:
        """Add the innermost constant parts of an expression to `_found`.

        Returns whether there are any.

        Those of lets are found where they are first named. Without a condition, this is a let or a
        function. The tests in the `context` hold where the expression is evaluated.
        """
        below = [
            self._find_parts(text, child, condition, (*context, *inner))
            for child, inner in _children_in_context(expr)
        ]
        if isinstance(expr, LetRef) and expr.name in self._of_lets:
            below.append(self._of_lets[expr.name])
        if any(below) or not isinstance(expr.type, Bool):
            return any(below)
        holds = self._value(expr, condition, _tests(context))
        if holds is not None:
            self._found.append((text, expr, holds, context))
        return holds is not None

    def _value(
        self, part: Expr, condition: Condition | None, tests: tuple[Expr, ...]
    ) -> bool | None:
        """The truth value of a part that is constant unintentionally.

        In functions and in the text of a let, which they may name too, it has it at any moment.
        """
        if part in tests or negation(part) in tests:
            return part in tests
        on = self._dependences.of(part)
        suspicious = self._machine.suspicious
        if on.has_literal or suspicious.is_in(part):
            return None
        if not (suspicious.varies(part) or self._unwritten(part)):
            return None
        least, greatest = self._memory.bounds.of(part, tests) if on.memory else ANY
        if least == greatest:
            return bool(least)
        facts = self._memory.conditions | self._memory.unwritten
        # Bounds of real numbers take solvers, and have been looked at.
        known = [facts[name] for name in sorted(on.memory - self._reals) if name in facts]
        known += tests
        if condition and part is condition.when and not known:
            return None  # that of the condition itself is known
        moment: EvaluationPoint = "conditions" if condition else "start"
        is_given = any(constant.name in on.constants for constant in self._subsystem.constants)
        prover = self._machine.generic_prover if is_given else self._machine.prover
        for fact, holds in ((part, True), (negation(part), False)):
            if self._in_conditions:
                is_proved = prover.implies(known, fact, moment, assuming=False)
            else:
                is_proved = prover.refutes((*known, negation(fact)))
            if is_proved:
                return holds
        return None

    def _unwritten(self, part: Expr) -> tuple[str, ...]:
        """The memory that nothing writes, if a condition depends on nothing else."""
        on = self._dependences.of(part)
        if not self._in_conditions or not on.is_stable or has_unknown(part):
            return ()
        return tuple(sorted(on.memory)) if on.memory <= self._memory.unwritten.keys() else ()


def _children_in_context(expr: Expr) -> Iterator[tuple[Expr, tuple[Expr, ...]]]:
    """The parts of an expression, each with the test or the quantifier in which it stands."""
    match expr:
        case Choice(test=test, then=then, otherwise=otherwise):
            yield test, ()
            yield then, (test,)
            yield otherwise, (negation(test),)
        case Quantifier(over=over, body=body):
            yield over, ()
            yield body, (expr,)
        case _:
            yield from ((child, ()) for child in children(expr))


def _tests(context: tuple[Expr, ...]) -> tuple[Expr, ...]:
    """The tests that hold; a variable may be another one of that name inside a quantifier."""
    tests: list[Expr] = []
    for outer in context:
        if isinstance(outer, Quantifier):
            tests = [test for test in tests if not has_free_variable(test)]
        else:
            tests.append(outer)
    return tuple(tests)


# A declared condition, and every part of it, holds in some situation and fails in another.


def conditions_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0613 and W0617; `expressions_meant` reports suspicious parts of conditions."""
    machines = facts.complete_machines
    return first_at_each_place(d for m in machines for d in _constant_findings(m))


def _constant_findings(machine: Machine) -> Iterator[Diagnostic]:
    every = list(_parts(machine))
    for condition in machine.subsystem.conditions:
        value, when = machine.constant_value(condition), condition.when
        if value is None:
            parts = (part for part in every if part.condition is condition)
            yield from (_part_finding(machine, part) for part in parts)
        elif not machine.suspicious.is_in(when):
            word, label = "always" if value else "never", ""
            if machine.dwell_times.is_time_the_cause(negation(when) if value else when):
                first = in_ms(1 / machine.subsystem.rate_hz)
                label = f"its times decide it; conditions are first evaluated after {first}"
            yield Diagnostic(
                "W0613",
                f"{condition.kind} condition `{condition.name}` {word} holds",
                condition.place,
                label,
                help=f"write `{word}` where it is used, or correct the condition",
            )
    yield from (
        _part_finding(machine, part) for part in ConstantConditions(machine).parts_elsewhere()
    )


def _parts(machine: Machine) -> Iterator[ConstantPart]:
    constant = ConstantConditions(machine)
    for condition in machine.subsystem.conditions:
        if machine.constant_value(condition) is None:
            yield from constant.parts(condition)


def memory_is_written(facts: Facts) -> Iterator[Diagnostic]:
    """W0623: memory that conditions read, where it is not the reason of W0617."""
    return first_at_each_place(d for m in facts.complete_machines for d in _unwritten(m))


def _unwritten(machine: Machine) -> Iterator[Diagnostic]:
    unwritten = set(machine.value_ranges.unwritten)
    if unwritten:
        unwritten -= {name for part in _parts(machine) for name in part.unwritten}
    reads = [(c, machine.dependences.of(c.when)) for c in machine.subsystem.exit_conditions]
    for item in machine.subsystem.memory:
        if item.name in unwritten:
            reading = [condition for condition, on in reads if item.name in on.memory]
            if reading:
                if mode := mode_of("left", item.name):
                    yield Diagnostic(
                        "W0623",
                        f"no row leaves mode `{mode}`, which is resumed",
                        item.place,
                        "`resume` always enters its initial state",
                        help="let a row lead to a state outside it, or enter it by its name",
                    )
                    continue
                yield Diagnostic(
                    "W0623",
                    f"nothing writes memory element `{item.name}`, which conditions read",
                    item.place,
                    f"it stays {show(item.init)}",
                    (Related(reading[0].place, f"`{reading[0].name}` reads it"),),
                    "let a function write it, or declare it under `constants`",
                )


def _part_finding(machine: Machine, part: ConstantPart) -> Diagnostic:
    word = "always" if part.holds else "never"
    condition, label, related = part.condition, "", list[Related]()
    place = part.text.place(part.expr)
    help = f"correct it, or leave {'it out' if part.holds else 'out what it decides'}"
    if condition is not None:
        named = f"{condition.kind} condition `{condition.name}`"
        if place.route[: len(condition.place.route)] == condition.place.route:
            label = f"a part of {named}"
        else:
            related.append(Related(condition.place, f"{named} uses it"))
    for item in (item for item in machine.subsystem.memory if item.name in part.unwritten):
        related.append(Related(item.place, f"nothing writes memory element `{item.name}`"))
        help = "let a function write the memory, or name a constant instead"
    message = f"`{show(part.expr)}` {word} holds"
    return Diagnostic("W0617", message, place, label, tuple(related), help)


# No condition waits for a time at which its state is over.


def conditions_in_time(facts: Facts) -> Iterator[Diagnostic]:
    """W0618, once for each condition or row; those of modes, if it is so in all their states.

    Conditions that are constant or suspicious are reported elsewhere.
    """
    for machine in facts.complete_machines:
        yield from first_at_each_place(_overdue_findings(machine))


def _overdue_findings(machine: Machine) -> Iterator[Diagnostic]:
    subsystem = machine.subsystem
    every = [e for state in subsystem.states for e in machine.dwell_times.overdue_exits(state)]
    overdue = grouped((_written(exit), exit.state.name) for exit in every)
    states: dict[object, list[str]] = {}
    states |= grouped((row.written, row.source) for row in subsystem.transitions)
    states |= {end.place: [*mode.states] for mode in subsystem.modes for _, end in mode.errors}
    for exit in every:
        is_so_everywhere = {*overdue[_written(exit)]} >= {*states.get(_written(exit), ())}
        if is_so_everywhere and not any(
            machine.constant_value(end) is not None or machine.suspicious.is_in(end.when)
            for end in exit.ended_by
        ):
            yield _overdue_exit(exit, subsystem)


def _written(exit: OverdueExit) -> object:
    """The same for all rows or conditions that a row or condition of a mode stands for."""
    return exit.row.written if exit.row else exit.condition.place


def _overdue_exit(exit: OverdueExit, subsystem: Subsystem) -> Diagnostic:
    """About the condition that ends a state at once, or else about the one that comes too late."""
    state, ends, late = exit.state, exit.ended_by, exit.condition
    condition = Related(late.place, f"`{late.name}`")
    behaviour = Related(state.behaviour.place, f"behaviour `{state.behaviour.name}`")
    is_error = len(ends) == 1 and ends[0] is not state.behaviour.terminal
    if exit.end_s == 1 / subsystem.rate_hz and is_error and not exit.row:
        return Diagnostic(
            "W0618",
            f"error condition `{ends[0].name}` always holds when it is first evaluated",
            ends[0].place,
            f"so `{late.name}` never ends state `{state.name}`",
            (condition, behaviour),
            "error conditions are evaluated first: reverse the comparison, or use a later time",
        )
    over, other = in_ms(exit.end_s), " or the other one" if len(ends) > 1 else ""
    message = f"state `{state.name}` has ended, after {over}, before `{late.name}` can hold"
    help = "change one of the two times"
    if not exit.is_timed:  # a condition without a time ends a state at once
        named = join_words([f"`{end.name}`" for end in ends], "or")
        message = f"{named} ends state `{state.name}` in its first period, {over}, before "
        message += f"`{late.name}` can hold"
        help = f"let the state last longer, or change `{late.name}`"
    related = (Related(end.place, f"`{end.name}`{other} has ended it by then") for end in ends)
    return Diagnostic(
        "W0618",
        message,
        exit.row.place if exit.row else late.place,
        "never taken" if exit.row else "never ends it",
        (*related, condition if exit.row else behaviour),
        help,
    )


# Two timers of the same length may well be meant; the same answer about the same values is not.


def conditions_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0622: two declared conditions of one kind are not the same."""
    machines = facts.complete_machines
    return first_at_each_place(d for m in machines for d in _same_conditions(m))


def _same_conditions(machine: Machine) -> Iterator[Diagnostic]:
    first = dict[tuple[str, int, frozenset[str]], Condition]()
    for condition in machine.subsystem.conditions:
        if condition.place.route[-3:-1] != ("conditions", condition.kind):
            continue  # it stands in its behaviour, and is used nowhere else
        on = machine.dependences.of(condition.when)
        if on.inputs or on.memory:
            number = machine.prover.numbering.number(condition.when)
            key = condition.kind, number, on.constants  # two constants may get other values
            earlier = first.setdefault(key, condition)
            if earlier is not condition:
                yield Diagnostic(
                    "W0622",
                    f"{condition.kind} conditions `{earlier.name}` and `{condition.name}` are "
                    "the same",
                    condition.place,
                    "it holds exactly where the other one does",
                    (Related(earlier.place, f"`{earlier.name}`"),),
                    "correct one of them, or use one name",
                )
