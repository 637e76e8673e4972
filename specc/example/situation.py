"""What a subsystem sees and remembers in one period, and what expressions are worth then."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from specc.example.values import Value, alike, first_value
from specc.expr import Environment, evaluate
from specc.model.expr import Expr
from specc.model.system import Subsystem, System
from specc.proof import InputName

Answer = tuple[str, tuple[Value, ...], Value]
"""An operator, its arguments and what it gives for them."""


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
    memory: Mapping[str, Value] = field(default_factory=dict)
    periods: int = 0
    answers: tuple[Answer, ...] = ()

    def answer(self, operator: str, args: tuple[Value, ...]) -> Value | None:
        """What an operator is known to give; None if nothing is said of it."""
        for name, known, result in self.answers:
            if name == operator and alike(known, args):
                return result
        return None


NO_VALUE = (
    ArithmeticError, ValueError, LookupError, TypeError, AttributeError, RecursionError
)  # fmt: skip
"""What evaluating an expression raises that has no value: a root of -1, a part of None."""


class Values(Mapping[str, Value]):
    """Values by name, computed when they are first asked for."""

    def __init__(self, names: Mapping[str, Expr], compute: Callable[[Expr], Value]) -> None:
        self._names = names
        self._compute = compute
        self._known: dict[str, Value] = {}

    def __getitem__(self, name: str) -> Value:
        if name not in self._known:
            self._known[name] = self._compute(self._names[name])
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class Meaning:
    """What the expressions of one subsystem mean."""

    def __init__(self, system: System, subsystem: Subsystem) -> None:
        self.subsystem = subsystem
        self.lets: dict[str, Expr] = {item.name: item.value for item in subsystem.lets}
        declared = (*system.constants, *subsystem.constants)
        self.constants: dict[str, Expr] = {item.name: item.value for item in declared}
        self._rate_hz = subsystem.rate_hz
        self.period_s = float(1 / subsystem.rate_hz)
        self.results = {operator.name: operator.result for operator in system.operators}
        self._files = dict(system.files)
        self._last: tuple[Situation | None, bool, Environment] = (None, False, Environment())
        """What was asked about last, for its lets and constants."""

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

    def meets(self, goals: Iterable[tuple[Expr, bool]], at: Situation) -> bool:
        """Whether conditions hold or fail as they are to."""
        return all(self.holds(condition, at) is wanted for condition, wanted in goals)

    def _environment(self, at: Situation, strictly: bool) -> Environment:
        inputs = at.inputs
        if strictly:
            inputs = {name: value for name, value in inputs.items() if name in at.present}
        clock = {
            "elapsed": float(at.periods / self._rate_hz),
            "entered": at.periods == 0,
            "period": self.period_s,
        }
        operators = {name: partial(self._call, at, name) for name in self.results}
        env = Environment(
            inputs=inputs,
            fresh=at.fresh,
            present=at.present,
            memory=at.memory,
            files=self._files,
            clock=clock,
            operators=operators,
        )
        constants = Values(self.constants, lambda expr: evaluate(expr, known))
        known = replace(env, constants=constants)
        lets = Values(self.lets, lambda expr: evaluate(expr, whole))
        whole = replace(known, lets=lets)
        return whole

    def _call(self, at: Situation, operator: str, *args: Value) -> Value:
        known = at.answer(operator, args)
        return first_value(self.results[operator]) if known is None else known
