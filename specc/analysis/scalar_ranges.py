"""What a number can be: a range for each of the definitions that reach it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from specc.analysis.machine import Machine
from specc.analysis.reaching import ReachingDefinitions, ScalarExpr
from specc.analysis.reads import Dependence
from specc.lang import ranges
from specc.lang.bounds import range_of_parts
from specc.lang.ranges import ANY, Range
from specc.model.expr import Choice, Compare, Component, Expr, Input, MemoryRef, children, walk
from specc.model.types import Int, Real

_DEEPEST = 100
"""Definitions on one way, and parts of expressions, that are followed."""
_MOST_RANGES = 16
"""Of a part of an expression: of more, their union counts."""
_MOST_STEPS = 20_000
"""Of one question."""
_Ranges = dict[ScalarExpr, tuple[Range, ...]]


class ScalarRanges:
    """Answers one question: between which numbers lies what a definition gives?

    In each range lie all values that the number has where one definition reaches it. What tests
    may keep back is not followed.
    """

    def __init__(self, definitions: ReachingDefinitions, machine: Callable[[str], Machine]) -> None:
        """`machine` gives that of a subsystem by its qualified name."""
        self._definitions = definitions
        self._machine = machine
        self._open: set[ScalarExpr] = set()
        self._left = _MOST_STEPS

    def of(self, scalar: ScalarExpr) -> _Ranges:
        """By the expressions that compute it, or are literals."""
        self._left -= 1
        if scalar in self._open or len(self._open) > _DEEPEST or self._left < 0:
            return {scalar: (self._in_memory(scalar),)}
        if self._is_tested(scalar):
            return {scalar: (ANY,)}
        self._open.add(scalar)
        found: _Ranges = {}
        definitions = self._definitions.of(scalar)
        for each in definitions or ():
            found |= self.of(each) if isinstance(each, ScalarExpr) else {scalar: (ANY,)}
        if definitions is None:
            found[scalar] = tuple(dict.fromkeys(self._computed(scalar)))
        self._open.remove(scalar)
        return found

    def _in_memory(self, scalar: ScalarExpr) -> Range:
        """Of what depends on itself: the bounds of memory."""
        if isinstance(scalar.expr, MemoryRef) and scalar.subsystem:
            return self._machine(scalar.subsystem).memory_facts.bounds.of(scalar.expr)
        return ANY

    def _computed(self, scalar: ScalarExpr) -> Iterator[Range]:
        """One for each definition that reaches one part, whatever the other parts are."""
        expr = scalar.expr
        parts = [self._of_part(replace(scalar, expr=part)) for part in children(expr)]
        whole = [ranges.union(*each) for each in parts]
        yield range_of_parts(expr, whole)
        for index, each in enumerate(parts):
            for one in each if len(each) <= _MOST_RANGES else ():
                yield range_of_parts(expr, [*whole[:index], one, *whole[index + 1 :]])

    def _of_part(self, scalar: ScalarExpr) -> list[Range]:
        if not isinstance(scalar.expr.type, (Int, Real)):
            return [ANY]
        every = (range_ for found in self.of(scalar).values() for range_ in found)
        return list(dict.fromkeys(every)) or [ANY]

    def _is_tested(self, scalar: ScalarExpr) -> bool:
        """Whether a choice or a condition of the machine may keep some of the values back."""
        if not scalar.subsystem:
            return False
        machine, expr = self._machine(scalar.subsystem), scalar.expr
        of = machine.dependences.of
        if isinstance(expr, Choice):
            return any(_shared(of(expr.test), of(b)) for b in (expr.then, expr.otherwise))
        core = expr.value if isinstance(expr, Component) else expr
        if not isinstance(core, (Input, MemoryRef)):
            return False
        asked = (condition.when for condition in machine.subsystem.exit_conditions)
        return any(_compares(when) and _shared(of(when), of(core)) for when in asked)


def _shared(one: Dependence, other: Dependence) -> bool:
    return bool(one.values & other.values or one.memory & other.memory)


def _compares(condition: Expr) -> bool:
    return any(isinstance(part, Compare) for part in walk(condition))
