"""Where the number line of each number is cut, so that a region decides what a value would.

A number that counts has too many values to track each. A comparison with a constant cuts the
number that it compares, and every number from which that one is computed: the cut is carried
backwards through sums, choices, copies and wires. Two values between the same cuts make the same
comparisons true. Any choice of cuts is sound; a better choice leaves fewer decisions open.

Expressions here are those of all machines together: each leaf is the memory or the output, a
`NumberTarget`, from which it gets its value, as a `MemoryRef` of that name.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from specc.analysis import Facts
from specc.analysis.graph import components
from specc.analysis.reads import texts
from specc.lang.builtins import FUNCTIONS
from specc.lang.ranges import Range, union
from specc.model import expr as m
from specc.model.requirement import Reading, Requirement, expressions_in
from specc.model.system import System
from specc.model.wires import Wires
from specc.proof import InputName
from specc.reachable import reachable
from specc.tools.explore.partial import KnownValues, residual, static_values
from specc.tools.explore.regions import Cut, NumberDomain, Regions, is_number, value_leaves

MOST_EXACT = 16
"""The most proven values of a number that is tracked exactly although it counts."""
MOST_CUTS = 24
"""The most cuts of one number; without further ones decisions are left open."""

NumberTarget = str
"""The name of memory, `rover.c.n`, or of an output, `rover.c.y.base.speed`."""


def target_name(machine: str, key: InputName) -> NumberTarget:
    """The name of memory, whose peer is "", or of an output."""
    peer, name = key
    return f"{machine}.y.{peer}.{name}" if peer else f"{machine}.{name}"


def reading_target(reading: Reading) -> NumberTarget:
    """The memory or output that a reading reads."""
    *peer, name = reading.element or ("",)
    return target_name(reading.subsystem, ("".join(peer), name))


def number_domains(
    facts: Facts, requirements: Iterable[Requirement] = ()
) -> dict[NumberTarget, NumberDomain]:
    """The domains of all numbers in memory and outputs of a system.

    Conditions of the requirements cut them, too.
    """
    assigned: dict[NumberTarget, list[m.Expr]] = {}
    ranges: dict[NumberTarget, Range] = {}
    conditions = [*_conditions(requirements, facts.system)]
    for machine in facts.machines:
        subsystem, name = machine.subsystem, machine.subsystem.qualified_name
        known, bounds = static_values(subsystem, facts.system), machine.value_ranges.bounds

        def located(expr: m.Expr, name: str = name, known: KnownValues = known) -> m.Expr:
            return _located(residual(expr, known), name, facts.wires)

        conditions += (located(text.expr) for text in texts(subsystem))
        for key, written in subsystem.assigned_values.items():
            values = [value for each in written.values() for value in each]
            if all(map(is_number, values)):
                assigned[target_name(name, key)] = [*map(located, values)]
                ranges[target_name(name, key)] = union(*map(bounds.of, values))
        for item in subsystem.memory:
            memory = m.MemoryRef(item.name, type=item.type)
            if is_number(memory):
                ranges[target_name(name, ("", item.name))] = bounds.of(memory)
    cuts = NumberCuts(assigned, conditions)
    return {
        target: NumberDomain(
            Regions(cuts.by_target.get(target, ())),
            low,
            high,
            counts=target in cuts.counting and high - low >= MOST_EXACT,
            given=cuts.given_to(target),
        )
        for target, (low, high) in ranges.items()
    }


def _located(expr: m.Expr, name: str, wires: Wires) -> m.Expr:
    """An expression of a machine in which each leaf is the target from which it comes."""
    if isinstance(expr, m.MemoryRef):
        return replace(expr, name=target_name(name, ("", expr.name)))
    if isinstance(expr, m.Input):
        sent = wires.sender(name, expr.key)
        return expr if sent is None else m.MemoryRef(target_name(*sent), type=expr.type)
    return m.map_children(expr, lambda part: _located(part, name, wires))


def _conditions(requirements: Iterable[Requirement], system: System) -> Iterator[m.Expr]:
    """The conditions in requirements, with targets in place of readings."""
    constants: dict[str, m.Expr] = {}
    for item in system.constants:  # each names only those before it
        constants[item.name] = residual(item.value, KnownValues({}, constants, Fraction(1)))
    for requirement in requirements:
        targets = {reading.name: reading_target(reading) for reading in requirement.readings}
        for condition in expressions_in(requirement.formula):
            known = residual(condition, KnownValues({}, constants, Fraction(1)))
            yield _with_names(known, targets)


def _with_names(expr: m.Expr, names: Mapping[str, NumberTarget]) -> m.Expr:
    if isinstance(expr, m.MemoryRef):
        return replace(expr, name=names.get(expr.name, expr.name))
    return m.map_children(expr, lambda part: _with_names(part, names))


class NumberCuts:
    """The cuts of each number, and the numbers that count."""

    def __init__(
        self,
        assigned: Mapping[NumberTarget, Sequence[m.Expr]],
        conditions: Iterable[m.Expr],
    ) -> None:
        """`assigned` has all that numbers ever get; `conditions` may compare anything."""
        self._assigned = assigned
        self._flow = {
            target: {leaf for value in values for leaf in _names(value)}
            for target, values in assigned.items()
        }
        edges = [(source, target) for target, sources in self._flow.items() for source in sources]
        cycles = components([*assigned], edges)
        self._cycle_of = {target: n for n, cycle in enumerate(cycles) for target in cycle.states}
        self.by_target: dict[NumberTarget, set[Cut]] = {}
        self._waiting = deque[tuple[NumberTarget, Cut]]()
        """Cuts that were not moved yet to what their targets are computed from."""
        nodes = (node for condition in conditions for node in m.walk(condition))
        compared = [node for node in nodes if isinstance(node, m.Compare)]
        for each in compared:
            self._cut(each)
        while self._waiting:
            target, cut = self._waiting.popleft()
            for value in assigned.get(target, ()):
                self._carry(value, {cut}, target)
        relative = reachable(_compared_with_varying(compared), lambda t: self._flow.get(t, ()))
        self.counting = frozenset(
            target
            for cycle in cycles
            if self._computes(cycle.states) and relative.keys().isdisjoint(cycle.states)
            for target in cycle.states
        )
        """The numbers on a cycle of assignments that computes.

        Not those that are compared with another number that varies: how far two numbers are apart
        decides then, which no cut of either tells.
        """

    def given_to(self, target: NumberTarget) -> tuple[float, float]:
        """The least and the greatest of zero and the constants that come to a number."""
        sources = reachable([target], lambda each: self._flow.get(each, ()))
        values = [value for source in sources for value in self._assigned.get(source, ())]
        found = [0, *(constant for value in values for constant in _constants(value))]
        return min(found), max(found)

    def _computes(self, cycle: Collection[NumberTarget]) -> bool:
        """Whether the numbers on a cycle of assignments are more than copied."""
        values = (value for target in cycle for value in self._assigned[target])
        return any(not _computed_from(value).isdisjoint(cycle) for value in values)

    def _cut(self, compare: m.Compare) -> None:
        for side, other, op in (
            (compare.left, compare.right, compare.op),
            (compare.right, compare.left, m.MIRRORED[compare.op]),
        ):
            if isinstance(other, m.Number):
                above = {"<": [False], ">=": [False], ">": [True], "<=": [True]}
                sides = above.get(op, [False, True])
                self._carry(side, {Cut(other.value, is_above=each) for each in sides})

    def _carry(self, expr: m.Expr, cuts: set[Cut], given_to: NumberTarget = "") -> None:
        """Cut the numbers in an expression so that they tell between which cuts it lies.

        `given_to` is the target that gets it. On a cycle that computes cuts are not moved, since
        they would be moved for ever.
        """
        match expr:
            case m.MemoryRef(name=target) if is_number(expr):
                self._add(target, cuts)
            case m.Choice(then=then, otherwise=otherwise):
                self._carry(then, cuts, given_to)
                self._carry(otherwise, cuts, given_to)
            case m.Builtin(name=name, args=args):
                function = FUNCTIONS[name]
                inside = {Cut(n, is_above=a) for n in function.turns_at for a in (False, True)}
                if function.chooses or function.is_size:
                    inside |= cuts
                if function.is_size:
                    inside |= {-cut for cut in cuts}
                if len(inside) > MOST_CUTS:
                    inside = set(sorted(inside)[:MOST_CUTS])
                for argument in args if inside else ():
                    self._carry(argument, inside, given_to)
            case m.Unary(op="-", operand=operand):
                self._carry(operand, {-cut for cut in cuts}, given_to)
            case m.Binary():
                cycle = self._cycle_of.get(given_to, -1)
                if all(self._cycle_of.get(source) != cycle for source in _names(expr)):
                    moved = [pair for cut in cuts for pair in _moved(expr, cut)]
                    if moved:
                        operand, _ = moved[0]
                        self._carry(operand, {each for _, each in moved}, given_to)

    def _add(self, target: NumberTarget, cuts: set[Cut]) -> None:
        known = self.by_target.setdefault(target, set())
        for cut in sorted(cuts - known)[: MOST_CUTS - len(known)]:
            known.add(cut)
            self._waiting.append((target, cut))


def _moved(expr: m.Binary, cut: Cut) -> Iterator[tuple[m.Expr, Cut]]:
    """The operand of a sum, difference, product or quotient that varies, with its cut."""
    match expr:
        case m.Binary(op="+", left=operand, right=m.Number(value=n)):
            yield operand, Cut(cut.value - n, cut.is_above)
        case m.Binary(op="+", left=m.Number(value=n), right=operand):
            yield operand, Cut(cut.value - n, cut.is_above)
        case m.Binary(op="-", left=operand, right=m.Number(value=n)):
            yield operand, Cut(cut.value + n, cut.is_above)
        case m.Binary(op="-", left=m.Number(value=n), right=operand):
            yield operand, -Cut(cut.value - n, cut.is_above)
        case m.Binary(op="*", left=operand, right=m.Number(value=n)) if n:
            yield operand, Cut(cut.value / n, cut.is_above == (n > 0))
        case m.Binary(op="*", left=m.Number(value=n), right=operand) if n:
            yield operand, Cut(cut.value / n, cut.is_above == (n > 0))
        case m.Binary(op="/", left=operand, right=m.Number(value=n)) if n:
            yield operand, Cut(cut.value * n, cut.is_above == (n > 0))


def _names(expr: m.Expr) -> set[NumberTarget]:
    """The targets that determine the value of an expression."""
    return {leaf.name for leaf in value_leaves(expr) if isinstance(leaf, m.MemoryRef)}


def _computed_from(expr: m.Expr) -> set[NumberTarget]:
    """The targets in an expression, without those that it only copies or chooses."""
    match expr:
        case m.MemoryRef():
            return set()
        case m.Choice(then=then, otherwise=otherwise):
            return _computed_from(then) | _computed_from(otherwise)
    return _names(expr)


def _constants(expr: m.Expr) -> Iterator[float]:
    """The constants that an expression is or chooses."""
    match expr:
        case m.Number(value=value):
            yield value
        case m.Choice(then=then, otherwise=otherwise):
            yield from (*_constants(then), *_constants(otherwise))


def _compared_with_varying(compared: Iterable[m.Compare]) -> Iterator[NumberTarget]:
    """The numbers in comparisons of which both sides vary."""
    for each in compared:
        sides = _names(each.left), _names(each.right)
        if all(sides):
            yield from sides[0] | sides[1]
