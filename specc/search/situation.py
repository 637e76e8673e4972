"""Situations of a subsystem in one period, and what its expressions are worth in them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

from specc.lang import Environment, evaluate
from specc.lang.kinds import first_value, kind
from specc.lang.values import Value, is_close
from specc.model import expr as m
from specc.model.expr import Expr, LazyByDependence, negation
from specc.model.fsm import mode_of
from specc.model.system import Subsystem, System
from specc.model.types import (
    Bool,
    Pose,
    Real,
    Type,
)
from specc.proof.verdict import InputName

# Exact comparisons of poses and vectors, which are refused but mean something.


def runnable(expr: m.Expr) -> m.Expr:
    """The expression with `a == b` of arrays as `near` with no tolerance, which can be run."""
    same = m.map_children(expr, runnable)
    if not isinstance(same, m.Compare) or not same.left.type.is_array:
        return same
    zeros = 2 if isinstance(same.left.type, Pose) else 1
    tolerances = (m.Number(0.0, type=Real()),) * zeros
    near = m.Builtin(m.NEAR, (same.left, same.right, *tolerances), type=Bool())
    return near if same.op == "==" else negation(near)


# What a subsystem sees and remembers in one period, and what expressions are worth then.


OperatorAnswer = tuple[str, tuple[Value, ...], Value]
"""An operator, its arguments and what it gives for them."""


LagKey = tuple[str, str, str]
"""`age` or `late`, peer and element of an input."""


def lag_key(lag: m.Lag) -> LagKey:
    """What a situation knows it by."""
    return lag.name, *lag.input.key


@dataclass(frozen=True, slots=True)
class Situation:
    """One period of a subsystem.

    `inputs` has something for every element; only those `present` are there. `answers` are what
    operators give, otherwise the first value of their type. `periods` counts from 0, the period
    in which the state was entered.
    """

    inputs: Mapping[InputName, Value]
    present: frozenset[InputName]
    fresh: frozenset[InputName] = frozenset()
    lags: Mapping[LagKey, Value] = field(default_factory=dict)
    """How far inputs lag; an input that is missing here does not lag."""
    live: Mapping[str, Value] = field(default_factory=dict)
    """Constants that may change; one that is missing here is as at the start."""
    memory: Mapping[str, Value] = field(default_factory=dict)
    periods: int = 0
    answers: tuple[OperatorAnswer, ...] = ()

    def answer(self, operator: str, args: tuple[Value, ...]) -> Value | None:
        """What an operator is known to give; None if nothing is said of it."""
        for name, known, result in self.answers:
            if name == operator and is_close(known, args):
                return result
        return None


NO_VALUE = (
    ArithmeticError, ValueError, LookupError, TypeError, AttributeError, RecursionError
)  # fmt: skip
"""What evaluating an expression raises that has no value: a root of -1, a part of None."""


class LazyValues(LazyByDependence[Value]):
    """Values by name, computed when they are first asked for; asking for one may raise NO_VALUE."""

    def __init__(self, named: Mapping[str, Expr], compute: Callable[[Expr], Value]) -> None:
        def attempt(name: str) -> Value:
            try:
                return compute(named[name])
            except NO_VALUE as error:
                return error

        super().__init__(named, attempt)

    def __getitem__(self, name: str) -> Value:
        value = super().__getitem__(name)
        if isinstance(value, NO_VALUE):
            raise value
        return value


def values_of_type(type_: Type, value: Value) -> Iterator[Value]:
    """The values of a type that a computed one stands for: itself, or rounded down and up.

    Solving `n * 2 == 5` for a whole number gives 2.5. There are none if a real is not finite or a
    nonempty list has no item.
    """
    for round_ in (math.floor, math.ceil):
        with suppress(*NO_VALUE):
            yield _of_type(type_, value, round_)
            if is_of_type(type_, value):
                return


def is_of_type(type_: Type, value: Value) -> bool:
    """Whether a value belongs to a type; of opaque values and poses nothing is asked."""

    def refuse(number: float) -> int:
        raise ValueError(number)

    try:
        _of_type(type_, value, refuse)
    except NO_VALUE:
        return False
    return True


def _of_type(type_: Type, value: Value, round_: Callable[[float], int]) -> Value:
    """The value with its whole numbers rounded; raises ValueError if it has not the type."""
    sort = kind(type_).sort
    if sort in ("whole", "real"):
        if isinstance(value, bool) or not math.isfinite(value):
            raise ValueError(value)
        return round_(value) if sort == "whole" and type(value) is not int else value
    if getattr(type_, "nonempty", False) and not value:
        raise ValueError(value)
    of = kind(type_).map_parts
    return of(type_, value, lambda part, item: _of_type(part, item, round_))


class Interpreter:
    """What the expressions of one subsystem mean."""

    def __init__(self, system: System, subsystem: Subsystem) -> None:
        self.subsystem = subsystem
        self.lets: dict[str, Expr] = {i.name: runnable(i.value) for i in subsystem.lets}
        declared = (*system.constants, *subsystem.constants)
        self.constants: dict[str, Expr] = {item.name: item.value for item in declared}
        self._live = {c.name: c.initial.value for c in system.constants if c.initial is not None}
        self._rate_hz = subsystem.rate_hz
        self.period_s = float(1 / subsystem.rate_hz)
        self.results = {operator.name: operator.result for operator in system.operators}
        self._files = dict(system.files)
        self.changing = subsystem.changing_memory
        self._last: tuple[Situation | None, bool, Environment] = (None, False, Environment())
        """What was asked about last, for its lets and constants."""

    def blank(self, number: float) -> Situation:
        """Every input has the first value of its type, where numbers are `number`; none came."""
        elements = self.subsystem.inputs.items()
        inputs = {name: first_value(element.type, number) for name, element in elements}
        return Situation(inputs, frozenset(inputs))

    def value(self, expr: Expr, at: Situation, *, strictly: bool = False) -> Value:
        """The value of an expression; raises what `evaluate` raises.

        `strictly`, an element that is not present has no value.
        """
        known, known_strictly, environment = self._last
        if known is not at or known_strictly is not strictly:
            environment = self._environment(at, strictly)
            self._last = at, strictly, environment
        return evaluate(expr, environment)

    def holds(self, expr: Expr, at: Situation) -> bool | None:
        """Whether a condition holds; None if it has no value."""
        try:
            return bool(self.value(expr, at))
        except NO_VALUE:
            return None

    def has_types(self, at: Situation) -> bool:
        """Whether everything in a situation is a value of its type."""
        subsystem = self.subsystem
        pairs = [(element.type, at.inputs[name]) for name, element in subsystem.inputs.items()]
        pairs += [(item.type, at.memory[item.name]) for item in subsystem.memory]
        pairs += [(self.results[name], result) for name, _, result in at.answers]
        return all(is_of_type(type_, value) for type_, value in pairs)

    def satisfies(self, goals: Iterable[tuple[Expr, bool]], at: Situation) -> bool:
        """Whether conditions hold or fail as they are to."""
        return all(self.holds(condition, at) is wanted for condition, wanted in goals)

    def _environment(self, at: Situation, strictly: bool) -> Environment:
        inputs = at.inputs
        if strictly:
            inputs = {name: value for name, value in inputs.items() if name in at.present}
        lags = {("age", *name): 0.0 for name in inputs} | {("late", *name): 0 for name in inputs}
        lags |= {key: value for key, value in at.lags.items() if key[1:] in inputs}
        clock = {
            "elapsed": float(at.periods / self._rate_hz),
            "entered": at.periods == 0,
            "period": self.period_s,
        }
        memory = at.memory
        if at.periods:
            # As for `entered` of the state, this is not a mode's first period any more.
            no_entry = {name: False for name in memory if mode_of("entered", name)}
            memory = {**memory, **no_entry} if no_entry else memory
        operators = {name: partial(self._call, at, name) for name in self.results}
        env = Environment(
            inputs=inputs,
            fresh=at.fresh,
            present=at.present,
            lags=lags,
            live={**self._live, **at.live},
            memory=memory,
            files=self._files,
            clock=clock,
            operators=operators,
        )
        constants = LazyValues(self.constants, lambda expr: evaluate(expr, known))
        known = replace(env, constants=constants)
        lets = LazyValues(self.lets, lambda expr: evaluate(expr, whole))
        whole = replace(known, lets=lets)
        return whole

    def _call(self, at: Situation, operator: str, *args: Value) -> Value:
        known = at.answer(operator, args)
        return first_value(self.results[operator]) if known is None else known


# What may be changed in a situation, and how inputs, memory and time are changed.


LONGEST = 100_000
"""Most periods that a search waits."""


@dataclass(frozen=True, slots=True)
class FreeVariables:
    """What a search may change.

    Attributes:
        memory: memory elements with these names.
        sure: inputs that are always there.
        time: how long the state has been running.
        unsent: inputs may change although nothing comes; otherwise only those of `devices` may.
        never: inputs that must not come.
        timers: memory that counts the periods together with the time in the state.
    """

    memory: frozenset[str]
    sure: frozenset[InputName]
    time: bool = True
    unsent: bool = True
    devices: frozenset[InputName] = frozenset()
    never: frozenset[InputName] = frozenset()
    timers: frozenset[str] = frozenset()

    def with_input(self, name: InputName, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value of an input."""
        inputs = {**at.inputs, name: value}
        if name in self.never:
            return
        if name in at.fresh or self.unsent or name in self.devices:
            yield replace(at, inputs=inputs, present=at.present | {name})
        if name not in at.fresh:
            came = at.fresh | {name}
            yield replace(at, inputs=inputs, present=at.present | {name}, fresh=came)

    def with_freshness(self, name: InputName, wanted: bool, at: Situation) -> Iterator[Situation]:
        """The situation in which an input is fresh, or is not."""
        if not wanted:
            yield replace(at, fresh=at.fresh - {name})
        elif name not in self.never:
            yield replace(at, fresh=at.fresh | {name}, present=at.present | {name})

    def with_presence(self, name: InputName, wanted: bool, at: Situation) -> Iterator[Situation]:
        """The situations in which an input has a value, or none yet."""
        if wanted and name not in self.never:
            yield from self.with_freshness(name, True, at)
            if self.unsent:
                yield replace(at, present=at.present | {name})
        if not wanted and name not in self.sure and self.unsent:
            yield replace(at, present=at.present - {name}, fresh=at.fresh - {name})

    def with_lag(self, lag: m.Lag, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation in which an input lags by `value` and has a value, if `value` >= 0."""
        if value >= 0:
            lags = {**at.lags, lag_key(lag): value}
            yield from self.with_presence(lag_key(lag)[1:], True, replace(at, lags=lags))

    def with_live(self, constant: m.Live, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value of a constant that may change, within its range."""
        nearest = min(max(value, constant.low), constant.high)
        yield replace(at, live={**at.live, constant.name: nearest})

    def with_memory(self, name: str, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value in memory."""
        if name in self.memory:
            yield replace(at, memory={**at.memory, name: value})
        elif name in self.timers:
            yield from self.wait(at.periods + value - at.memory[name], at)

    def wait(self, periods: int, at: Situation) -> Iterator[Situation]:
        """The situation some periods after the state was entered."""
        if self.time and 1 <= periods <= LONGEST:
            passed = periods - at.periods
            timed = {name: at.memory[name] + passed for name in self.timers}
            yield replace(at, periods=periods, memory={**at.memory, **timed})
