"""Values of sensors to try in the search for a run: few, one of each kind."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

from specc.lang.evaluate import Environment, evaluate
from specc.lang.kinds import first_value, kind, other_values
from specc.model import expr as m
from specc.model.system import System
from specc.model.types import (
    Opaque,
    OptionalOf,
    Type,
    Vector,
    nested_types,
)
from specc.model.units import DIMENSIONLESS, Dimensions
from specc.tools.explore.partial import KnownValues, is_literal, residual

MOST_VALUES = 16
"""Of one sensor."""


class NotConcreteError(Exception):
    """No run was found that follows the trace; the message says why."""


def present(type_: Type) -> Type:
    """The type without `optional`."""
    return type_.value if isinstance(type_, OptionalOf) else type_


class SensorValues:
    """Values of sensors to try, in the form of recordings."""

    def __init__(self, system: System) -> None:
        self.types = {f"{d.qualified_name}.{e.name}": e.type for d in system.devices for e in d.y}
        bindings = system.plant.bindings if system.plant else ()
        sporadic = {f"{b.device}.{b.element}": b for b in bindings if b.sporadic}
        self.sporadic = sporadic.keys()
        self.silent = {name for name, b in sporadic.items() if b.max_gap_s is None}
        """Sensors that may stay silent for any time."""
        nodes = list(_nodes(system))
        self._numbers = set(_numbers(nodes))
        self._vectors = dict.fromkeys(_vectors(nodes, system))
        self._known: dict[str, list[Any]] = {}

    def of(self, sensor: str) -> list[Any]:
        """The values of a sensor, the usual one first; `...` for no new value."""
        return [*self.given(sensor), *((...,) if sensor in self.sporadic else ())]

    def given(self, sensor: str) -> list[Any]:
        """The values of a sensor without `...`."""
        if sensor not in self._known:
            type_ = self.types[sensor]
            found = [first_value(type_), *other_values(first_value(type_), type_)]
            marks = self._marks(type_)
            found += [numbers for kind, numbers in self._vectors if kind == type_]
            found += [first_value(type_, mark) for mark in marks]
            made = [_plain(value, type_) for value in found]
            if isinstance(type_, OptionalOf):
                made += [_plain(first_value(type_.value, mark), type_) for mark in marks]
            kept = [value for i, value in enumerate(made) if value not in made[:i]]
            self._known[sensor] = kept[:MOST_VALUES]
        return self._known[sensor]

    def _marks(self, type_: Type) -> list[float]:
        """The numbers named in the units of a type, and numbers between and beyond, spread out."""
        units = set(_units(type_))
        marks = sorted({number for unit, number in self._numbers if unit in units} | {0.0})
        between = [(a + b) / 2 for a, b in pairwise(marks)]
        return [marks[-1] + 1, marks[0] - 1, *_spread(between), *_spread(marks)]


def _nodes(system: System) -> Iterator[m.Expr]:
    """The nodes of all expressions of a system."""
    exprs = [item.value for item in system.constants]
    for subsystem in system.subsystems:
        exprs += [condition.when for condition in subsystem.conditions]
        exprs += [item.value for item in subsystem.lets]
        exprs += [item.value for item in subsystem.constants]
        exprs += [item.value for state in subsystem.states for item in state.behaviour.assignments]
    for expr in exprs:
        yield from m.walk(expr)


def _numbers(nodes: Sequence[m.Expr]) -> Iterator[tuple[Dimensions, float]]:
    """The numbers among some nodes, with their units."""
    numbers = (node for node in nodes if isinstance(node, m.Number))
    yield from ((unit, float(n.value)) for n in numbers for unit in _units(n.type))


def _vectors(nodes: Sequence[m.Expr], system: System) -> Iterator[tuple[Type, Any]]:
    """The vectors among some nodes, points included, with their types."""
    known = KnownValues({}, {item.name: item.value for item in system.constants}, Fraction(1))
    for node in nodes:
        if isinstance(node, m.Items) and isinstance(node.type, Vector):
            made = node if _has_lets(node) else residual(node, known)
            if is_literal(made):
                yield node.type, evaluate(made, Environment())


def _has_lets(expr: m.Expr) -> bool:
    return any(isinstance(node, m.LetRef) for node in m.walk(expr))


def _units(type_: Type) -> Iterator[Dimensions]:
    """The units of the numbers in a value."""
    for part in nested_types([type_]):
        if not part.parts:
            yield from (unit.dimensions for unit in part.units or (DIMENSIONLESS,))


def _spread(numbers: Sequence[float]) -> Iterator[float]:
    """The numbers by bisection: the middle, then the middle of each half, and so on."""
    parts = [(0, len(numbers))]
    for begin, end in parts:
        if begin < end:
            middle = (begin + end) // 2
            yield numbers[middle]
            parts += [(begin, middle), (middle + 1, end)]


def _plain(value: Any, type_: Type) -> Any:
    """A value in the form of recordings."""
    if isinstance(type_, Opaque):
        raise NotConcreteError(f"a device reports a {type_}, which only operators look into")
    return kind(type_).data(type_, value, lambda part, item: _plain(item, part))
