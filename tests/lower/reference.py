"""A slow work cycle by the book: conditions, rows and functions by `specc.lang.evaluate`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from specc.lang import Environment, evaluate
from specc.model.fsm import Behaviour
from specc.model.system import Subsystem

Key = tuple[str, str]


class Undecided(Exception):
    """Not exactly one row holds."""


class Lets(Mapping[str, Any]):
    """Values of lets, computed when they are first asked for."""

    def __init__(self, compute: Callable[[str], Any]) -> None:
        self._compute = compute
        self._known: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._known:
            self._known[name] = self._compute(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


NO_LAGS: Mapping[tuple[str, str, str], Any] = MappingProxyType({})


class Reference:
    """Executes the model of a subsystem."""

    def __init__(
        self,
        subsystem: Subsystem,
        constants: Mapping[str, Any],
        operators: Mapping[str, Callable[..., Any]],
    ) -> None:
        self.subsystem = subsystem
        self.constants = constants
        self.operators = operators
        self.state = ""
        self.memory: dict[str, Any] = {}
        self.periods = 0

    def step(
        self,
        inputs: Mapping[Key, Any],
        fresh: Collection[Key],
        lags: Mapping[tuple[str, str, str], Any] = NO_LAGS,
    ) -> tuple[int, dict[Key, Any]]:
        """Index of the transition, or -1, and the output elements written."""
        self._now = Environment(
            inputs=inputs,
            fresh=fresh,
            lags=lags,
            constants=self.constants,
            operators=self.operators,
        )
        row = -1
        if not self.state:
            self.state = self.subsystem.initial_state
            self.periods = 0
            self.memory = {
                item.name: evaluate(item.init, self._environment())
                for item in self.subsystem.memory
            }
        else:
            self.periods += 1
            row = self._decide(self.subsystem.state(self.state).behaviour)
        return row, self._run(self.subsystem.state(self.state).behaviour)

    def _environment(self) -> Environment:
        period = 1 / float(self.subsystem.rate_hz)
        clock = {
            "elapsed": float(self.periods / self.subsystem.rate_hz),
            "entered": self.periods == 0,
            "period": period,
        }
        env = replace(self._now, memory=self.memory, clock=clock)
        lets = Lets(lambda name: evaluate(self.subsystem.let(name).value, env))
        env = replace(env, lets=lets)
        return env

    def _decide(self, behaviour: Behaviour) -> int:
        env = self._environment()
        for cause, condition in behaviour.endings:
            if evaluate(condition.when, env):
                rows = [
                    index
                    for index, row in enumerate(self.subsystem.transitions)
                    if (row.source, row.cause) == (self.state, cause)
                    and evaluate(row.condition.when, env)
                ]
                if len(rows) != 1:
                    raise Undecided(rows)
                self.state = self.subsystem.transitions[rows[0]].target
                self.periods = 0
                return rows[0]
        return -1

    def _run(self, behaviour: Behaviour) -> dict[Key, Any]:
        env = self._environment()
        values = {(a.peer, a.name): evaluate(a.value, env) for a in behaviour.assignments}
        self.memory = self.memory | {n: v for (peer, n), v in values.items() if not peer}
        return {key: value for key, value in values.items() if key[0]}
