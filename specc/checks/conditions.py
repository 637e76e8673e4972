"""Conditions and parts of expressions that never change, and conditions that are the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.analysis import Facts, Machine
from specc.analysis.reads import ExpressionText, text_of
from specc.analysis.state_timing import OverdueExit
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import in_ms, join_words
from specc.lang import show
from specc.lang.dependence_order import InOrder
from specc.lang.ranges import ANY
from specc.model.expr import (
    JOINED,
    LITERALS,
    TRUE,
    Builtin,
    Choice,
    Expr,
    LetRef,
    MemoryRef,
    Quantifier,
    children,
    has_free_variable,
    has_unknown,
    walk,
)
from specc.model.fsm import Condition
from specc.model.logic import joined, negation
from specc.model.system import Memory, Subsystem
from specc.model.types import Bool, ListOf, Real
from specc.proof import EvaluationPoint
from specc.reachable import reachable
from specc.source import Place

# Conditions, the lets that they name and time count, and so does memory that is only ever assigned
# literals, or that keeps within bounds. In conditions memory that nothing writes counts if it
# begins with a literal, and not with what is measured or computed. Literal `True` and `False`,
# constants, and what is given to parameters are taken as intended; what peers happen to send may
# change, which is the matter of assumptions.


MOST_PARTS = 64
"""Most parts of one condition that are examined; a longer condition is skipped."""


@dataclass(frozen=True, slots=True)
class ConstantPart:
    """A part of an expression that always or never holds; of a let, a condition may name it."""

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
        """What always holds: the part, or its opposite, wherever the tests around it do."""
        said = self.expr if self.holds else negation(self.expr)
        for outer in reversed(self.context):
            if isinstance(outer, Quantifier):
                said = replace(outer, kind="all", body=said, type=Bool())
            else:
                said = joined("or", (negation(outer), said))
        return said


class ConstantConditions:
    """Asks about the expressions of one subsystem that has no unknowns."""

    def __init__(self, machine: Machine) -> None:
        subsystem = machine.subsystem
        self._subsystem = subsystem
        self._machine = machine
        self._suspicious = machine.suspicious
        lets = {item.name: item for item in subsystem.lets}
        self._of_lets = InOrder(
            {name: item.value for name, item in lets.items()},
            lambda name: self._in(text_of(lets[name]), lets[name].value, None),
        )
        self._found: list[tuple[ExpressionText, Expr, bool, tuple[Expr, ...]]] = []
        self._in_conditions = True
        self._memory = machine.value_ranges
        self._reals = {item.name for item in subsystem.memory if isinstance(item.type, Real)}
        self._parameters = {constant.name for constant in subsystem.constants}
        self._dependences = machine.dependences

    def parts(self, condition: Condition) -> Iterator[ConstantPart]:
        """The innermost parts of a condition that are constant; the condition itself may be."""
        return self._parts(text_of(condition), condition)

    def parts_elsewhere(self) -> Iterator[ConstantPart]:
        """Those of functions, and of the lets that no condition names, as truth tables tell."""
        self._in_conditions = False
        items = (item for each in self._subsystem.functions for item in each.assignments)
        for item in (item for item in items if not isinstance(item.value, LITERALS)):
            yield from self._parts(text_of(item))
        for let in self._subsystem.lets:
            self._found = []
            self._of_lets[let.name]
            yield from (ConstantPart(None, *found) for found in self._found)

    def _parts(
        self, text: ExpressionText, condition: Condition | None = None
    ) -> Iterator[ConstantPart]:
        nodes = list(walk(text.expr))
        truths = sum(1 for node in nodes if isinstance(node.type, Bool))
        if truths > MOST_PARTS or not (truths or any(isinstance(n, LetRef) for n in nodes)):
            return
        self._found = []
        self._in(text, text.expr, condition)
        for found in self._found:
            yield ConstantPart(condition, *found, self._unwritten(found[1]))

    def _in(
        self,
        text: ExpressionText,
        expr: Expr,
        condition: Condition | None,
        around: tuple[Expr, ...] = (),
    ) -> bool:
        """Find the constant parts below an expression, or else itself; whether there are any.

        Those of lets are found where they are first named; without a condition, this is a let or
        a function. The tests of the choices `around` the expression hold where it is asked.
        """
        below = [
            self._in(text, child, condition, (*around, *more))
            for child, more in _children_in_context(expr)
        ]
        if isinstance(expr, LetRef) and expr.name in self._of_lets:
            below.append(self._of_lets[expr.name])
        if any(below) or not isinstance(expr.type, Bool):
            return any(below)
        holds = self._value(expr, condition, _tests(around))
        if holds is not None:
            self._found.append((text, expr, holds, around))
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
        if on.has_literal:
            return None
        if self._suspicious.is_in(part) or not (
            self._suspicious.varies(part) or self._unwritten(part)
        ):
            return None
        least, greatest = self._memory.bounds.of(part, tests) if on.memory else ANY
        if least == greatest:
            return bool(least)
        said = self._memory.conditions | self._memory.unwritten
        # Bounds of real numbers take solvers, and have been looked at.
        known = [said[name] for name in sorted(on.memory - self._reals) if name in said]
        known += tests
        if condition and part is condition.when and not known:
            return None  # that of the condition itself is known
        moment: EvaluationPoint = "conditions" if condition else "start"
        of_any = on.constants & self._parameters
        prover = self._machine.generic_prover if of_any else self._machine.prover
        for fact, holds in ((part, True), (negation(part), False)):
            if self._in_conditions:
                shown = prover.implies(known, fact, moment, assuming=False)
            else:
                shown = prover.refutes((*known, negation(fact)))
            if shown:
                return holds
        return None

    def _unwritten(self, part: Expr) -> tuple[str, ...]:
        """The memory that nothing writes, if what decides a condition is nothing else."""
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


def _tests(around: tuple[Expr, ...]) -> tuple[Expr, ...]:
    """The tests that hold; a variable may be another one of that name inside a quantifier."""
    found: list[Expr] = []
    for outer in around:
        if isinstance(outer, Quantifier):
            found = [test for test in found if not has_free_variable(test)]
        else:
            found.append(outer)
    return tuple(found)


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


# Two timers of the same length may well be meant; the same answer about the same values is not.


def conditions_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0622: two declared conditions of one kind are not the same."""
    seen = set[Place]()
    for machine in facts.complete_machines:
        for one, other in machine.results_of(_same_conditions):
            if other.place not in seen:
                seen.add(other.place)
                yield Diagnostic(
                    "W0622",
                    f"{other.kind} conditions `{one.name}` and `{other.name}` are the same",
                    other.place,
                    "it holds exactly where the other one does",
                    (Related(one.place, f"`{one.name}`"),),
                    "correct one of them, or use one name",
                )


def _same_conditions(machine: Machine) -> Iterator[tuple[Condition, Condition]]:
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
                yield earlier, condition


def lists_end(facts: Facts) -> Iterator[Diagnostic]:
    """W0621: memory to which functions only append."""
    seen = set[Place]()
    for machine in facts.complete_machines:
        for item in machine.subsystem.memory:
            if _only_grows(machine, item) and item.place not in seen:
                seen.add(item.place)
                yield Diagnostic(
                    "W0621",
                    f"list `{item.name}` only grows",
                    item.place,
                    "every function that writes it appends to it",
                    help="begin it anew where a state is entered, or keep a bounded part of it",
                )


def _only_grows(machine: Machine, item: Memory) -> bool:
    """Whether functions only append to memory, and no condition could stop them."""
    numbering, subsystem = machine.prover.numbering, machine.subsystem
    if not isinstance(item.type, ListOf):
        return False
    asked = machine.dependences.all(condition.when for condition in subsystem.exit_conditions)
    written = subsystem.written.get(("", item.name), {})
    values = [numbering.looked_through(value) for each in written.values() for value in each]
    again = any(
        ("", item.name) in {(a.peer, a.name) for a in state.behaviour.assignments}
        and (state.behaviour.terminal.when != TRUE or _is_entered_again(machine, state.name))
        for state in subsystem.states
    )
    return (
        bool(values)
        and again
        and item.name not in asked.memory
        and all(
            isinstance(value, Builtin)
            and value.name == JOINED
            and numbering.looked_through(value.args[0]) == MemoryRef(item.name, type=item.type)
            for value in values
        )
    )


def _is_entered_again(machine: Machine, state: str) -> bool:
    """Whether a way leads from a state back to it."""
    first = [step.row.target for step in machine.successors.get(state, ())]

    def following(name: str) -> list[str]:
        return [step.row.target for step in machine.successors.get(name, ())]

    return state in reachable(first, following)
