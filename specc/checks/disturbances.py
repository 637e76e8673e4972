"""Scenes and disturbances do what they say, alone and beside each other."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import combinations, product
from math import ceil, inf

from specc.analysis import Facts
from specc.analysis.plant import BoundElement, raw_numbers
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import counted, in_ms
from specc.mjcf import Model
from specc.model.task import VERBS, Disturbance, DisturbanceAction, Draw, Verb
from specc.model.units import Unit
from specc.resolve.context import suggest
from specc.source import Place

_CODE = "W0519"


# What is drawn can come out in more than one way, and changes something.


def draws_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0519, for ranges and choices of equal numbers, unless constants decide them."""
    numbers = (number for each in facts.system.disturbances for number in each.numbers)
    for draw in (*facts.system.starts, *numbers):
        values, place = [value for value, _ in draw.values], replace(draw.place, part="value")
        if draw.is_range and values[0] == values[1]:
            message = f"`{draw.name}` is between two equal numbers"
            yield Diagnostic(_CODE, message, place, help="write the number alone")
        elif not draw.is_range and len(draw.texts) > 1 and len(set(values)) < len(values):
            message = f"`{draw.name}` is one of several, of which two are equal"
            yield Diagnostic(_CODE, message, place, help="name each once")


# A disturbance does something, and each thing once.


def disturbances_do(facts: Facts) -> Iterator[Diagnostic]:
    """W0519, for disturbances and actions without effect: in no time, never, or twice."""
    for each in facts.system.disturbances:
        if each.duration and _is_always(each.duration, 0):
            place = replace(each.duration.place, part="value")
            help = "say for how long, or leave `lasts` out: it lasts to the end then"
            yield Diagnostic(_CODE, "this disturbance lasts no time", place, help=help)
        if each.probability and _is_always(each.probability, 0):
            place = replace(each.probability.place, part="value")
            help = "say how probable it is, or leave the disturbance out"
            yield Diagnostic(_CODE, "this disturbance never happens", place, help=help)
        first: dict[tuple[str, str], Place] = {}
        for verb, action in each.actions_on():
            earlier = first.setdefault((verb.name, action.name), action.place)
            if earlier is not action.place:
                message = f"`{action.name}` is {verb.participle} twice"
                related = (Related(earlier, "here already"),)
                yield Diagnostic(_CODE, message, action.place, "", related, "name it once")
        done = {(action.verb, action.name): action for action in each.actions}
        for verb, action in each.actions_on():
            yield from _ineffective_action(verb, action, done)


_Done = dict[tuple[str, str], DisturbanceAction]
"""By verb and name."""


def _ineffective_action(verb: Verb, action: DisturbanceAction, done: _Done) -> Iterator[Diagnostic]:
    """An action without effect: by its numbers, or by another one on the same part."""
    neutral, by, way = verb.neutral or (None, "", "")
    if action.numbers and all(_is_always(draw, neutral) for draw in action.numbers):
        place = replace(action.place, part="value") if verb.numbers == "one" else action.place
        yield Diagnostic(_CODE, f"`{action.name}` is {verb.participle} {by}", place, help=way)
        return
    for spoils, other in _undoing_actions(verb, action, done):
        message = f"`{action.name}` is {verb.participle} and {spoils.participle} at once"
        related = (Related(other.place, f"{spoils.participle} at the same time"),)
        help = "leave one of the two out, or let it happen later"
        yield Diagnostic(_CODE, message, action.place, "", related, help)
        return


def _undoing_actions(
    verb: Verb, action: DisturbanceAction, done: _Done
) -> Iterator[tuple[Verb, DisturbanceAction]]:
    """Actions on the same part, or on its joint, that undo an action."""
    for spoils, name in product(verb.spoiled_by, (action.name, action.name.partition(".")[0])):
        if (spoils, name) in done:
            yield VERBS[spoils], done[spoils, name]


def _is_always(draw: Draw, number: float | None) -> bool:
    return all(value == number for value, _ in draw.values)


# A disturbance repeats at times at which something is stepped.


def repetitions_are_apart(facts: Facts) -> Iterator[Diagnostic]:
    """W0519, for a disturbance that may begin again within a tick."""
    tick_s = facts.rates.tick_s
    repeated = [each.every for each in facts.system.disturbances if each.every]
    for every in repeated if facts.rates.timed else ():
        if 0 < min(value for value, _ in every.values) < tick_s * _ROUNDING:
            message = f"a disturbance begins again after {in_ms(tick_s)} at the earliest"
            place = replace(every.place, part="value")
            note = "the plant is disturbed at ticks, which are that far apart"
            help = f"make `every` {in_ms(tick_s)} or longer"
            yield Diagnostic(_CODE, message, place, note, help=help)


_ROUNDING = 1 - Fraction(1, 10**9)  # values are rounded


# A disturbance begins and ends at ticks, and changes a measurement only when it is made.


def disturbances_last_ticks(facts: Facts) -> Iterator[Diagnostic]:
    """W0519, of those that last for less than a tick, or are over before anything is measured."""
    tick_s = facts.rates.tick_s
    timed = facts.rates.timed and facts.system.plant is not None
    for each in facts.system.disturbances if timed else ():
        if each.duration is None or _is_always(each.duration, 0):
            continue
        place = replace(each.duration.place, part="value")
        lasts_s = max(_exact(value) for value, _ in each.duration.values)
        is_short, help = lasts_s < tick_s * _ROUNDING, f"make `lasts` {in_ms(tick_s)} or longer"
        missed = [
            action
            for _, action in each.actions_on("samples", "measurement", "button")
            if action.has_duration and _is_never_measured(action, each, facts)
        ]
        for action in missed:
            message = f"this is over after {in_ms(lasts_s)}, before `{action.name}` is measured"
            related = (Related(action.place, "nothing is done to it"),)
            period_s = max(_periods_s(action.name, facts))
            longer = f"it is measured every {in_ms(period_s)}: make `lasts` as long, or longer"
            yield Diagnostic(_CODE, message, place, "it does nothing", related, longer)
            break
        if is_short and not missed:
            message = f"this lasts {in_ms(lasts_s)}, and acts for a whole tick of {in_ms(tick_s)}"
            yield Diagnostic(_CODE, message, place, "disturbances end at ticks", help=help)


def _is_never_measured(action: DisturbanceAction, each: Disturbance, facts: Facts) -> bool:
    """Whether an element is surely not measured from where a disturbance begins to its end."""
    fixed = each.when is None and each.every is None and each.at and len(each.at.values) == 1
    periods_s = _periods_s(action.name, facts)
    if not (fixed and each.at and each.duration and periods_s):
        return False
    tick_s = facts.rates.tick_s
    begins = ceil(_exact(each.at.values[0][0]) / tick_s)
    ends = begins + ceil(max(_exact(value) for value, _ in each.duration.values) / tick_s)
    return all(ceil(begins * tick_s / p) * p >= ends * tick_s for p in periods_s)


def _periods_s(element: str, facts: Facts) -> list[Fraction]:
    """Sample periods of an element of a device: its own, or those of its readers."""
    bound = facts.reported.get(element)
    if bound is None:
        return []
    if bound.binding.rate_hz:
        return [1 / bound.binding.rate_hz]
    wires = facts.wires.wires_of_element(bound.binding.device, "x", bound.element.name)
    return [1 / wire.subsystem.rate_hz for wire in wires]


def _exact(value: float) -> Fraction:
    return Fraction(value).limit_denominator(10**9)


# Two disturbances do not do the same at the same time.


def disturbances_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0519, where it is sure whenever what they wait for comes."""
    together = (pair for course in facts.system.courses for pair in combinations(course, 2))
    for one, other in dict.fromkeys(together):
        for action, word, earlier in _conflicting_actions(one, other):
            yield Diagnostic(
                _CODE,
                f"`{action.name}` is {word} by another disturbance at this time",
                action.place,
                related=(Related(earlier.place, "the other one"),),
                help="delete one of the two, or let it happen at another time",
            )
            break


def _conflicting_actions(
    one: Disturbance, other: Disturbance
) -> Iterator[tuple[DisturbanceAction, str, DisturbanceAction]]:
    """Yield each action that the other disturbance repeats or undoes, how, and by which action."""
    together, at_once = _overlap(one, other), _moment(one) == _moment(other)
    first, second = (
        {(action.verb, action.name): action for action in each.actions} for each in (one, other)
    )
    for verb, action in other.actions_on():
        # Forces and errors of measurement add up.
        same = (together and verb.numbers == "none") if action.has_duration else at_once
        if same and (action.verb, action.name) in first:
            yield action, verb.participle, first[action.verb, action.name]
    for going_on, done, moved in ((one, first, other), (other, second, one)):
        for verb, action in (
            moved.actions_on("coordinate") if _begins_during(going_on, moved) else ()
        ):
            yield from (
                (action, s.participle, d)
                for s, d in _undoing_actions(verb, action, done)
                if d.has_duration
            )


def _moment(each: Disturbance) -> Hashable:
    """A key of when it begins: its time and what it waits for; drawn times are unique."""
    times = [draw for draw in (each.at, each.delay) if draw is not None]
    if each.probability or any(draw.is_range for draw in times):
        return id(each)
    waits = each.when.that if each.when else ""
    return waits, tuple((draw.name, draw.values) for draw in times)


def _overlap(one: Disturbance, other: Disturbance) -> bool:
    """Whether there is surely a time at which both go on, of those that wait for nothing else."""
    if _moment(one) == _moment(other):
        return True
    first, second = _start(one), _start(other)
    if first is None or second is None:
        return False
    ends = first[0] + _least_s(one), second[0] + _least_s(other)
    return max(first[1], second[1]) < min(ends)


def _begins_during(going_on: Disturbance, moment: Disturbance) -> bool:
    """Whether one surely begins while the other one goes on."""
    if _moment(going_on) == _moment(moment):
        return True
    begun, at = _start(going_on), _start(moment)
    if begun is None or at is None:
        return False
    return begun[1] <= at[0] and at[1] < begun[0] + _least_s(going_on)


def _start(each: Disturbance) -> tuple[float, float] | None:
    """When it begins first, at the earliest and at the latest; None if that is not sure."""
    if each.when is not None or each.at is None or each.probability is not None:
        return None
    values = [value for value, _ in each.at.values]
    return min(values), max(values)


def _least_s(each: Disturbance) -> float:
    return min((value for value, _ in each.duration.values), default=inf) if each.duration else inf


# Errors of measurement fit the numbers that are measured.


Units = tuple[Unit | None, ...]
"""Of the numbers that are measured, None where the model does not say."""


def errors_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0502 for errors of an element that no device reports, E0517 for unsuitable numbers."""
    for each in facts.system.disturbances if facts.system.plant else ():
        for verb, action in each.actions_on("measurement"):
            element = action.name
            if (known := facts.reported.get(element)) is None:
                help = suggest(element, sorted(facts.reported))
                yield Diagnostic("E0502", f"no device reports `{element}`", action.place, help=help)
            elif (fault := _no_numbers(known)) is not None:
                related = (Related(known.binding.place, "bound here"),)
                message = f"`{element}` cannot be {verb.participle}: {fault}"
                help = "name an element of which numbers are measured"
                yield Diagnostic("E0517", message, action.place, related=related, help=help)
            elif verb.numbers != "none" and (units := _units(known, facts)) is not None:
                before = ", before its `through`," if known.binding.through else ""
                yield from _number_faults(verb, f"`{element}`{before}", action, units)


def _no_numbers(bound: BoundElement) -> str | None:
    """Why what is measured is not made of real numbers; None where it is."""
    if bound.binding.camera:
        return "a camera measures it"
    if bound.plant == "panel":
        return "the operator sets it"
    is_raw = bound.plant == "model" and bound.binding.through
    if is_raw or bound.units is not None:
        return None
    return f"it is `{bound.element.type}`"


def _units(bound: BoundElement, facts: Facts) -> Units | None:
    """Units of what is measured, before `through`; None if the number of values is unknown."""
    if not bound.binding.through:
        return bound.units
    if not isinstance(facts.model, Model):
        return None
    found: Units = ()
    for raw in raw_numbers(bound, facts.model):
        if raw.units is None:
            return None
        found += raw.units
    return found


def _number_faults(
    verb: Verb, subject: str, action: DisturbanceAction, units: Units
) -> Iterator[Diagnostic]:
    """Yield E0517 if numbers of an action differ in count or unit from those that are measured."""
    draws = action.numbers
    if len(draws) not in (1, len(units)):
        numbers = counted(len(units), "number")
        message = f"{numbers} of {subject} cannot be {verb.participle} by {len(draws)}"
        help = (
            "give one number for all, or one for each; one that is drawn is `[[least, greatest]]`"
        )
        yield Diagnostic("E0517", message, replace(action.place, part="value"), help=help)
        return
    is_one_for_all = len(draws) == 1 < len(units)
    for index, wanted in enumerate(() if verb.unit else units):
        draw = draws[0 if is_one_for_all else index]
        if wanted is not None and (given := draw.first_other_unit(wanted)):
            mixed = is_one_for_all and len(set(units)) > 1
            name = f"number {index} of {subject}" if len(units) > 1 else subject
            help = f"write a number with that unit, e.g. `0.1[{wanted}]`"
            help = "their units differ: give one number for each" if mixed else help
            place = replace(draw.place, part="value")
            yield Diagnostic("E0517", f"{name} is in {wanted}, not in {given}", place, help=help)
            return
