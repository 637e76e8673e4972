"""A situation with simpler values that shows the same."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from specc.example.situation import NO_VALUE, Meaning, Situation
from specc.example.values import Value
from specc.model import expr as m
from specc.proof import InputName

_SMALL = (1, -1, 2, -2, 3, -3, 5, -5, 10, -10)
_DIGITS = range(1, 10)


def tidied(
    found: Situation,
    start: Situation,
    about: Sequence[m.Expr],
    meaning: Meaning,
    shows: Callable[[Situation], bool],
) -> Situation:
    """The situation with what is `about` as at the start, sooner or rounded, if that `shows` it.

    Operators give the same for other arguments then.
    """
    calls = [leaf for leaf in about if isinstance(leaf, m.Call)]
    for node in (node for leaf in about for node in m.walk(leaf)):
        for simpler in _simpler(node, found, start):
            answered = _answered(calls, simpler, found, meaning)
            if shows(answered):
                found = answered
                break
    return found


def _answered(
    calls: Iterable[m.Call], at: Situation, before: Situation, meaning: Meaning
) -> Situation:
    """A situation in which operators give what they gave before."""
    for call in calls:
        try:
            args = tuple(meaning.value(arg, at) for arg in call.args)
            answer = call.operator, args, meaning.value(call, before)
        except NO_VALUE:
            continue
        if at.answer(*answer[:2]) is None:
            at = replace(at, answers=(*at.answers, answer))
    return at


def _simpler(node: m.Expr, at: Situation, start: Situation) -> Iterator[Situation]:
    match node:
        case m.Input(peer=peer, element=element):
            name: InputName = (peer, element)
            if name in at.fresh:
                yield replace(at, fresh=at.fresh - {name})
            for value in _plainer(at.inputs[name], start.inputs[name]):
                yield replace(at, inputs={**at.inputs, name: value})
        case m.MemoryRef(name=memory):
            for value in _plainer(at.memory[memory], start.memory[memory]):
                yield replace(at, memory={**at.memory, memory: value})
        case m.Clock(name="elapsed") if at.periods > 2:
            yield replace(at, periods=2)
            yield replace(at, periods=at.periods - 1)


def _plainer(value: Value, first: Value) -> Iterator[Value]:
    if repr(value) != repr(first):
        yield first
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            if value in _SMALL:
                yield from (type(value)(small) for small in _SMALL[: _SMALL.index(value)])
                return
            yield from map(type(value), _SMALL)
        for digits in _DIGITS:
            rounded = _rounded(value, digits)
            if repr(rounded) != repr(value):
                yield rounded


def _rounded(value: Value, digits: int) -> Value:
    """A value with so many digits of its real numbers; poses have to stay poses."""
    if isinstance(value, tuple) and not (value and isinstance(value[0], tuple)):
        return tuple(_rounded(item, digits) for item in value)
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value
