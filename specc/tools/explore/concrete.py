"""Search for measurements with which a run of the generated code follows a trace.

A run is rehearsed. Where a machine first leaves the trace, the run goes back by some periods, and
a sensor reports another value from there on. Runs that get further are kept and changed further.
So the result is a run that the code really makes, with the real operators.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise, product
from typing import Any, Protocol

from specc.lang.evaluate import Environment, evaluate
from specc.lang.kinds import first_value, kind, other_values
from specc.lower.module import buffer_names
from specc.model import expr as m
from specc.model.system import System
from specc.model.types import Opaque, OptionalOf, Type, Vector, nested_types
from specc.model.units import DIMENSIONLESS, Dimensions
from specc.model.wires import Wires
from specc.tools.explore.partial import KnownValues, is_literal, residual
from specc.tools.explore.trace import ExploredTrace

Reports = dict[str, list[tuple[int, Any]]]
"""For each sensor its reports, each with the base tick from which it holds; `...`: no new value."""
MOST_STEPS, TO_BEGIN = 1_000_000, 200
"""Of subsystems, in the rehearsals of one finding; for how many of them each one counts itself."""
MOST_MOMENTS, MOST_SENSORS = 8, 8
"""How long before a step reports are changed; of how many sensors that it depends on."""
MOST_SENT = 8
"""Values of its type that were sent before, and are tried too."""


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
        self._first = {n: b.initial.value for n, b in sporadic.items() if b.initial is not None}
        self._lost = {n: [b.on_loss.value] for n, b in sporadic.items() if b.on_loss is not None}
        self.silent = {n for n, b in sporadic.items() if b.max_gap_s is None or b.on_loss}
        """Sensors that may stay silent for any time."""
        nodes = list(_nodes(system))
        self._numbers = set(_numbers(nodes))
        self._vectors = dict.fromkeys(_vectors(nodes, system))
        self._values: dict[str, list[Any]] = {}

    def reports_of(self, sensor: str) -> list[Any]:
        """The values of a sensor, the usual one first; `...` for no new value."""
        return [*self.values_of(sensor), *((...,) if sensor in self.sporadic else ())]

    def values_of(self, sensor: str) -> list[Any]:
        """The values of a sensor without `...`."""
        if sensor not in self._values:
            type_ = self.types[sensor]
            first = self._first.get(sensor, first_value(type_))
            found = [
                first,
                *self._lost.get(sensor, ()),
                first_value(type_),
                *other_values(first_value(type_), type_),
            ]
            marks = self._marks(type_)
            found += [numbers for kind, numbers in self._vectors if kind == type_]
            found += [first_value(type_, mark) for mark in marks]
            made = [_plain(value, type_) for value in found]
            if isinstance(type_, OptionalOf):
                made += [_plain(first_value(type_.value, mark), type_) for mark in marks]
            distinct = [value for i, value in enumerate(made) if value not in made[:i]]
            self._values[sensor] = distinct[:MOST_VALUES]
        return self._values[sensor]

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
            has_lets = any(isinstance(part, m.LetRef) for part in m.walk(node))
            made = node if has_lets else residual(node, known)
            if is_literal(made):
                yield node.type, evaluate(made, Environment())


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


# Runs that follow a trace.


class Failure(Protocol):
    """The fault of a step that ended a run."""

    subsystem: str
    stamp: int
    is_assumption: bool
    message: str


class Rehearsal(Protocol):
    """The generated code of the system, which can be run many times."""

    sensors: Sequence[str]
    ticks: Mapping[str, int]
    tick_s: float

    def influences(self, subsystem: str) -> Sequence[str]:
        """The sensors whose values reach a subsystem, the nearest first."""

    def run(
        self, reports: Reports, ticks: int, goes_on: Any, since: Any, keep: Collection[int]
    ) -> tuple[Sequence[Failure], Mapping[int, Any]]:
        """Run up to a base tick; returns the faults that ended it earlier, and the kept moments.

        All faults are of one tick. `goes_on` is called for each step and says whether another tick
        follows. `keep` are base ticks at which the state of the run is kept. `since` is such a
        moment of an earlier run, from which this run starts; only later reports may differ.
        """


@dataclass(frozen=True, slots=True)
class Deviation:
    """The first deviation of a run from a trace: base tick, subsystem, description.

    `others` is the number of other deviations at the same tick. `sent` has the numbers and vectors
    that were sent before, by type, the latest first.
    """

    tick: int
    subsystem: str
    words: str
    others: int = 0
    sent: Mapping[Type, Sequence[Any]] = field(default_factory=dict)

    @property
    def reach(self) -> tuple[int, int]:
        """How far the run follows the trace, as a sort key."""
        return self.tick, -self.others


def find_reports(
    trace: ExploredTrace, system: System, rehearsal: Rehearsal, shared: int = 1
) -> Reports:
    """Find measurements with which a run follows a trace; so many traces share the steps.

    Raises:
        NotConcreteError: no such measurements were found.
    """
    values, most = SensorValues(system), MOST_STEPS // shared
    known: Reports = {name: [(0, values.reports_of(name)[0])] for name in rehearsal.sensors}
    for name in values.silent & known.keys():
        known[name].append((1, ...))
    expected = _Expected(trace, system, rehearsal)
    if expected.length > MOST_STEPS:
        raise NotConcreteError(f"its run would have more than {MOST_STEPS} steps of subsystems")
    stray = expected.deviation(known)
    if stray is None:
        return known
    candidates = list(_deviating_runs(known, stray, expected, values))
    furthest = candidates[0].deviation
    while candidates:
        if expected.steps >= most:
            raise NotConcreteError(f"{furthest.words}, as far as {most} steps reach")
        # Half of the trials go to the furthest run, the others to the one with the fewest trials.
        tried = [each for each in candidates if each.deviation is furthest]
        if expected.runs % 2 or not tried:
            tried = candidates
        each = min(tried, key=lambda one: one.spent)
        change = next(each.changes, None)
        if change is None:
            candidates.remove(each)
            continue
        since, changed = change
        before = expected.steps
        stray = expected.deviation(changed, since)
        each.spent += expected.steps - before
        if stray is None:
            return changed
        if stray.reach > each.deviation.reach:
            candidates += _deviating_runs(changed, stray, expected, values)
            if stray.reach >= furthest.reach:
                furthest = candidates[-1].deviation
    if rehearsal.influences(furthest.subsystem):
        raise NotConcreteError(f"{furthest.words}, whatever measurements were tried")
    raise NotConcreteError(f"{furthest.words}, and nothing that is measured changes that")


@dataclass(eq=False, slots=True)
class _DeviatingRun:
    """A run that leaves the trace, and the changes to try: a moment, and the reports from it."""

    deviation: Deviation
    changes: Iterator[tuple[Any, Reports]]
    spent: int = 0
    """Steps that its trials took."""


def _deviating_runs(
    known: Reports, stray: Deviation, expected: _Expected, values: SensorValues
) -> Iterator[_DeviatingRun]:
    """A run that leaves the trace, to be changed shortly before, or from the beginning."""
    rehearsal = expected.rehearsal
    periods = {rehearsal.ticks[stray.subsystem], min(rehearsal.ticks.values())}
    before = {n * period for n in range(MOST_MOMENTS) for period in periods}
    moments = [stray.tick - ago for ago in sorted(before) if ago < stray.tick]
    sensors = rehearsal.influences(stray.subsystem)[:MOST_SENSORS]
    # Once more from the beginning, to keep these moments and all sent values.
    stray = expected.deviation(known, keep=(0, *moments)) or stray
    snapshots = expected.snapshots
    for some in filter(None, (moments, [0])):
        pairs = product(enumerate(sensors), enumerate(some))
        ordered = sorted(pairs, key=lambda pair: pair[0][0] + pair[1][0])
        yield _DeviatingRun(
            stray,
            (
                (snapshots[moment], changed)
                for (_, sensor), (_, moment) in ordered
                for changed in _changes(known, moment, sensor, stray, values)
            ),
        )


class _Expected:
    """The expected steps of a trace. `snapshots` are those of the last run, by tick."""

    def __init__(self, trace: ExploredTrace, system: System, rehearsal: Rehearsal) -> None:
        self.rehearsal = rehearsal
        self.runs = self.steps = 0
        self.snapshots: Mapping[int, Any] = {}
        self._end = max(rehearsal.ticks[s.walker.name] * n for s, n in trace.with_stamps()) + 1
        self._steps = {(s.walker.name, n): s for s, n in trace.with_stamps()}
        wires = Wires(system.agents)
        self._bound = {
            (s.qualified_name, key): f"{wires.measuring_device(s.qualified_name, key[0])}.{key[1]}"
            for s in system.subsystems
            for key in s.inputs
        }
        self._types = {
            (s.qualified_name, name): present(s.outputs[output].type)
            for s in system.subsystems
            for output, name in buffer_names(s.outputs).items()
        }

    @property
    def length(self) -> int:
        """The steps of all subsystems in a run of that length."""
        return sum(self._end // ticks for ticks in self.rehearsal.ticks.values())

    def deviation(
        self, known: Reports, since: Any = None, keep: Collection[int] = ()
    ) -> Deviation | None:
        """The first deviation of a run, None without; `sent` counts from the start of the run."""
        found: list[Deviation] = []
        ticks = self.rehearsal.ticks
        self.runs += 1
        self.steps += TO_BEGIN
        sent: dict[Type, list[Any]] = {}

        def goes_on(name: str, stamp: int, state: str, row: int, values: Mapping[str, Any]) -> bool:
            self.steps += 1
            for element, value in values.items():
                before = sent.setdefault(self._types[name, element], [])
                if value in before:
                    before.remove(value)
                before.insert(0, value)
                del before[MOST_SENT:]
            step = self._steps.get((name, stamp))
            if step is not None and (state, row) != (step.transition.target, step.transition.row):
                words = f"at {stamp * ticks[name] * self.rehearsal.tick_s:g} s `{name}` "
                words += f"is in `{state}`, not in `{step.transition.target}`"
                found.append(Deviation(stamp * ticks[name], name, words))
            return not found

        failures, self.snapshots = self.rehearsal.run(known, self._end, goes_on, since, keep)
        broken = {key for key, step in self._steps.items() if step.transition.broken}
        is_expected = any(f.is_assumption and (f.subsystem, f.stamp) in broken for f in failures)
        if not is_expected:
            for failure in failures[:1]:
                tick = max(failure.stamp, 0) * ticks.get(failure.subsystem, 0)
                found.append(
                    Deviation(tick, failure.subsystem, f"the run fails: {failure.message}")
                )
        found += self._unseen_arrivals(known)
        if not found:
            return None
        first = min(found, key=lambda stray: stray.tick)
        others = sum(stray.tick == first.tick for stray in found) - 1
        return replace(first, others=others, sent=sent)

    def _unseen_arrivals(self, known: Reports) -> Iterator[Deviation]:
        """Deviations where a measurement should arrive unseen, but does not arrive."""
        for (name, stamp), step in self._steps.items():
            tick = stamp * self.rehearsal.ticks[name]
            for key, _ in step.transition.lost:
                reports = known.get(self._bound.get((name, key), ""), ())
                if [data for begin, data in reports if begin <= tick][-1:] == [...]:
                    yield Deviation(tick, name, f"`x.{key[0]}.{key[1]}` does not come then")


def _changes(
    known: Reports, moment: int, sensor: str, stray: Deviation, values: SensorValues
) -> Iterator[Reports]:
    """Reports in which one sensor reports other values from a moment on."""
    earlier = [each for each in known[sensor] if each[0] < moment]
    # Devices often come to report the values that they were commanded.
    commanded = stray.sent.get(present(values.types[sensor]), ())
    for value in (*commanded, *(values.reports_of(sensor) if moment else values.values_of(sensor))):
        if earlier[-1:] and earlier[-1][1] == value:
            continue
        rest = [(moment + 1, ...)] if sensor in values.silent and value is not ... else []
        yield {**known, sensor: [*earlier, (moment, value), *rest]}
