"""Making a trace a run of the generated code: what devices report so that it goes that way.

A run is rehearsed from its beginning. Where a machine first does something else, a sensor is made
to report another value some periods before; runs that get further are kept, and changed further. So
nothing is taken for true that the code does not do, and what only operators decide is decided by
them.
"""

from __future__ import annotations

import time
from bisect import insort
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise, product
from typing import Any, Protocol

from specc.lang.evaluate import Environment, evaluate
from specc.lower.module import buffer_names
from specc.model import expr as m
from specc.model.system import System
from specc.model.types import (
    Bool,
    Image,
    Int,
    ListOf,
    Opaque,
    OptionalOf,
    Pose,
    Real,
    Record,
    Spatial,
    Type,
    Vector,
    whole,
)
from specc.model.units import Dimensions
from specc.proof.search import first_value, others
from specc.tools.explore.partial import Known, filled, is_literal
from specc.tools.explore.trace import Step, Trace

Reports = dict[str, list[tuple[int, Any]]]
"""Of each sensor what it reports from which base tick on; `...` is nothing new."""
MOST_RUNS = 2000
"""Rehearsals of one trace."""
MOST_S = 20
"""Processor time after which no other is begun: operators take what they take."""
MOST_VALUES, MOST_MOMENTS, MOST_SENSORS = 16, 8, 8
"""Of a sensor that are tried; how long before a step; how many that it depends on."""
MOST_SENT = 8
"""Values of its type that were sent before, and are tried too."""


class Failure(Protocol):
    """What ended a run: a fault of a step."""

    subsystem: str
    stamp: int
    is_assumption: bool
    message: str


class Rehearsal(Protocol):
    """The generated code of the system, which runs as often as it is asked to."""

    sensors: Sequence[str]
    ticks: Mapping[str, int]
    tick_s: float

    def influences(self, subsystem: str) -> Sequence[str]:
        """The sensors that a subsystem gets values of, the nearest first."""

    def run(self, reports: Reports, ticks: int, goes_on: Any) -> Sequence[Failure]:
        """A run of so many base ticks, and what ended it earlier: nothing, or all at one time.

        `goes_on` is told of each step, and says whether another tick follows.
        """


@dataclass(frozen=True, slots=True)
class Stray:
    """Where a run first does something else than a trace: base tick, subsystem, in words.

    `others` are the subsystems that stray at the same tick; `sent` has the numbers and vectors that
    were sent before, by their type, the latest first.
    """

    tick: int
    subsystem: str
    words: str
    others: int = 0
    sent: Mapping[Type, Sequence[Any]] = field(default_factory=dict)

    @property
    def reach(self) -> tuple[int, int]:
        """How far the run goes with the trace."""
        return self.tick, -self.others


class NotConcreteError(Exception):
    """No run that goes as the trace was found; the message says why."""


def reports(way: Trace, system: System, rehearsal: Rehearsal) -> Reports:
    """What sensors report so that a run takes a trace.

    Raises:
        NotConcreteError: nothing was found that makes it.
    """
    values = _Values(system)
    known: Reports = {name: [(0, values.of(name)[0])] for name in rehearsal.sensors}
    for name in values.silent & known.keys():
        known[name].append((1, ...))
    expected = _Expected(way, system, rehearsal)
    first = expected.stray(known)
    if first is None:
        return known
    ends_s = time.process_time() + MOST_S
    ways = [(first, _changed(known, first, rehearsal, values))]
    for run in range(MOST_RUNS):
        # Half of the runs for the one that gets furthest, half for those that it came from.
        each = ways[-1] if run % 2 else ways[run // 2 % len(ways)]
        changed = next(each[1], None)
        if changed is None:
            ways.remove(each)
            if not ways:
                break
            continue
        if time.process_time() > ends_s:
            raise NotConcreteError(f"{ways[-1][0].words}, as far as {MOST_S} s reach")
        stray = expected.stray(changed)
        if stray is None:
            return changed
        if stray.reach > each[0].reach:
            further = stray, _changed(changed, stray, rehearsal, values)
            insort(ways, further, key=lambda one: one[0].reach)
    raise NotConcreteError(_why(first, rehearsal))


def _why(stray: Stray, rehearsal: Rehearsal) -> str:
    if not rehearsal.influences(stray.subsystem):
        return f"{stray.words}, and nothing that is measured changes that"
    return f"{stray.words}, whatever measurements were tried"


class _Expected:
    """What the machines of a trace do."""

    def __init__(self, way: Trace, system: System, rehearsal: Rehearsal) -> None:
        self._rehearsal = rehearsal
        self._end = max(rehearsal.ticks[s.walker.name] * n for s, n in _numbered(way)) + 1
        self._steps = {(s.walker.name, n): s for s, n in _numbered(way)}
        self._bound = {
            (s.qualified_name, (p.peer, e.name)): f"{p.other_end}.{e.name}"
            for s in system.subsystems
            for p in s.ports
            if p.direction == "x"
            for e in p.elements
        }
        self._types = {
            (s.qualified_name, name): _present(s.outputs[output].type)
            for s in system.subsystems
            for output, name in buffer_names(s.outputs).items()
        }

    def stray(self, known: Reports) -> Stray | None:
        """Where a run first leaves the trace."""
        found: list[Stray] = []
        ticks = self._rehearsal.ticks
        sent: dict[Type, list[Any]] = {}

        def goes_on(name: str, stamp: int, state: str, row: int, values: Mapping[str, Any]) -> bool:
            for element, value in values.items():
                before = sent.setdefault(self._types[name, element], [])
                if value in before:
                    before.remove(value)
                before.insert(0, value)
            step = self._steps.get((name, stamp))
            if step is not None and (state, row) != (step.move.target, step.move.row):
                words = f"at {stamp * ticks[name] * self._rehearsal.tick_s:g} s `{name}` "
                words += f"is in `{state}`, not in `{step.move.target}`"
                found.append(Stray(stamp * ticks[name], name, words))
            return not found

        failures = self._rehearsal.run(known, self._end, goes_on)
        if not any(map(self._is_meant, failures)):
            for failure in failures[:1]:
                tick = max(failure.stamp, 0) * ticks.get(failure.subsystem, 0)
                found.append(Stray(tick, failure.subsystem, f"the run fails: {failure.message}"))
        found += self._unlost(known)
        if not found:
            return None
        first = min(found, key=lambda stray: stray.tick)
        others = sum(stray.tick == first.tick for stray in found) - 1
        return replace(first, others=others, sent=sent)

    def _is_meant(self, failure: Failure) -> bool:
        step = self._steps.get((failure.subsystem, failure.stamp))
        return failure.is_assumption and step is not None and bool(step.move.broken)

    def _unlost(self, known: Reports) -> Iterator[Stray]:
        """Measurements that were to come when nobody looks at them, and did not."""
        for (name, stamp), step in self._steps.items():
            tick = stamp * self._rehearsal.ticks[name]
            for key in step.move.lost:
                said = known.get(self._bound.get((name, key), ""), ())
                if [data for begin, data in said if begin <= tick][-1:] == [...]:
                    yield Stray(tick, name, f"`x.{key[0]}.{key[1]}` does not come then")


def _present(type_: Type) -> Type:
    """The type of a value that is there."""
    return type_.value if isinstance(type_, OptionalOf) else type_


def _numbered(way: Trace) -> Iterator[tuple[Step, int]]:
    """The steps with their time stamps."""
    stamps: Counter[str] = Counter()
    for step in way.steps:
        yield step, stamps[step.walker.name]
        stamps[step.walker.name] += 1


def _changed(
    known: Reports, stray: Stray, rehearsal: Rehearsal, values: _Values
) -> Iterator[Reports]:
    """Other reports that may change a step: at that step, from the beginning on, or in between."""
    sensors = rehearsal.influences(stray.subsystem)[:MOST_SENSORS]
    periods = sorted({rehearsal.ticks[stray.subsystem], min(rehearsal.ticks.values())})
    before = {n * period for n in range(MOST_MOMENTS) for period in periods}
    last, *earlier = [stray.tick - ago for ago in sorted(before) if ago <= stray.tick]
    moments = dict.fromkeys((last, 0, *earlier))
    for moment, sensor in product(moments, sensors):
        said = [each for each in known[sensor] if each[0] < moment]
        # Devices may well come to report what was asked of them.
        asked = stray.sent.get(_present(values.types[sensor]), ())[:MOST_SENT]
        for value in (*asked, *(values.of(sensor) if moment else values.given(sensor))):
            if said[-1:] and said[-1][1] == value:
                continue
            rest = [(moment + 1, ...)] if sensor in values.silent and value is not ... else []
            yield {**known, sensor: [*said, (moment, value), *rest]}


class _Values:
    """Values of sensors that are worth trying, in the form of recordings."""

    def __init__(self, system: System) -> None:
        self.types = {f"{d.qualified_name}.{e.name}": e.type for d in system.devices for e in d.y}
        bindings = system.plant.bindings if system.plant else ()
        sporadic = {f"{b.device}.{b.element}": b for b in bindings if b.sporadic}
        self.sporadic = sporadic.keys()
        self.silent = {name for name, b in sporadic.items() if b.max_gap_s is None}
        """Those that need not report anything for as long as one likes."""
        nodes = list(_nodes(system))
        self._numbers = set(_numbers(nodes))
        self._vectors = dict.fromkeys(_vectors(nodes, system))
        self._known: dict[str, list[Any]] = {}

    def of(self, sensor: str) -> list[Any]:
        """Those of a sensor, the usual one first; `...` for nothing new."""
        return [*self.given(sensor), *((...,) if sensor in self.sporadic else ())]

    def given(self, sensor: str) -> list[Any]:
        """Those with a value."""
        if sensor not in self._known:
            type_ = self.types[sensor]
            found = [first_value(type_), *others(first_value(type_), type_)]
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
        """Numbers of the units of a type that are named, those between and beyond, far apart."""
        units = set(_units(type_))
        marks = sorted({number for unit, number in self._numbers if unit in units} | {0.0})
        between = [(a + b) / 2 for a, b in pairwise(marks)]
        return [marks[-1] + 1, marks[0] - 1, *_spread(between), *_spread(marks)]


def _nodes(system: System) -> Iterator[m.Expr]:
    """The parts of what a system asks and computes."""
    exprs = [item.value for item in system.constants]
    for subsystem in system.subsystems:
        exprs += [condition.when for condition in subsystem.conditions]
        exprs += [item.value for item in subsystem.lets]
        exprs += [item.value for item in subsystem.constants]
        exprs += [item.value for state in subsystem.states for item in state.behaviour.assignments]
    for expr in exprs:
        yield from m.walk(expr)


def _numbers(nodes: Sequence[m.Expr]) -> Iterator[tuple[Dimensions, float]]:
    """The numbers among them, with their units."""
    numbers = (node for node in nodes if isinstance(node, m.Number))
    yield from ((unit, float(n.value)) for n in numbers for unit in _units(n.type))


def _vectors(nodes: Sequence[m.Expr], system: System) -> Iterator[tuple[Type, Any]]:
    """The vectors among them, such as points, with their types."""
    known = Known({}, {item.name: item.value for item in system.constants}, Fraction(1))
    for node in nodes:
        if isinstance(node, m.Items) and isinstance(node.type, Vector):
            made = node if _has_lets(node) else filled(node, known)
            if is_literal(made):
                yield node.type, evaluate(made, Environment())


def _has_lets(expr: m.Expr) -> bool:
    return any(isinstance(node, m.LetRef) for node in m.walk(expr))


def _units(type_: Type) -> Iterator[Dimensions]:
    """The units of the numbers in a value."""
    match whole(type_):
        case Real(unit=unit):
            yield unit.dimensions
        case Spatial(linear=linear, angular=angular):
            yield from (linear.dimensions, angular.dimensions)
        case Vector(element=inner) | ListOf(element=inner) | OptionalOf(value=inner):
            yield from _units(inner)
        case Record(fields=fields):
            for _, inner in fields:
                yield from _units(inner)
        case _:
            yield ()


def _spread(numbers: Sequence[float]) -> Iterator[float]:
    """The one in the middle, then those in the middle of each half, and so on."""
    parts = [(0, len(numbers))]
    for begin, end in parts:
        if begin < end:
            middle = (begin + end) // 2
            yield numbers[middle]
            parts += [(begin, middle), (middle + 1, end)]


def _plain(value: Any, type_: Type) -> Any:
    """A value in the form that recordings have it in."""
    match whole(type_):
        case Pose():
            return [float(number) for row in value for number in row]
        case Spatial():
            return [float(number) for number in value]
        case Vector(element=element) | ListOf(element=element):
            return [_plain(item, element) for item in value]
        case OptionalOf(value=inner):
            return None if value is None else _plain(value, inner)
        case Record(fields=fields):
            return {name: _plain(getattr(value, name), inner) for name, inner in fields}
        case Image(height=height, width=width, channels=channels):
            return [height, width, channels] if channels == 3 else [height, width]
        case Opaque():
            raise NotConcreteError(f"a device reports a {type_}, which only operators look into")
    return _NUMBERS.get(type(whole(type_)), str)(value)


_NUMBERS: dict[type[Type], Callable[[Any], Any]] = {Real: float, Int: int, Bool: bool}
