"""What the scene and the disturbances of a task name fits the model of the plant."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from fractions import Fraction
from itertools import chain, permutations
from math import ceil, gcd, inf
from operator import attrgetter, itemgetter

from specc.analysis import Facts
from specc.analysis.plant import FREE, coordinate, plant_kind, unit_of_coordinate
from specc.diagnostics import Diagnostic, Related, nearest, rename_fix, sole_correction
from specc.diagnostics.phrases import in_ms
from specc.lang import show
from specc.mjcf import Model
from specc.model.bindings import Binding
from specc.model.expr import Number
from specc.model.system import Constant
from specc.model.task import OF_ELEMENTS, Disturbance, Draw
from specc.model.types import Int, Real
from specc.model.units import DIMENSIONLESS
from specc.resolve.context import suggest
from specc.source import Place


def starts_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0502 for the start of an unknown joint, E0516 for an impossible one."""
    plant = facts.system.plant
    for start in facts.system.starts:
        if isinstance(facts.model, Model):
            yield from _placed(start, facts.model)
        elif plant is None or plant.is_panel:
            message = f"there is no plant that has a joint `{start.name}`"
            help = "say under `plant` which model there is, or leave the scene out"
            if plant or not facts.system.devices:  # else the plant is an open point
                yield Diagnostic("E0516", message, start.place, help=help)
        elif plant_kind(plant) == "python":
            message = f"`{start.name}` is for MuJoCo models; the plant in Python knows no joints"
            help = "let a class set the scene up: `scene: package.module:Class`"
            yield Diagnostic("E0516", message, start.place, help=help)


def _placed(draw: Draw, model: Model, *, relative: bool = False) -> Iterator[Diagnostic]:
    joint, which = coordinate(draw.name, model)
    unit = unit_of_coordinate(joint, which, model)
    kind = model.joint_kind(joint)
    place = replace(draw.place, part="value")
    if joint not in model.joints:
        if model.complete:
            yield _unknown(draw, joint, which, model)
    elif unit is None and kind:
        if kind == "free":
            words = f"a free joint has no coordinate `{which}`"
            hint = f"write {', '.join(f'`{joint}.{one}`' for one in FREE)}"
        elif kind == "ball":
            words = f"`{joint}` is a ball joint, which one number does not place"
            hint = "a scene places hinges, slides and free joints"
        else:
            words, hint = f"a {kind} joint has no coordinate `{which}`", f"write `{joint}`"
        yield Diagnostic("E0516", words, draw.place, help=hint)
    elif unit is not None and (given := draw.first_other_unit(unit)):
        message = f"`{draw.name}` is in {unit}, not in {given}"
        help = f"write a number with that unit, e.g. `0.3[{unit}]`"
        yield Diagnostic("E0516", message, place, help=help)
    elif (range := model.joint_range(joint)) and not relative:
        least, greatest = range
        for value, _ in draw.values:
            if not least - _ROUNDING <= value <= greatest + _ROUNDING:
                message = f"`{draw.name}` cannot be at {value:g} {unit}"
                help = f"the model limits it to {least:g} to {greatest:g} {unit}"
                yield Diagnostic("E0516", message, place, help=help)
                return
    elif range := model.joint_range(joint):
        least, greatest = range
        if all(abs(value) > greatest - least + _ROUNDING for value, _ in draw.values):
            message = f"`{draw.name}` cannot be shifted by {draw.values[0][0]:g} {unit}"
            help = f"the model limits it to {least:g} to {greatest:g} {unit}"
            yield Diagnostic("E0516", message, place, help=help)


_ROUNDING = 1e-5
"""As of limits that are in degrees, and positions in radians with a few digits."""


def _unknown(draw: Draw, joint: str, which: str, model: Model) -> Diagnostic:
    correction = sole_correction(joint, nearest(joint, model.joints))
    right = f"{correction}.{which}" if correction and which else correction
    message, help = f"the model has no joint `{joint}`", suggest(joint, list(model.joints))
    fix = rename_fix(draw.place, draw.name, right)
    return Diagnostic("E0502", message, draw.place, help=help, fix=fix)


# What happens while a run goes on.


def disturbances_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0502, E0516, E0517, for disturbances of unknown parts or beyond their limits.

    A plant in Python says itself what can happen to it.
    """
    model = facts.model
    for each in facts.system.disturbances:
        plant, subjects = facts.system.plant, {verb.subject for verb, _ in each.actions_on()}
        if plant is None or plant.is_panel:
            help = "say under `plant` what there is, or leave the disturbance out"
            on_plant = subjects - {"constant", *(OF_ELEMENTS if plant else ())}
            if on_plant and (plant or not facts.system.devices):  # else it is an open point
                yield Diagnostic("E0517", "there is no plant to disturb", each.place, help=help)
        elif isinstance(model, Model):
            for verb, action in each.actions_on():
                for draw in action.numbers if verb.subject in ("coordinate", "distance") else ():
                    yield from _placed(draw, model, relative=verb.subject == "distance")
                known = {"body": model.bodies, "joint": model.joints}.get(verb.subject)
                if known is not None and action.name not in known and model.complete:
                    message = f"the model has no {verb.subject} `{action.name}`"
                    help = suggest(action.name, sorted(known))
                    yield Diagnostic("E0502", message, action.place, help=help)


# Constants that disturbances adjust.


def adjustments_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0517 for a constant that may not change, or not so."""
    known = {constant.name: constant for constant in facts.system.constants}
    for each in facts.system.disturbances:
        for _, action in each.actions_on("constant"):
            constant = known.get(action.name)
            if constant is None or not action.numbers:
                continue  # reported where it is read
            if constant.bounds is None or constant.initial is None:
                message = f"`{action.name}` does not change while something runs"
                related = (Related(constant.place, "declared here"),)
                help = "declare it with a range and `live: true`"
                yield Diagnostic("E0517", message, action.place, related=related, help=help)
            elif fault := _adjustment_fault(constant, action.numbers[0]):
                place = replace(action.place, part="value")
                related = (Related(constant.place, "declared here"),)
                message = f"`{action.name}` {fault}"
                help = "write a number within its range, with its unit"
                yield Diagnostic("E0517", message, place, related=related, help=help)


def _adjustment_fault(constant: Constant, draw: Draw) -> str:
    """Why a constant cannot get a value; empty if it can."""
    assert constant.bounds is not None  # it may change
    type_, (low, high) = constant.value.type, constant.bounds
    unit = type_.unit if isinstance(type_, Real) else DIMENSIONLESS
    if (given := draw.first_other_unit(unit)) is not None:
        wanted = "without a unit" if unit == DIMENSIONLESS else f"in {unit}"
        return f"is {wanted}, not {'without a unit' if given == DIMENSIONLESS else f'in {given}'}"
    if any(not low <= value <= high for value, _ in draw.values):
        shown = " to ".join(show(Number(end, type=type_)) for end in (low, high))
        return f"does not get this value: its range is {shown}"
    if isinstance(type_, Int) and (draw.is_range or any(v % 1 for v, _ in draw.values)):
        return "is a whole number; one of several is `{one_of: [1, 2]}`"
    return ""


# Devices that are silent, which only sporadic ones may be, and for no longer than they say.


def silences_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0502 for the silence of an element that no device reports, E0517 for one without effect."""
    courses = facts.system.courses if facts.system.plant else ()
    yield from dict.fromkeys(one for course in courses for one in _silence_faults(course, facts))


def _silence_faults(course: Sequence[Disturbance], facts: Facts) -> Iterator[Diagnostic]:
    """Faults of the silences among disturbances of one run."""
    silences: defaultdict[str, list[tuple[Disturbance, Place]]] = defaultdict(list)
    for each in course:
        for _, action in each.actions_on("samples"):
            silences[action.name].append((each, action.place))
    for name, found in silences.items():
        if name in facts.reported:
            yield from _silent(name, found, facts.reported[name].binding, facts)
            continue
        for _, place in found:
            help = suggest(name, sorted(facts.reported))
            yield Diagnostic("E0502", f"no device reports `{name}`", place, help=help)


def _silent(
    name: str, found: list[tuple[Disturbance, Place]], binding: Binding, facts: Facts
) -> Iterator[Diagnostic]:
    related = (Related(binding.place, "bound here"),)
    if binding.panel:
        message = f"`{name}` always has a sample: the operator sets it"
        for _, place in found:
            help = "name an element of a sporadic device"
            yield Diagnostic("E0517", message, place, related=related, help=help)
    elif not binding.sporadic:
        message = f"`{name}` is not sporadic: without a sample a run would stop with a fault"
        help = "add `sporadic: true` to its binding, and say in the agent what happens then"
        for _, place in found:
            yield Diagnostic("E0517", message, place, related=related, help=help)
    elif binding.max_gap_s is not None and binding.on_loss is None:
        sampling = _Sampling(binding, facts)
        for row, longest in sampling.gaps(list(sampling.spans(found))):
            if longest is None or longest > binding.max_gap_s:
                without = "to the end of the run" if longest is None else f"for {in_ms(longest)}"
                message = f"`{name}` may have no sample {without}, which its `max_gap` excludes"
                odd = next((span for span in row if span.ticks is None), row[-1])
                others = tuple(Related(s.place, "silent too") for s in row if s is not odd)
                help = "make `lasts` shorter, or `max_gap` longer"
                yield Diagnostic("E0517", message, odd.place, "", (*related, *others), help)


_MOST_ORDERED = 6
"""Silences that wait and are tried in every order."""


class _Silence:
    """When a device is silent: from a tick between `first` and `last` on, for `ticks` of them.

    `last` is None where it waits for something, `ticks` to the end of the run.
    """

    def __init__(self, each: Disturbance, place: Place, tick: Fraction) -> None:
        begins = [ceil(_exact(value) / tick) for value, _ in each.at.values] if each.at else [0]
        self.first = min(begins)
        self.last = None if each.when else max(begins)
        lasts = (
            [ceil(_exact(value) / tick) for value, _ in each.duration.values]
            if each.duration
            else []
        )
        self.ticks = max(lasts, default=None)
        self.place = place


class _Sampling:
    """When a device is sampled: whenever one of its readers is stepped."""

    def __init__(self, binding: Binding, facts: Facts) -> None:
        self.tick = facts.rates.tick_s
        wires = facts.wires.wires_of_element(binding.device, "x", binding.element)
        readers = {wire.subsystem.qualified_name for wire in wires}
        periods = [1 / s.rate_hz for s in facts.rates.timed if s.qualified_name in readers]
        self._periods = [int(period / self.tick) for period in periods] or [1]
        self._grid = gcd(*self._periods)

    def spans(self, found: Sequence[tuple[Disturbance, Place]]) -> Iterator[_Silence]:
        """Yield all silences.

        Repeated ones are copied for each silence, since each may join two.

        Repetitions may begin at any time; two are one if there may be no sample between them.
        """
        for each, place in found:
            span = _Silence(each, place, self.tick)
            if each.every is None:
                yield span
                continue
            pause = int(_exact(min(value for value, _ in each.every.values)) / self.tick)
            span.last = None
            if span.ticks is not None and pause - span.ticks < min(self._periods):
                span.ticks = None
            yield from (copy(span) for _ in found)

    def gaps(self, spans: list[_Silence]) -> Iterator[tuple[list[_Silence], Fraction | None]]:
        """Groups of silences without a sample between them, with the longest time between samples.

        None lasts to the end of the run. Silences that wait may begin at any time from their first
        tick on; the longest possible group is given.
        """
        waiting = [span for span in spans if span.last is None]
        rows = self._rows(span for span in spans if span.last is not None)
        for row in [*rows, waiting]:
            if any(span.ticks is None for span in row):
                yield row, None
            elif row is not waiting:
                yield row, self._longest(row)
        if waiting and all(span.ticks is not None for span in spans):
            yield self._longest_waiting(waiting, rows)

    def _longest_waiting(
        self, waiting: list[_Silence], rows: list[list[_Silence]]
    ) -> tuple[list[_Silence], Fraction]:
        if len(waiting) > _MOST_ORDERED:  # no more than if all come one after the other
            row = [*chain(*rows), *waiting]
            return row, self._between(self._missed(row))
        later = [rows[start:] for start in range(len(rows) + 1)]
        found = [self._joined(order, rest) for order in permutations(waiting) for rest in later]
        joined = [(row, ticks) for row, ticks in found if not set(waiting).isdisjoint(row)]
        row, ticks = max(joined, key=itemgetter(1))
        return row, self._between(ticks)

    def _rows(self, timed: Iterable[_Silence]) -> list[list[_Silence]]:
        rows: list[list[_Silence]] = []
        for span in sorted(timed, key=attrgetter("first")):
            if rows and self._before(span.first) < _end(rows[-1]):
                rows[-1].append(span)
            else:
                rows.append([span])
        return rows

    def _longest(self, row: list[_Silence]) -> Fraction:
        gap = self._before(int(_end(row))) - max(0, self._before(row[0].first))
        longest = max(gap, 0) * self.tick
        if any(span.first != span.last for span in row):
            return min(longest, self._between(self._missed(row)))
        return longest

    def _joined(
        self, waiting: Sequence[_Silence], rows: Sequence[list[_Silence]]
    ) -> tuple[list[_Silence], int]:
        """Silences without a gap between them, and their total number of ticks.

        They begin with the first row, if any. Waiting ones follow in the given order, except those
        that cannot begin yet.
        """
        row, later = list(rows[0]) if rows else [], list(rows[1:])
        end = self._sampled(int(_end(row)) if row else max(span.first for span in waiting))
        parts = [self._extent(row)] if row else []
        begin = end - sum(parts)
        for span in waiting:
            if self._before(span.first) >= end:
                continue
            row.append(span)
            end += self._missed([span])
            parts.append(self._missed([span]))
            while later and self._before(later[0][0].first) < end:
                parts.append(self._extent(later[0]))
                end = max(end, min(end + parts[-1], self._sampled(int(_end(later[0])))))
                row += later.pop(0)
        is_drawn = any(span.last not in (None, span.first) for span in row)
        return row, sum(parts) if is_drawn else end - begin

    def _extent(self, row: list[_Silence]) -> int:
        """The most ticks without samples by silences that do not wait."""
        return min(self._missed(row), self._passed(row[0].first, int(_end(row))))

    def _missed(self, row: list[_Silence]) -> int:
        """Ticks without a sample, if no silences overlap."""
        return sum(
            self._passed(span.first, span.first + (span.ticks or 0))
            if span.first == span.last
            else self._sampled(span.ticks or 0)
            for span in row
        )

    def _passed(self, first: int, end: int) -> int:
        """Ticks from the first missing sample to the next one; that at time 0 always exists."""
        return self._sampled(end) - self._sampled(max(1, first))

    def _sampled(self, tick: int) -> int:
        """The first tick from this one on at which there may be a sample."""
        return -(-tick // self._grid) * self._grid

    def _between(self, missed: int) -> Fraction:
        return (missed + min(self._periods) - self._grid) * self.tick

    def _before(self, tick: int) -> int:
        """The last tick before this one at which there is a sample."""
        return max((tick - 1) // period * period for period in self._periods)


def _end(row: list[_Silence]) -> float:
    """The tick at which all silences are over at the latest."""
    return max(
        inf if span.ticks is None or span.last is None else span.last + span.ticks for span in row
    )


def _exact(seconds: float) -> Fraction:
    """The intended decimal number of seconds, to the resolution of run times."""
    return Fraction(seconds).limit_denominator(10**9)
