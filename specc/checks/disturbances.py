"""Scenes and disturbances that do less than they say, alone or beside each other."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import combinations
from math import inf

from specc.analysis import Facts
from specc.analysis.rates import base_tick
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import ms
from specc.model.task import Disturbance, Draw
from specc.source import Place

_CODE = "W0519"


# What is drawn can come out in more than one way, and changes something.


def draws_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0519; numbers that constants decide are taken as intended, since these can be set."""
    task = facts.system.task
    for draw in task.starts if task else ():
        yield from _varies(draw)
    for each in task.disturbances if task else ():
        for draw in each.numbers:
            yield from _varies(draw)


def _varies(draw: Draw) -> Iterator[Diagnostic]:
    values = [value for value, _ in draw.values]
    if draw.between and values[0] == values[1]:
        message, help = f"`{draw.name}` is between two equal numbers", "write the number alone"
    elif not draw.between and len(draw.texts) > 1 and len(set(values)) < len(values):
        message, help = f"`{draw.name}` is one of several, of which two are equal", "name each once"
    else:
        return
    yield Diagnostic(_CODE, message, replace(draw.place, part="value"), help=help)


# A disturbance does something, and each thing once.


def disturbances_do(facts: Facts) -> Iterator[Diagnostic]:
    """W0519."""
    task = facts.system.task
    for each in task.disturbances if task else ():
        yield from _idle(each)
        yield from _repeated("blocked", each.blocked)
        yield from _repeated("silent", each.silent)
        yield from _exact(each)
        yield from _at_once(each)


def _idle(each: Disturbance) -> Iterator[Diagnostic]:
    if each.lasts and _is_zero(each.lasts):
        place = replace(each.lasts.place, part="value")
        help = "say for how long, or leave `lasts` out: it lasts to the end then"
        yield Diagnostic(_CODE, "this disturbance lasts no time", place, help=help)
    if each.probability and _is_zero(each.probability):
        place = replace(each.probability.place, part="value")
        help = "say how probable it is, or leave the disturbance out"
        yield Diagnostic(_CODE, "this disturbance never happens", place, help=help)
    for draw in each.shifts:
        if _is_zero(draw):
            place = replace(draw.place, part="value")
            help = "say how far it is moved from where it is"
            yield Diagnostic(_CODE, f"`{draw.name}` is shifted by nothing", place, help=help)
    for body, force, place in each.pushes:
        if force and all(map(_is_zero, force)):
            help = "say with which force, e.g. `[0, 0, 20[N]]`"
            yield Diagnostic(_CODE, f"`{body}` is pushed by no force", place, help=help)


def _is_zero(draw: Draw) -> bool:
    return _is(draw, 0)


def _is(draw: Draw, number: float) -> bool:
    return all(value == number for value, _ in draw.values)


def _exact(each: Disturbance) -> Iterator[Diagnostic]:
    """What is measured of an element is changed, and seen."""
    silent = dict(each.silent)
    of = (("scaled", each.scales, 1, "1"), ("biased", each.biases, 0, "nothing"))
    for word, errors, neutral, by in of:
        for element, draws, place in errors:
            if draws and all(_is(draw, neutral) for draw in draws):
                help = "say how wrong the measurement is, or leave it out"
                yield Diagnostic(_CODE, f"`{element}` is {word} by {by}", place, help=help)
            elif element in silent:
                related = (Related(silent[element], "silent at the same time"),)
                help = "leave one of the two out, or let it happen later"
                message = f"`{element}` is {word} and silent at once"
                yield Diagnostic(_CODE, message, place, "", related, help)


def _repeated(word: str, named: Iterable[tuple[str, Place]]) -> Iterator[Diagnostic]:
    first: dict[str, Place] = {}
    for name, place in named:
        if (earlier := first.setdefault(name, place)) is not place:
            message, related = f"`{name}` is {word} twice", (Related(earlier, "here already"),)
            yield Diagnostic(_CODE, message, place, "", related, "name it once")


def _at_once(each: Disturbance) -> Iterator[Diagnostic]:
    """What is moved is elsewhere, whatever it was shifted by, and what is blocked does not move."""
    done = {joint: (place, "blocked") for joint, place in each.blocked}
    for word, draws in (("moved", each.moves), ("shifted", each.shifts)):
        for draw in draws:
            name = draw.name if word == "moved" or draw.name in done else _joint(draw)
            place, other = done.setdefault(name, (draw.place, word))
            if other != word:
                related = (Related(place, f"{other} at the same time"),)
                help = "leave one of the two out, or let it happen later"
                message = f"`{draw.name}` is {word} and {other} at once"
                yield Diagnostic(_CODE, message, draw.place, "", related, help)


def _joint(draw: Draw) -> str:
    """The joint of a coordinate; one of a free joint is named with it."""
    return draw.name.partition(".")[0]


# A disturbance repeats at times at which something is stepped.


def repetitions_are_apart(facts: Facts) -> Iterator[Diagnostic]:
    """W0519."""
    task, timed = facts.system.task, facts.rates.timed
    repeated = [each.every for each in task.disturbances if each.every] if task else []
    if not repeated or not timed:
        return
    tick_s = base_tick(1 / s.rate_hz for s in timed)
    for every in repeated:
        if 0 < min(value for value, _ in every.values) < tick_s * _ROUNDING:
            message = f"a disturbance begins again after {ms(tick_s)} at the earliest"
            place = replace(every.place, part="value")
            note = "the plant is disturbed at ticks, which are that far apart"
            help = f"make `every` {ms(tick_s)} or longer"
            yield Diagnostic(_CODE, message, place, note, help=help)


_ROUNDING = 1 - Fraction(1, 10**9)  # values are rounded


# Two disturbances do not do the same at the same time.


def disturbances_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0519, where it is sure whenever what they wait for comes."""
    task = facts.system.task
    for one, other in combinations(task.disturbances if task else (), 2):
        for name, place, word, earlier in _both(one, other):
            yield Diagnostic(
                _CODE,
                f"`{name}` is {word} by another disturbance at this time",
                place,
                related=(Related(earlier, "the other one"),),
                help="delete one of the two, or let it happen at another time",
            )
            break


def _both(one: Disturbance, other: Disturbance) -> Iterator[tuple[str, Place, str, Place]]:
    for word, of in _LASTING.items():
        known = dict(of(one))
        if _overlap(one, other):
            yield from ((n, p, word, known[n]) for n, p in of(other) if n in known)
    for block, move in ((one, other), (other, one)):
        held = dict(block.blocked) if _happens_in(block, move) else {}
        for draw in move.moves:
            if _joint(draw) in held:
                yield draw.name, draw.place, "blocked", held[_joint(draw)]
    for word, draws in _MOVING.items() if _moment(one) == _moment(other) else ():
        places = {draw.name: draw.place for draw in draws(one)}
        for draw in draws(other):
            if draw.name in places:
                yield draw.name, draw.place, word, places[draw.name]


_LASTING: dict[str, Callable[[Disturbance], Iterable[tuple[str, Place]]]] = {
    "blocked": lambda each: each.blocked,
    "silent": lambda each: each.silent,
}
_MOVING: dict[str, Callable[[Disturbance], Iterable[Draw]]] = {
    "moved": lambda each: each.moves,
    "shifted": lambda each: each.shifts,
}


def _moment(each: Disturbance) -> Hashable:
    """When it begins: what its time and what it waits for are; no two intervals are the same."""
    if (each.at and each.at.between) or each.probability:
        return id(each)
    return each.when.that if each.when else "", each.at.values if each.at else ()


def _overlap(one: Disturbance, other: Disturbance) -> bool:
    """Whether there is surely a time at which both go on, of those that wait for nothing else."""
    if _moment(one) == _moment(other):
        return True
    first, second = _start(one), _start(other)
    if first is None or second is None:
        return False
    ends = first[0] + _least_s(one), second[0] + _least_s(other)
    return max(first[1], second[1]) < min(ends)


def _happens_in(lasting: Disturbance, moment: Disturbance) -> bool:
    """Whether one surely begins while the other one goes on."""
    if _moment(lasting) == _moment(moment):
        return True
    begun, at = _start(lasting), _start(moment)
    if begun is None or at is None:
        return False
    return begun[1] <= at[0] and at[1] < begun[0] + _least_s(lasting)


def _start(each: Disturbance) -> tuple[float, float] | None:
    """When it begins first, at the earliest and at the latest; None if that is not sure."""
    if each.when is not None or each.at is None or each.probability is not None:
        return None
    values = [value for value, _ in each.at.values]
    return min(values), max(values)


def _least_s(each: Disturbance) -> float:
    return min((value for value, _ in each.lasts.values), default=inf) if each.lasts else inf


CHECKS = (draws_vary, disturbances_do, repetitions_are_apart, disturbances_differ)
