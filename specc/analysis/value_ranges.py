"""Value ranges of memory, from all that is ever written to it: literals, or bounds."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, Literal

from specc.lang import ranges
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import range_of_parts
from specc.lang.kinds import kind
from specc.lang.ranges import ANY, Range
from specc.model.expr import (
    MIRRORED,
    Binary,
    Builtin,
    Choice,
    Compare,
    ConstantRef,
    Expr,
    IsOneOf,
    LetRef,
    Member,
    MemoryRef,
    Number,
    Truth,
    Unary,
    children,
    conjuncts,
    junction,
    negation,
    opposite,
    walk,
)
from specc.model.system import Subsystem
from specc.model.types import Bool, Enum, Int, Real
from specc.proof import Numbering
from specc.reachable import reachable

# What numbers in memory lie between.
#
# Intervals as an abstract domain: those of initial values grow by what may be written, until
# nothing new comes; what goes on growing is widened to the next number that the subsystem names, or
# one step from it, and at last to infinity. Inside a choice the test narrows what it compares.


_GROWS = 3
"""Rounds in which bounds may grow by as much as is written."""
_WIDENED = 40
"""Rounds in which they are widened to the next number that is named; then to infinity."""
_MOST_ENDS = 100
"""Numbers times operands; with more of them bounds are widened to the numbers alone."""
_MOST_STEPS = 100_000
"""Parts of expressions, and bounds that are carried into choices, that are looked at in a search;
of memory that takes more nothing is known."""

_ALL_FLOATS = 2**53
"""All whole numbers below it are floats."""

_Now = dict[Expr, Range]
"""What memory and lets lie between."""


class MemoryBounds:
    """The bounds of the memory of a subsystem, by name; of numbers alone."""

    def __init__(
        self,
        subsystem: Subsystem,
        written: Mapping[str, Sequence[Expr]],
        numbering: Numbering,
    ) -> None:
        """`written` has all that memory is ever given; `numbering` knows lets and constants."""
        self._numbering = numbering
        self._budget = _MOST_STEPS
        self._written: dict[Expr, Sequence[Expr]] = {
            MemoryRef(item.name, type=item.type): written[item.name]
            for item in subsystem.memory
            if isinstance(item.type, (Int, Real))
        }
        lets: dict[Expr, Expr] = {
            LetRef(let.name, type=let.value.type): let.value for let in subsystem.lets
        }
        read = reachable(
            (let for values in self._written.values() for let in _names(values)),
            lambda let: _names([lets[let]]) if let in lets else (),
        )
        self._lets = [(let, value) for let, value in lets.items() if let in read]
        every = [*chain(*self._written.values()), *(value for _, value in self._lets)]
        computed = (part for part in _parts(every) if isinstance(part, Binary))
        operands = chain.from_iterable(map(children, computed))
        named, steps = (
            {
                ranges.range_of_value(n)[0]
                for n in map(numbering.constant_number, parts)
                if n is not None
            }
            for parts in (_parts(every), operands)
        )
        if len(named) * len(steps) <= _MOST_ENDS:
            named |= {end for n in named for s in steps for end in (n + s, n - s)}
        self._named = sorted(named)
        found = self._fixpoint() if self._written else {}
        self._budget = _MOST_STEPS
        self._lets = [*lets.items()]
        self._found = self._with_lets(found)

    def of(self, expr: Expr, tests: Iterable[Expr] = ()) -> Range:
        """The range of an expression of numbers, or of a condition, where `tests` hold."""
        now, self._budget = self._found, _MOST_STEPS
        for test in tests:
            now = self._narrowed(now, test)
        return self._of(expr, now)

    def _fixpoint(self) -> _Now:
        now = {each: self._assigned(each, values[:1], {}) for each, values in self._written.items()}
        for count in range(_GROWS + _WIDENED + 2 * len(self._written)):
            here = self._with_lets(now)
            after = {
                memory: ranges.union(now[memory], self._assigned(memory, values, here))
                for memory, values in self._written.items()
            }
            if after == now:
                return now
            named = self._named if count < _GROWS + _WIDENED else ()
            now = {m: r if count < _GROWS else _widened(now[m], r, named) for m, r in after.items()}
        return {}

    def _assigned(self, memory: Expr, values: Iterable[Expr], now: _Now) -> Range:
        """The range of assigned values; a whole number becomes a real one in real memory."""
        found = ((value.type, self._of(value, now)) for value in values)
        is_real = isinstance(memory.type, Real)
        each = (ranges.as_floats(r) if is_real and isinstance(t, Int) else r for t, r in found)
        return ranges.union(*each)

    def _with_lets(self, now: _Now) -> _Now:
        here = dict(now)
        for let, value in self._lets:
            here[let] = self._of(value, here)
        return here

    def _of(self, expr: Expr, now: _Now) -> Range:
        """The range of a value where memory and lets are within `now`."""
        self._budget -= 1
        if self._budget < 0:
            return ANY
        if (value := self._numbering.constant_number(expr)) is not None:
            return ranges.range_of_value(value)
        match expr:
            case MemoryRef() | LetRef():
                return now.get(expr, ANY)
            case ConstantRef(is_live=True) if (
                value_now := self._numbering.resolve(expr)
            ) is not expr:
                return self._of(value_now, now)
            case Choice(test=test, then=then, otherwise=otherwise):
                if_true = self._of(then, self._narrowed(now, test))
                if_false = self._of(otherwise, self._narrowed(now, negation(test)))
                return range_of_parts(expr, (self._of(test, now), if_true, if_false))
        return range_of_parts(expr, [self._of(part, now) for part in children(expr)])

    def _narrowed(self, now: _Now, condition: Expr) -> _Now:
        """Narrow bounds to where a condition holds; unchanged if it never does."""
        found = dict(now)
        self._budget -= len(now)
        for part in conjuncts(self._numbering.resolve(condition)):
            if isinstance(part, Unary) and isinstance(part.operand, Compare):
                part = opposite(part.operand)
            if isinstance(part, Compare):
                op: Any = MIRRORED[part.op]
                for comparison in (part, Compare(op, part.right, part.left, type=part.type)):
                    self._narrow(found, comparison)
        return found

    def _narrow(self, found: _Now, comparison: Compare) -> None:
        left = comparison.left
        if left not in found:
            return
        (low, high), (least, greatest) = found[left], self._of(comparison.right, found)
        is_whole = isinstance(left.type, Int) and isinstance(comparison.right.type, Int)
        if isinstance(left.type, Int) != isinstance(comparison.right.type, Int):
            # A whole number may be rounded beside a float, which keeps those within unchanged.
            least = least if abs(least) < _ALL_FLOATS else -math.inf
            greatest = greatest if abs(greatest) < _ALL_FLOATS else math.inf
        if comparison.op in ("<", "<=", "=="):
            high = min(high, greatest - 1 if is_whole and comparison.op == "<" else greatest)
        if comparison.op in (">", ">=", "=="):
            low = max(low, least + 1 if is_whole and comparison.op == ">" else least)
        if comparison.op == "!=" and is_whole and least == greatest:  # at an end of the interval
            low, high = low + (low == least), high - (high == greatest)
        if low <= high:
            found[left] = low, high


def _widened(before: Range, after: Range, named: Sequence[float]) -> Range:
    """Widen growing bounds to the next of the sorted numbers that are `named`."""
    low, high = after
    if high > before[1]:
        above = bisect_left(named, high)
        high = named[above] if above < len(named) else math.inf
    if low < before[0]:
        below = bisect_right(named, low)
        low = named[below - 1] if below else -math.inf
    return low, high


def _names(values: Iterable[Expr]) -> Iterable[Expr]:
    return (part for value in values for part in walk(value) if isinstance(part, LetRef))


def _parts(every: Iterable[Expr]) -> Iterable[Expr]:
    return (part for value in every for part in walk(value) if isinstance(part.type, (Int, Real)))


# What always holds of memory.


_MOST_VALUES = 8
_KnownLeaf = Truth | Member | Number


class ValueRanges:
    """Invariants of the memory of one subsystem."""

    def __init__(self, subsystem: Subsystem, numbering: Numbering) -> None:
        """`numbering` knows lets and constants."""
        given: dict[str, list[Expr]] = {item.name: [item.init] for item in subsystem.memory}
        for (peer, name), by_behaviour in subsystem.assigned_values.items():
            if not peer and name in given:
                given[name] += chain(*by_behaviour.values())
        self.bounds = MemoryBounds(subsystem, given, numbering)
        self._numbering, self._assigned = numbering, given
        self.conditions: dict[str, Expr] = {}
        """Of memory that is written, by the name of the element."""
        self.unwritten: dict[str, Expr] = {}
        """The value of memory that nothing writes and that begins with a literal, by name."""
        self.invariants: tuple[Expr, ...] = ()
        """All that is known, whether or not memory is meant to keep within it."""
        for item in subsystem.memory:
            if kind(item.type).sort != "other":
                memory = MemoryRef(item.name, type=item.type)
                values, within = (
                    _among_literals(memory, self._possible_values(memory)),
                    self.bounds.of(memory),
                )
                ends = tuple(_bound_conditions(memory, within))
                self.invariants += (values,) if values else ends
                if len(given[item.name]) == 1:
                    self.unwritten |= {item.name: values} if values else {}
                elif values:
                    self.conditions[item.name] = values
                elif len(ends) == 1:  # from there on it goes on for ever; two are a range
                    self.conditions[item.name] = ends[0]

    def members(self, expr: Expr) -> frozenset[str]:
        """The members of an enum that an expression may have, as far as they are known by name."""
        return frozenset(
            leaf.name for leaf in self._possible_values(expr) if isinstance(leaf, Member)
        )

    def _possible_values(self, expr: Expr) -> list[Expr]:
        """The expressions whose value an expression may have, through choices and memory."""
        return [part for part in reachable([expr], self._values) if not self._values(part)]

    def _values(self, expr: Expr) -> Sequence[Expr]:
        """The expressions one of which gives the value of another; none if it has its own."""
        match expr:
            case MemoryRef(name=name):
                return self._assigned.get(name, ())
            case LetRef() | ConstantRef():
                named = self._numbering.resolve(expr)
                return () if named is expr else (named,)
            case Choice(then=then, otherwise=otherwise):
                return then, otherwise
            case Builtin(name=name, args=args) if FUNCTIONS[name].chooses:
                return args
        return ()


def _bound_conditions(memory: MemoryRef, range_: Range) -> Iterator[Expr]:
    """The conditions that memory keeps within the finite ends of a range."""
    ends: tuple[tuple[Literal[">=", "<="], float], ...] = (">=", range_[0]), ("<=", range_[1])
    for op, end in ends:
        if math.isfinite(end):
            yield Compare(op, memory, Number(end, type=memory.type), type=Bool())


def _among_literals(memory: MemoryRef, behind: Sequence[Expr]) -> Expr | None:
    """The condition that memory has one of the literals that are assigned to it."""
    values = sorted({leaf for leaf in behind if isinstance(leaf, _KnownLeaf)}, key=repr)
    if not all(isinstance(leaf, _KnownLeaf) for leaf in behind) or len(values) > _MOST_VALUES:
        return None
    if isinstance(memory.type, Enum):
        members = frozenset(value.name for value in values if isinstance(value, Member))
        return IsOneOf(memory, members, type=Bool())
    each: list[Expr] = []
    for value in values:
        if isinstance(value, Truth):
            each.append(memory if value.value else negation(memory))
        else:
            each.append(Compare("==", memory, value, type=Bool()))
    return junction("or", each)
