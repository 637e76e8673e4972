"""From conditions to formulas: what is Boolean becomes structure, everything else an atom.

Atoms are chosen so that complements coincide: `a <= b` is `not b < a`, `v in {u, c}` says how one
choice of a member came out, `all(P)` is `not any(not P)`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial

from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import range_of_parts
from specc.lang.kinds import kind
from specc.lang.ranges import range_of_value
from specc.limits import is_used_up
from specc.model.expr import (
    COMPARISONS,
    FLOAT,
    MIRRORED,
    Binary,
    Builtin,
    Choice,
    Compare,
    Expr,
    Fresh,
    IsNone,
    IsOneOf,
    LetRef,
    Logic,
    MemoryRef,
    Nothing,
    Number,
    Present,
    Quantifier,
    Truth,
    Unary,
)
from specc.model.fsm import mode_name, mode_of
from specc.model.types import Bool, Enum, Int, ListOf, OptionalOf, Real, Type, Vector
from specc.proof.clock import Timer, TurningPoints, asks_entry
from specc.proof.formula import (
    Arrival,
    Atom,
    EnumItem,
    Flag,
    Formula,
    Formulas,
    ItemCollection,
    Label,
    PoseDistance,
    Quantity,
    Threshold,
    Variable,
)
from specc.proof.numbering import Depths, Numbering
from specc.proof.verdict import InputName

_OUTSIDE: Depths = {}
# The question that decides a comparison, and the answer with which the comparison holds.
_QUESTIONS: dict[str, tuple[str, bool]] = {
    "<": ("<", True),
    "<=": ("<=", True),
    "==": ("==", True),
    ">": ("<=", False),
    ">=": ("<", False),
    "!=": ("==", False),
}

Near = tuple[Quantity | PoseDistance, object]


class Translator:
    """Translates the conditions of one subsystem; equal conditions give the same formula."""

    def __init__(
        self,
        lets: Mapping[str, Expr],
        constants: Mapping[str, Expr],
        always_present: Collection[InputName] = (),
        period_s: Fraction | None = None,
    ) -> None:
        """`always_present`: peer and name of input elements that are never without a value.

        With `period_s`, formulas are about the moments at which conditions are asked: a period
        after a state began, or a multiple of that.
        """
        self.make = Formulas()
        self._lets = lets
        self._always = always_present
        self.numbering = self._numbering = Numbering(lets, constants, period_s)
        self._is_in_conditions = period_s is not None
        self.timer = Timer(self._numbering)
        self._mode_timers: dict[LetRef, tuple[MemoryRef, Timer]] = {}
        """`elapsed(mode)` -> the memory that counts its periods, and when conditions on it turn."""
        for name, value in lets.items():
            if mode := mode_of("elapsed", name):
                counter = MemoryRef(mode_name("periods", mode), type=Int())
                timer = Timer(self._numbering, counter.name)
                self._mode_timers[LetRef(name, type=value.type)] = counter, timer
        self._memo: dict[tuple[int, int], Formula] = {}
        self._split_formulas: dict[object, dict[int, Formula]] = {}
        for value in lets.values():
            # In order of dependence, so that no chain of lets is followed by deep recursion.
            self.timer.is_unsure(value)
            for part in (value, *_tests(value)):
                if isinstance(part.type, Bool):
                    self.formula(part)

    def formula(self, expr: Expr) -> Formula:
        """The formula of an expression of type bool."""
        return self._bool(expr, _OUTSIDE)

    def arrival(self, peer: str, element: str) -> Arrival:
        """The variable of an input element."""
        return Arrival(peer, element, (peer, element) in self._always)

    def _bool(self, expr: Expr, bound: Depths) -> Formula:
        key = (self._numbering.number(expr, bound), len(bound))
        if key not in self._memo:
            # Nothing more is decided then: a condition is a question that nothing is known of.
            is_opaque = is_used_up("proof")
            whole = self._resolve(expr)
            self._memo[key] = (
                self._ask(Flag(key[0]), None, whole) if is_opaque else self._translate(whole, bound)
            )
        return self._memo[key]

    def _translate(self, expr: Expr, bound: Depths) -> Formula:
        match expr:
            case Truth(value=value):
                return self.make.constant(value)
            case Unary(op="not", operand=operand):
                return self.make.negation(self._bool(operand, bound))
            case Logic(op=op, operands=operands):
                parts = [self._bool(part, bound) for part in operands]
                join = self.make.conjunction if op == "and" else self.make.disjunction
                return join(parts)
            case Choice(test=test, then=then, otherwise=otherwise):
                return self.make.choice(*(self._bool(p, bound) for p in (test, then, otherwise)))
            case Compare():
                return self._compare(expr, bound)
            case IsOneOf(item=item, members=members):
                return self._among(expr, item, members, bound)
            case IsNone(value=value):
                return self._is_none(expr, value, bound)
        return self._atomic(expr, bound)

    def _atomic(self, expr: Expr, bound: Depths) -> Formula:
        timed = self._timed_formula(expr)
        if timed is not None:
            return timed
        match expr:
            case Fresh(input=element):
                return self._ask(self.arrival(element.peer, element.element), "fresh", expr)
            case Present(input=element):
                return self._ask(self.arrival(element.peer, element.element), "present", expr)
            case _ if asks_entry(expr) and self._is_in_conditions:
                return self.make.false
            case Quantifier(kind="all" | "any"):
                return self._quantifier(expr, bound)
            case Builtin() if FUNCTIONS[expr.name].compares and (near := self._near(expr, bound)):
                return self._ask(*near, expr)
        number = self._numbering.number(expr, bound)
        value = self._numbering.constant_value(number)
        if isinstance(value, bool):
            return self.make.constant(value)
        return self._ask(Flag(number), None, expr)

    def _resolve(self, expr: Expr) -> Expr:
        while isinstance(expr, LetRef) and expr.name in self._lets:
            expr = self._lets[expr.name]
        return expr

    def _ask(self, variable: Variable, test: object, expr: Expr, holds: bool = True) -> Formula:
        """`expr` as a question about a variable: true when the answer is `holds`."""
        unsure = self.timer.is_unsure(expr)
        formula = self.make.atom(Atom(variable, test, expr, holds, unsure))
        return formula if holds else self.make.negation(formula)

    def _timed_formula(self, expr: Expr) -> Formula | None:
        """The formula of a condition that time in the state, or in one mode, decides alone."""
        turns = self.timer.turning_points(expr)
        if turns is not None:
            periods = Quantity("periods", (), True, 1.0)
            return self._timed(expr, turns, periods, partial(self.timer.elapsed_condition, "<"))
        for elapsed, (counter, timer) in self._mode_timers.items():
            if (turns := timer.turning_points(expr)) is not None:
                periods = Quantity("value", (self._numbering.number(counter),), True, None)
                return self._timed(expr, turns, periods, partial(self._before, elapsed, counter))
        return None

    def _before(self, elapsed: LetRef, counter: MemoryRef, turn: int) -> Expr:
        """The condition that a mode has been active for fewer periods."""
        step_s = self._numbering.exact_period_s
        if step_s is None:
            return Compare("<", counter, Number(turn, type=Int()), type=Bool())
        limit = Number(float(turn * step_s), type=elapsed.type)
        return Compare("<", elapsed, limit, type=Bool())

    def _timed(
        self, expr: Expr, turns: TurningPoints, periods: Quantity, before: Callable[[int], Expr]
    ) -> Formula:
        """A condition as questions about a number of periods; `before` shows one of several."""
        holds = turns.first == (len(turns.at) % 2 == 0)
        formula = self.make.constant(holds)
        for turn in reversed(turns.at):
            holds = not holds
            shown = (expr, holds) if len(turns.at) == 1 else (before(turn), True)
            earlier = self.make.atom(Atom(periods, ("<", float(turn)), *shown))
            formula = self.make.choice(earlier, self.make.constant(holds), formula)
        return formula

    def _compare(self, comparison: Compare, bound: Depths) -> Formula:
        """`left op right`; a choice of values becomes a choice of comparisons."""
        timed = self._timed_formula(comparison)
        if timed is not None:
            return timed
        op, left, right = (
            comparison.op,
            self._resolve(comparison.left),
            self._resolve(comparison.right),
        )
        if isinstance(left, Choice):
            key = "left", op, self._numbering.number(right, bound)
            return self._split(
                left, key, bound, lambda a: self._compare(replace(comparison, left=a), bound)
            )
        if isinstance(right, Choice):
            key = "right", op, self._numbering.number(left, bound)
            return self._split(
                right, key, bound, lambda b: self._compare(replace(comparison, right=b), bound)
            )
        if kind(left.type).sort in ("truth", "item"):
            return self._same(comparison, left, right, op == "==", bound)
        question = self._question(op, left, right, bound)
        if isinstance(question, bool):
            return self.make.constant(question)
        variable, test, holds = question
        return self._ask(variable, test, comparison, holds)

    def _split(
        self, choice: Choice, key: object, bound: Depths, formula_of: Callable[[Expr], Formula]
    ) -> Formula:
        """What is said of a choice, as a choice of what is said of values; once for each `key`.

        Values are followed through lets, of which a chain may be long: so without recursion.
        """
        known = self._split_formulas.setdefault((key, len(bound)), {})
        number = partial(self._numbering.number, bound=bound)
        open_: list[Expr] = [choice]
        while open_:
            value = self._resolve(open_[-1])
            if not isinstance(value, Choice):
                known[number(open_.pop())] = formula_of(value)
                continue
            # An integer beside a real becomes a float.
            arms = [_as_float(self._resolve(a), value.type) for a in (value.then, value.otherwise)]
            if missing := [arm for arm in arms if number(arm) not in known]:
                open_ += missing
            else:
                both = (known[number(arm)] for arm in arms)
                known[number(open_.pop())] = self.make.choice(self._bool(value.test, bound), *both)
        return known[number(choice)]

    def _question(
        self, op: str, left: Expr, right: Expr, bound: Depths
    ) -> tuple[Quantity, Threshold, bool] | bool:
        """Quantity, question and the answer with which `left op right`; or its known truth."""
        a, b = self._numbering.number(left, bound), self._numbering.number(right, bound)
        x, y = (
            self._numbering.constant_number(left, bound),
            self._numbering.constant_number(right, bound),
        )
        if x is not None and y is not None:
            return bool(COMPARISONS[op](x, y))
        if a == b:
            return bool(COMPARISONS[op](0, 0))
        if x is not None or (y is None and a > b):
            left, right, a, b, y, op = right, left, b, a, x, MIRRORED[op]
        if y is not None and isinstance(left, Unary):
            negative = Unary("-", right, type=right.type)
            return self._question(MIRRORED[op], left.operand, negative, bound)
        parts = self._subtracted(left) if y is not None else None
        if parts is not None and y == 0.0:
            # Subnormal numbers keep a difference from being 0 unless both are equal.
            return self._question(op, *parts, bound)
        if y is not None:
            compare = Compare(op, left, right, type=Bool())  # type: ignore[arg-type]  # one of six
            sides = self._numbering.live_range(left, bound), range_of_value(y)
            least, greatest = range_of_parts(compare, sides)
            if least == greatest:
                return bool(least)
        if parts is not None and y is not None:
            # The same quantity as a comparison of both, so that tables relate its thresholds.
            known = (self._numbering.constant_number(part, bound) for part in parts)
            one, other = (self._numbering.number(part, bound) for part in parts)
            if one != other and all(number is None for number in known):
                if one > other:  # a rounded difference only changes its sign
                    one, other, op, y = other, one, MIRRORED[op], -y
                comparison, holds = _QUESTIONS[op]
                return Quantity("difference", (one, other), False, None), (comparison, y), holds
        whole = isinstance(left.type, Int)
        if y is not None and isinstance(left, Builtin) and FUNCTIONS[left.name].is_size:
            apart = self._subtracted(self._resolve(left.args[0]))
            if apart is not None:  # the distance of two floats is the same in both directions
                comparison, holds = _QUESTIONS[op]
                one, other = sorted(self._numbering.number(side, bound) for side in apart)
                return Quantity("distance", (one, other), False, 0.0), (comparison, y), holds
        if y is None:
            whole = whole and isinstance(right.type, Int)
            quantity, y = Quantity("difference", (a, b), whole, None), 0.0
        else:
            least, _ = self._numbering.range_of(left, bound)
            quantity = Quantity("value", (a,), whole, None if least == -math.inf else least)
        comparison, holds = _QUESTIONS[op]
        return quantity, (comparison, y), holds

    def _subtracted(self, expr: Expr) -> tuple[Expr, Expr] | None:
        """The two floats of which an expression is the difference."""
        if not (isinstance(expr, Binary) and expr.op == "-"):
            return None
        floats = isinstance(expr.left.type, Real) and isinstance(expr.right.type, Real)
        return (expr.left, expr.right) if floats else None

    def _near(self, expr: Builtin, bound: Depths) -> Near | None:
        """`near` as a question about how far apart two values are, so that tolerances are related.

        None for a tolerance that is not constant. Poses have two tolerances.
        """
        a, b = (self._numbering.number(arg, bound) for arg in expr.args[:2])
        match [self._numbering.constant_number(limit, bound) for limit in expr.args[2:]]:
            case [float() | int() as tolerance]:
                return Quantity("distance", (min(a, b), max(a, b)), False, 0.0), ("<=", tolerance)
            case [float() | int() as distance, float() | int() as angle]:
                return PoseDistance((a, b)), (distance, angle)
        return None

    def _same(self, comparison: Expr, a: Expr, b: Expr, holds: bool, bound: Depths) -> Formula:
        """Whether two truth values, members or texts are the same (or not, unless `holds`)."""
        if isinstance(a.type, Bool):
            p, q = self._bool(a, bound), self._bool(b, bound)
            opposite = self.make.negation(q)
            return self.make.choice(p, *((q, opposite) if holds else (opposite, q)))
        x, y = (self._numbering.number(side, bound) for side in (a, b))
        known_x, known_y = self._numbering.constant_value(x), self._numbering.constant_value(y)
        if x == y or (known_x is not None and known_y is not None):
            return self.make.constant((x == y) == holds)
        if known_x is not None:
            a, x, known_y = b, y, known_x
        if isinstance(a.type, Enum) and known_y is not None:
            variable = EnumItem(x, a.type.members, a)
            return self._ask(variable, frozenset((known_y,)), comparison, holds)
        if isinstance(a.type, Enum):
            items = EnumItem(x, a.type.members, a), EnumItem(y, a.type.members, b)
            same = self.make.disjunction(
                self.make.conjunction(self.make.atom(Atom(item, test)) for item in items)
                for test in (frozenset((member,)) for member in a.type.members)
            )
            return same if holds else self.make.negation(same)
        if known_y is not None:
            return self._ask(Label(x), known_y, comparison, holds)
        return self._ask(Flag(self._numbering.pair(x, y)), None, comparison, holds)

    def _among(self, among: Expr, item: Expr, members: frozenset[str], bound: Depths) -> Formula:
        item = self._resolve(item)
        number = self._numbering.number(item, bound)
        if isinstance(item, Choice):
            return self._split(
                item, members, bound, lambda one: self._among(among, one, members, bound)
            )
        known = self._numbering.constant_value(number)
        enum = item.type
        if known is not None or not isinstance(enum, Enum) or members >= set(enum.members):
            return self.make.constant(known is None or known in members)
        return self._ask(EnumItem(number, enum.members, item), members, among)

    def _is_none(self, is_none: Expr, value: Expr, bound: Depths) -> Formula:
        """Whether an optional value is missing; a choice may miss one in each branch."""
        value = self._resolve(value)
        if isinstance(value, Nothing):
            return self.make.true
        if isinstance(value, Choice):
            return self._split(
                value,
                "none",
                bound,
                lambda one: self._is_none(IsNone(one, type=Bool()), one, bound),
            )
        if not isinstance(value.type, OptionalOf):
            return self.make.false
        number = self._numbering.number(is_none, bound)
        return self._ask(Flag(number), None, is_none)

    def _quantifier(self, quantifier: Quantifier, bound: Depths) -> Formula:
        """`any(body)`; `all(body)` says that there is no item for which the body is false."""
        body = self._bool(quantifier.body, {**bound, quantifier.variable: len(bound)})
        exists = quantifier.kind == "any"
        test = body if exists else self.make.negation(body)
        if test is self.make.false:
            return self.make.constant(not exists)
        over = quantifier.over.type
        size = over.size if isinstance(over, Vector) else None
        number = self._numbering.number(quantifier.over, bound)
        nonempty = isinstance(over, ListOf) and over.nonempty
        return self._ask(ItemCollection(number, size, nonempty), test, quantifier, exists)


def _as_float(arm: Expr, place: Type) -> Expr:
    """What stands in a place of type `place`: in that of a real, an integer becomes a float."""
    if not (isinstance(place, Real) and isinstance(arm.type, Int)):
        return arm
    if isinstance(arm, Choice):
        arms = (_as_float(part, place) for part in (arm.then, arm.otherwise))
        return Choice(arm.test, *arms, type=place)
    return Builtin(FLOAT, (arm,), type=place)


def _tests(value: Expr) -> Iterator[Expr]:
    """The tests that choose what a value is."""
    if isinstance(value, Choice):
        yield from (value.test, *_tests(value.then), *_tests(value.otherwise))
