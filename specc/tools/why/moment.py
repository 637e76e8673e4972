"""Why a condition holds or not: the values behind it, taken from what a recording has of them.

What is not there, or not as exactly as it would have to be, is `NotKnown`; nothing is guessed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from operator import index
from pkgutil import resolve_name
from typing import Any

from specc.lang.evaluate import Environment, evaluate
from specc.lang.kinds import Sort, kind
from specc.lang.values import NotRecorded, Value
from specc.lower.module import LiveSlot, live_slots
from specc.model import expr as m
from specc.model.system import Subsystem, System
from specc.model.types import Bool, Int, OptionalOf, Real, Record, Type

_VARIANTS = 8
"""Ways in which what has single precision may have been something else."""
_ULP = 2.0**-23
_LEAVES = m.Input, m.MemoryRef, m.Clock, m.Fresh, m.Present, m.Lag, m.LetRef, m.ConstantRef
_MOST_ITEMS = 1_000_000
"""Of lists that are looked through for the conditions of a moment."""
_LONGEST_MESSAGE = 200


class NotKnown(Exception):
    """A value that cannot be had from the recording; the message says why."""


def value_of(type_: Type, data: Any) -> Value:
    """The value of data of a recording; raises NotKnown for data of another type."""
    value = kind(type_).decode(type_, data, value_of)
    if value is ...:
        raise NotKnown(f"what is recorded is no {type_}")
    return value


class _Lazy(dict[Any, Any]):
    """Values that are computed when they are first read."""

    def __init__(self, compute: Callable[[Any], Value]) -> None:
        super().__init__()
        self._compute = compute

    def __missing__(self, name: Any) -> Value:
        self[name] = value = self._compute(name)
        return value


class _Fresh(Collection[Any]):
    """The inputs that were fresh, as far as a condition asked."""

    def __init__(self, recorded: Mapping[str, Any]) -> None:
        self._recorded = recorded

    def __contains__(self, key: object) -> bool:
        name = ".".join(key) if isinstance(key, tuple) else ""
        if type(self._recorded.get(name)) is not bool:
            raise NotKnown("nothing asked then whether it is fresh")
        return bool(self._recorded[name])

    def __iter__(self) -> Iterator[Any]:
        return iter(())

    def __len__(self) -> int:
        return len(self._recorded)


class Moment:
    """What the conditions of a subsystem read in a step."""

    def __init__(
        self,
        system: System,
        subsystem: Subsystem,
        step: Mapping[str, Any],
        memory: Mapping[str, Any] | None,
        elapsed_s: float | None,
        *,
        is_exact: bool,
        array: Callable[[Value], Any] | None,
        folder: str = "",
    ) -> None:
        """`step` is what a message says; `memory` that of the step before; None: not known.

        `array` makes what operators take of a vector or a pose; None: none is called, and what
        they would give is not known. `folder` is that of the specification, from which its files
        are named.
        """
        self.subsystem = subsystem
        self._system, self._step, self._memory = system, step, memory
        self._elapsed_s, self._is_exact, self._array = elapsed_s, is_exact, array
        self._folder = folder
        self._counted = 0
        self._results: dict[tuple[str, str], Value] = {}
        """Of operators, by their names and arguments."""
        self.environment = self._environment(0)
        self._others: list[Environment] = []

    def value(self, expr: m.Expr, **bound: Value) -> Value:
        """Raises NotKnown."""
        found = self._value(expr, self.environment, bound)
        is_truth = isinstance(expr.type, Bool) and not self._is_exact
        if is_truth and any(
            isinstance(e, m.MemoryRef) and _is_array(e.type) for e in self.leaves(expr)
        ):
            self._others = self._others or [self._environment(k) for k in range(1, _VARIANTS + 1)]
            if any(self._value(expr, other, bound) != found for other in self._others):
                raise NotKnown("arrays of memory are recorded in single precision, too near to say")
        return found

    def truth(self, expr: m.Expr, **bound: Value) -> bool | None:
        """None where it is not known."""
        try:
            return bool(self.value(expr, **bound))
        except NotKnown:
            return None

    def _value(self, expr: m.Expr, env: Environment, bound: Mapping[str, Value]) -> Value:
        try:
            value = evaluate(expr, replace(env, bound=bound))
        except (NotKnown, RecursionError) as error:
            raise NotKnown(str(error) or "it is nested too deeply") from None
        except (KeyError, AttributeError, TypeError) as error:
            raise NotKnown("a part of it is not recorded") from error
        except (ArithmeticError, ValueError, LookupError) as error:
            raise NotKnown(f"it has no value: {error}") from error
        if isinstance(value, NotRecorded):
            raise NotKnown("it is not recorded")
        return value

    def leaves(self, expr: m.Expr) -> list[m.Expr]:
        """The inputs, memory, times, constants and names of parts that it reads, each once."""
        found: dict[m.Expr, None] = {}
        inside = [expr]
        while inside:
            node = inside.pop()
            if isinstance(node, _LEAVES):
                if node in found:
                    continue
                found[node] = None
            # Of `elapsed(mode)` the time is told, not the number of periods that is behind it.
            if isinstance(node, m.LetRef) and node.name.isidentifier():
                inside.append(self.subsystem.let(node.name).value)
            elif not isinstance(node, m.Fresh | m.Present | m.Lag):
                inside += reversed(list(m.children(node)))
        return list(found)

    def _environment(self, variant: int) -> Environment:
        """What was recorded, or another variant of what it may have been."""
        values = {c.name: c.value for c in (*self._system.constants, *self.subsystem.constants)}
        files = dict(self._system.files)
        operators = {o.name: self._operator(o) for o in self._system.operators}
        env = Environment(
            inputs=_Lazy(self._input),
            fresh=_Fresh(self._step["fresh"]),
            lags=_Lazy(self._lag),
            live=_Lazy(lambda name: self._live(live_slots(self._system, self.subsystem)[name])),
            present={key for key in self.subsystem.inputs if self._data_of(key) is not None},
            memory=_Lazy(lambda name: self._recorded_memory(name, variant)),
            lets=_Lazy(lambda name: evaluate(self.subsystem.let(name).value, env)),
            constants=_Lazy(lambda name: evaluate(values[name], env)),
            files=_Lazy(lambda name: os.path.join(self._folder, files[name])),
            clock=_Lazy(self._clock),
            operators=operators,
            count=self._count,
        )
        return env

    def _data_of(self, key: tuple[str, str]) -> list[Any] | None:
        """The data of an input, in a list; None where it has none."""
        peer = self._step["x"].get(key[0])
        return [peer[key[1]]] if isinstance(peer, dict) and key[1] in peer else None

    def _input(self, key: tuple[str, str]) -> Value:
        data = self._data_of(key)
        if data is None:
            raise NotKnown(f"x.{'.'.join(key)} has no value yet")
        return value_of(self.subsystem.inputs[key].type, data[0])

    def _lag(self, key: tuple[str, str, str]) -> Value:
        kind, peer, element = key
        lags = self._step.get(kind)
        data = lags.get(f"{peer}.{element}") if isinstance(lags, dict) else None
        if data is None:
            raise NotKnown(f"the {kind} of x.{peer}.{element} is not recorded")
        return value_of(Real() if kind == "age" else Int(), data)

    def _live(self, slot: LiveSlot) -> Value:
        group, name = slot.path
        data = self._step["x"].get(group)
        if not isinstance(data, dict) or name not in data:
            raise NotKnown(f"what {name} was then is not recorded")
        return value_of(slot.constant.value.type, data[name])

    def _recorded_memory(self, name: str, variant: int) -> Value:
        item = next(item for item in self.subsystem.memory if item.name == name)
        if self._memory is None or name not in self._memory:
            raise NotKnown(f"memory {name} is not recorded")
        value = value_of(item.type, self._memory[name])
        return _perturbed(value, variant) if variant and _is_array(item.type) else value

    def _clock(self, name: str) -> Value:
        rate_hz = self.subsystem.rate_hz
        if name == "period":
            return float(1 / rate_hz)
        if name == "entered":
            return False  # no condition is asked in the first period of a state
        if self._elapsed_s is None:
            raise NotKnown("since when it is in that state is not recorded")
        return float(round(self._elapsed_s * rate_hz) / rate_hz)

    def _count(self, items: int) -> None:
        self._counted += items
        if self._counted > _MOST_ITEMS:
            raise NotKnown("its lists are too long")

    def _operator(self, operator: Any) -> Callable[..., Value]:
        """An operator, which is pure: of the same arguments it is called once."""

        def call(*args: Value) -> Value:
            key = operator.name, repr(args)
            if key not in self._results:
                self._results[key] = self._result(operator, args)
            return self._results[key]

        return call

    def _result(self, operator: Any, args: tuple[Value, ...]) -> Value:
        """Raises NotKnown, for no value of its type too."""
        if self._array is None:
            raise NotKnown("operators are not called")
        types = [type_ for _, type_ in operator.parameters]
        try:
            given = [self._argument(t, v) for t, v in zip(types, args, strict=True)]
            return _from_operator(operator.result, resolve_name(operator.python)(*given))
        except NotKnown:
            raise
        except (Exception, SystemExit) as error:  # whatever the user's function raises
            raise NotKnown(f"{m.source_name(operator.name)} raised {_error_text(error)}") from error

    def _argument(self, type_: Type, value: Value) -> Any:
        """A value as operators take it."""
        if isinstance(value, NotRecorded):
            raise NotKnown("what an operator looks into is not recorded")
        if type_.is_array and self._array is not None:
            return self._array(value)
        if isinstance(type_, Real):
            return float(value)
        built = kind(type_).map_parts(type_, value, self._argument)
        python = type_.python if isinstance(type_, Record) else ""
        return resolve_name(python)(**vars(built)) if python else built


def _error_text(error: BaseException) -> str:
    """Class and message of an exception on one line, whatever its `__str__` does."""
    name = type(error).__name__
    try:
        message = " ".join(str(error).split())
    except Exception:  # noqa: BLE001  # that of the user's class
        message = ""
    return f"{name}: {message[:_LONGEST_MESSAGE]}" if message else name


def _from_operator(type_: Type, value: Any) -> Value:
    """A value that an operator gave."""
    if type_.is_array:
        return _tuples(value.tolist())
    convert = _CONVERT.get(kind(type_).sort)
    return convert(value) if convert else kind(type_).map_parts(type_, value, _from_operator)


def _truth(value: Any) -> bool:
    if type(value).__name__ not in ("bool", "bool_"):
        raise TypeError(f"{type(value).__name__} in place of a truth value")
    return bool(value)


_CONVERT: dict[Sort, Callable[[Any], Value]] = {"truth": _truth, "whole": index, "real": float}


def _tuples(items: Any) -> Value:
    return tuple(map(_tuples, items)) if isinstance(items, list) else float(items)


def _is_array(type_: Type) -> bool:
    """Whether its values in memory are rounded where the recording is not exact."""
    return (type_.value if isinstance(type_, OptionalOf) else type_).is_array


def _perturbed(value: Value, variant: int, place: int = 0) -> Value:
    """A value whose floats are off by rounding, each up or down as a variant has it."""
    if isinstance(value, tuple):
        return tuple([_perturbed(v, variant, 4 * place + i) for i, v in enumerate(value)])
    if not isinstance(value, float):
        return value
    is_up = variant + (place * variant * 2654435761 >> 7 if variant > 2 else 0)
    return value * (1 + (_ULP if is_up % 2 else -_ULP))
