"""Conditions that never change: by what their own subsystem does, or by time."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

from specc.analysis import Facts, Machine
from specc.analysis.lasting import Late
from specc.analysis.reads import Text, text_of
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import listed, ms
from specc.lang import show
from specc.lang.order import InOrder
from specc.model.expr import (
    Among,
    Binary,
    Builtin,
    Choice,
    Compare,
    ConstantRef,
    Expr,
    LetRef,
    Logic,
    Member,
    MemoryRef,
    Number,
    Truth,
    Unary,
    children,
    has_free_variable,
    walk,
)
from specc.model.fsm import Condition
from specc.model.requirement import expressions
from specc.model.system import Subsystem
from specc.model.types import Bool, Enum, Int, Real
from specc.proof import Moment
from specc.reachable import reachable
from specc.source import Place

# Parts of conditions that have one truth value because of their own subsystem.
#
# Conditions, the lets that they name and time count, and so does memory that is only ever assigned
# literals, or that only counts up or down. Literal `True` and `False`, constants and parameters are
# taken as intended; what peers happen to send may change, which is the matter of assumptions.


MOST_PARTS = 64
"""Most parts of one condition that are examined; a longer condition is skipped."""
_MOST_VALUES = 8
_Literal = Truth | Member | Number


class ConstantPart(NamedTuple):
    """A part of a condition, in its text or in that of a let, that always or never holds."""

    condition: Condition
    text: Text
    expr: Expr
    holds: bool


class Constancy:
    """Asks about the conditions of one subsystem that has no unknowns."""

    def __init__(self, machine: Machine) -> None:
        subsystem = machine.subsystem
        self._subsystem = subsystem
        self._prover = machine.prover
        self._misfits = machine.misfits
        lets = {item.name: item for item in subsystem.lets}
        self._of_lets = InOrder(
            {name: item.value for name, item in lets.items()},
            lambda name: self._in(text_of(lets[name]), lets[name].value, None),
        )
        self._found: list[tuple[Text, Expr, bool]] = []
        self._parameters = {constant.name for constant in subsystem.constants}
        self._dependences = machine.dependences

    def parts(self, condition: Condition) -> Iterator[ConstantPart]:
        """The innermost parts of a condition that are constant; the condition itself may be."""
        text = Text(condition.when, condition.place, "when")
        if sum(1 for node in walk(condition.when) if isinstance(node.type, Bool)) > MOST_PARTS:
            return
        self._found = []
        self._in(text, condition.when, condition)
        for found in self._found:
            yield ConstantPart(condition, *found)

    def _in(self, text: Text, expr: Expr, condition: Condition | None) -> bool:
        """Find the constant parts below an expression, or else itself; whether there are any.

        Those of lets are found where they are first named; without a condition, this is one.
        """
        below = [self._in(text, child, condition) for child in children(expr)]
        if isinstance(expr, LetRef) and expr.name in self._of_lets:
            below.append(self._of_lets[expr.name])
        if any(below) or not isinstance(expr.type, Bool):
            return any(below)
        holds = self._value(expr, condition)
        if holds is not None:
            self._found.append((text, expr, holds))
        return holds is not None

    def _value(self, part: Expr, condition: Condition | None) -> bool | None:
        """The truth value of a part that is constant unintentionally.

        In the text of a let, which functions may name too, it has it at any moment.
        """
        on = self._dependences.of(part)
        if on.literal or on.constants & self._parameters or has_free_variable(part):
            return None
        if not self._misfits.varies(part) or self._misfits.within(part):
            return None
        known = [self._memory[name] for name in sorted(on.memory) if name in self._memory]
        if condition and part is condition.when and not known:
            return None  # that of the condition itself is known
        moment: Moment = "conditions" if condition else "start"
        for fact, holds in ((part, True), (Unary("not", part, type=Bool()), False)):
            if self._prover.implies(known, fact, moment, assuming=False):
                return holds
        return None

    @cached_property
    def _memory(self) -> dict[str, Expr]:
        """What is known of memory that functions write, by name, as conditions."""
        leaves = {m.name: list(_leaves(m.init)) for m in self._subsystem.memory}
        written: set[str] = set()
        for (peer, name), by_behaviour in self._subsystem.written.items():
            if not peer and name in leaves:
                written.add(name)
                values = (value for values in by_behaviour.values() for value in values)
                leaves[name] += [leaf for value in values for leaf in _leaves(value)]
        found: dict[str, Expr] = {}
        for item in self._subsystem.memory:
            if item.name in written and isinstance(item.type, (Bool, Enum, Int, Real)):
                memory = MemoryRef(item.name, type=item.type)
                known = _one_of(memory, leaves) or _bound(memory, leaves[item.name])
                found |= {item.name: known} if known else {}
        return found


def _leaves(expr: Expr) -> Iterator[Expr]:
    """The values that an expression may have: one of several, or its own."""
    match expr:
        case Choice(then=then, otherwise=otherwise):
            yield from (*_leaves(then), *_leaves(otherwise))
        case Builtin(name="min" | "max", args=args):
            yield from (leaf for arg in args for leaf in _leaves(arg))
        case _:
            yield expr


def _one_of(memory: MemoryRef, leaves: dict[str, list[Expr]]) -> Expr | None:
    """That memory has one of the literals that it, or memory whose value it gets, is given."""

    def others(name: str) -> Iterator[str]:
        return (leaf.name for leaf in leaves.get(name, ()) if isinstance(leaf, MemoryRef))

    found = reachable([memory.name], others)
    behind = [leaf for name in found for leaf in leaves.get(name, [None])]
    values = sorted({leaf for leaf in behind if isinstance(leaf, _Literal)}, key=repr)
    known = all(isinstance(leaf, _Literal | MemoryRef) for leaf in behind)
    if not known or len(values) > _MOST_VALUES:
        return None
    if isinstance(memory.type, Enum):
        members = frozenset(value.name for value in values if isinstance(value, Member))
        return Among(memory, members, type=Bool())
    each: list[Expr] = []
    for value in values:
        if isinstance(value, Truth):
            each.append(memory if value.value else Unary("not", memory, type=Bool()))
        else:
            each.append(Compare("==", memory, value, type=Bool()))
    return each[0] if len(each) == 1 else Logic("or", tuple(each), type=Bool())


def _bound(memory: MemoryRef, leaves: list[Expr]) -> Expr | None:
    """Where memory begins that gets literals, or itself with literals added of one sign."""
    starts: list[float] = []
    steps: list[float] = []
    for leaf in leaves:
        match leaf:
            case Number(value=value):
                starts.append(value)
            case Binary(op="+", left=Number(value=value), right=other) if other == memory:
                steps.append(value)
            case Binary(op="+", left=other, right=Number(value=value)) if other == memory:
                steps.append(value)
            case Binary(op="-", left=other, right=Number(value=value)) if other == memory:
                steps.append(-value)
            case _ if leaf != memory:
                return None
    if not starts or (min(steps, default=0) < 0 < max(steps, default=0)):
        return None
    if min(steps, default=0) >= 0:
        return Compare(">=", memory, Number(min(starts), type=memory.type), type=Bool())
    return Compare("<=", memory, Number(max(starts), type=memory.type), type=Bool())


# A declared condition, and every part of it, holds in some situation and fails in another.


def conditions_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0613 and W0617; what cannot be meant in a condition is `expressions_meant`'s matter."""
    told: set[Place] = set()
    for machine in facts.whole:
        for finding in machine.told(_findings):
            if finding.primary not in told:
                told.add(finding.primary)
                yield finding


def _findings(machine: Machine) -> Iterator[Diagnostic]:
    constancy = Constancy(machine)
    for condition in machine.subsystem.conditions:
        settled = machine.settled(condition)
        if settled is None:
            yield from map(_part, constancy.parts(condition))
        elif not machine.misfits.within(condition.when):
            word = "always" if settled else "never"
            yield Diagnostic(
                "W0613",
                f"{condition.kind} condition `{condition.name}` {word} holds",
                condition.place,
                _time(machine, condition, settled),
                help=f"write `{word}` where it is used, or correct the condition",
            )


def _time(machine: Machine, condition: Condition, settled: bool) -> str:
    """The remark that time decides a condition, if it does."""
    when = condition.when
    never = Unary("not", when, type=Bool()) if settled else when
    if not machine.lasting.is_why(never):
        return ""
    first = ms(1 / machine.subsystem.rate_hz)
    return f"its times decide it; conditions are first evaluated after {first}"


def _part(part: ConstantPart) -> Diagnostic:
    word = "always" if part.holds else "never"
    condition = part.condition
    place = part.text.place(part.expr)
    elsewhere = place.route[: len(condition.place.route)] != condition.place.route
    named = f"{condition.kind} condition `{condition.name}`"
    return Diagnostic(
        "W0617",
        f"`{show(part.expr)}` {word} holds",
        place,
        "" if elsewhere else f"a part of {named}",
        (Related(condition.place, f"{named} uses it"),) if elsewhere else (),
        "correct it, or leave it out" if part.holds else "correct it, or leave out what it decides",
    )


# No condition waits for a time at which its state is over.


def conditions_in_time(facts: Facts) -> Iterator[Diagnostic]:
    """W0618, once for each condition or row.

    What ends a state by mistake is the matter of `conditions_vary` and `expressions_meant`.
    """
    for machine in facts.whole:
        yield from machine.told(_out_of_time)


def _out_of_time(machine: Machine) -> Iterator[Diagnostic]:
    told = set[Place]()
    for state in machine.subsystem.states:
        for late in machine.lasting.late(state):
            if any(_is_mistaken(machine, condition) for condition in late.ended_by):
                continue
            finding = _finding(late, machine.subsystem)
            if finding.primary not in told:
                told.add(finding.primary)
                yield finding


def _is_mistaken(machine: Machine, condition: Condition) -> bool:
    settled = machine.settled(condition) is not None
    return settled or machine.misfits.within(condition.when)


def _finding(late: Late, subsystem: Subsystem) -> Diagnostic:
    """About the condition that ends a state at once, or else about the one that comes too late."""
    state, ends = late.state, late.ended_by
    asked = Related(late.condition.place, f"`{late.condition.name}`")
    behaviour = Related(state.behaviour.place, f"behaviour `{state.behaviour.name}`")
    if late.over_s == 1 / subsystem.rate_hz and ends == (state.behaviour.error,) and not late.row:
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
        if late.timed
        else f"let the state last longer, or change `{late.condition.name}`",
    )


def _too_late(late: Late) -> str:
    """The message; a condition without a time that ends a state does so at once."""
    state, name, over = late.state.name, late.condition.name, ms(late.over_s)
    if late.timed:
        return f"state `{state}` has ended, after {over}, before `{name}` can hold"
    ends = listed([f"`{condition.name}`" for condition in late.ended_by], "or")
    return f"{ends} ends state `{state}` in its first period, {over}, before `{name}` can hold"


def _timed_part(condition: Condition, late: Late) -> str:
    if len(late.ended_by) > 1:
        return f"`{condition.name}` or the other one has ended it by then"
    return f"`{condition.name}` has ended it by then"


# What is required, or waited for, depends on the run.


def formulas_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0613; a formula about constants is taken as intended."""
    for item in (*facts.system.requirements, *facts.system.triggers):
        parts = (node for part in expressions(item.formula) for node in walk(part))
        if not item.readings and not any(isinstance(node, ConstantRef) for node in parts):
            yield Diagnostic(
                "W0613",
                f"`{item.that}` says the same of every run",
                item.place,
                help="name a value of an agent or of the plant, or delete it",
            )


CHECKS = (conditions_vary, conditions_in_time, formulas_vary)
