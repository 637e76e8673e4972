"""Parts of expressions that have one truth value because of their own subsystem."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.analysis.machine import Machine
from specc.analysis.reads import ExpressionText, text_of
from specc.lang.dependence_order import InDependenceOrder
from specc.lang.ranges import ANY
from specc.model.expr import (
    LITERALS,
    Choice,
    Expr,
    LetRef,
    Quantifier,
    children,
    has_free_variable,
    has_unknown,
    walk,
)
from specc.model.fsm import Condition
from specc.model.logic import junction, negation
from specc.model.types import Bool, Real
from specc.proof import EvaluationPoint

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
    around: tuple[Expr, ...] = ()
    """The tests of choices and the quantifiers in which the part stands, from outside."""
    unwritten: tuple[str, ...] = ()
    """The memory that nothing writes, if the part depends on nothing else."""

    @property
    def claim(self) -> Expr:
        """What always holds: the part, or its opposite, wherever the tests around it do."""
        said = self.expr if self.holds else negation(self.expr)
        for outer in reversed(self.around):
            if isinstance(outer, Quantifier):
                said = replace(outer, kind="all", body=said, type=Bool())
            else:
                said = junction("or", (negation(outer), said))
        return said


class ConstantConditions:
    """Asks about the expressions of one subsystem that has no unknowns."""

    def __init__(self, machine: Machine) -> None:
        subsystem = machine.subsystem
        self._subsystem = subsystem
        self._machine = machine
        self._misfits = machine.suspicious
        lets = {item.name: item for item in subsystem.lets}
        self._of_lets = InDependenceOrder(
            {name: item.value for name, item in lets.items()},
            lambda name: self._in(text_of(lets[name]), lets[name].value, None),
        )
        self._found: list[tuple[ExpressionText, Expr, bool, tuple[Expr, ...]]] = []
        self._in_conditions = True
        self._memory = machine.memory_facts
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
            self._in(text, child, condition, (*around, *more)) for child, more in _inside(expr)
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
        if on.literal:
            return None
        if self._misfits.within(part) or not (self._misfits.varies(part) or self._unwritten(part)):
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
        prover = self._machine.any_prover if of_any else self._machine.prover
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
        if not self._in_conditions or not on.lasts or has_unknown(part):
            return ()
        return tuple(sorted(on.memory)) if on.memory <= self._memory.unwritten.keys() else ()


def _inside(expr: Expr) -> Iterator[tuple[Expr, tuple[Expr, ...]]]:
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
