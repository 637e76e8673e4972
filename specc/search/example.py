"""Describes a situation in as few words as possible."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from specc.lang import show
from specc.lang.kinds import kind
from specc.lang.values import Fields, Value
from specc.model import expr as m
from specc.model.expr import LazyByDependence
from specc.model.fsm import mode_name, mode_of
from specc.model.types import (
    Bool,
    Pose,
    Text,
    Type,
    complete_type,
)
from specc.model.units import DIMENSIONLESS
from specc.proof.verdict import InputName
from specc.search.search import Goal, SearchBudget, find
from specc.search.situation import NO_VALUE, FreeVariables, Interpreter, Situation, lag_key

# What a witness is about: the inputs, memory, time and operators that its answers depend on.


def leaves(exprs: Iterable[m.Expr], lets: Mapping[str, m.Expr]) -> Iterator[m.Expr]:
    """The parts of expressions that a situation has values for, through lets, each once.

    Of a record its field; arguments of an operator do not count, its result does.
    """
    of_lets = LazyByDependence(
        lets, lambda name: tuple(dict.fromkeys(_leaves(lets[name], of_lets)))
    )
    return iter(dict.fromkeys(leaf for expr in exprs for leaf in _leaves(expr, of_lets)))


def _leaves(expr: m.Expr, of_lets: Mapping[str, Iterable[m.Expr]]) -> Iterator[m.Expr]:
    match expr:
        case m.Call():
            if not any(isinstance(node, m.BoundVariable) for node in m.walk(expr)):
                yield expr
        case m.LetRef(name=name) if name in of_lets:
            yield from of_lets[name]
        case m.FieldOf() if _is_path(expr):
            yield expr
        case m.Input() | m.MemoryRef() | m.Fresh() | m.Present() | m.Lag():
            yield expr
        case m.Clock(name="elapsed") | m.ConstantRef(is_live=True) | m.Live():
            yield expr
        case _:
            yield from (leaf for part in m.children(expr) for leaf in _leaves(part, of_lets))


def is_complete_answer(question: m.Expr) -> bool:
    """Whether the answer to a question determines the values it depends on."""
    match question:
        case m.Fresh() | m.Present():
            return True
        case m.IsOneOf(item=item, members=members):
            return len(members) == 1 and _is_path(item)
        case m.Compare(op="==", left=left, right=m.Member()):
            return _is_path(left)
    return isinstance(question.type, Bool) and (_is_path(question) or isinstance(question, m.Call))


def _is_path(expr: m.Expr) -> bool:
    """Whether an expression is an element of a buffer or memory, or a field of one."""
    while isinstance(expr, m.FieldOf):
        expr = expr.value
    return isinstance(expr, (m.Input, m.MemoryRef))


# A situation with simpler values that shows the same.


_SMALL = (1, -1, 2, -2, 3, -3, 5, -5, 10, -10)
_DIGITS = range(1, 10)


def simplify(
    found: Situation,
    start: Situation,
    about: Sequence[m.Expr],
    meaning: Interpreter,
    shows: Callable[[Situation], bool],
) -> Situation:
    """The situation with what is `about` as at the start, sooner or rounded, if that `shows` it.

    Operators give the same for other arguments then.
    """
    calls = [leaf for leaf in about if isinstance(leaf, m.Call)]
    for node in (node for leaf in about for node in m.walk(leaf)):
        for simpler in _simpler_situations(node, found, start):
            answered = _with_answers(calls, simpler, found, meaning)
            if shows(answered):
                found = answered
                break
    return found


def _with_answers(
    calls: Iterable[m.Call], at: Situation, before: Situation, meaning: Interpreter
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


def _simpler_situations(node: m.Expr, at: Situation, start: Situation) -> Iterator[Situation]:
    match node:
        case m.Input(key=name):
            if name in at.fresh:
                yield replace(at, fresh=at.fresh - {name})
            for value in _simpler_values(at.inputs[name], start.inputs[name]):
                yield replace(at, inputs={**at.inputs, name: value})
        case m.MemoryRef(name=memory):
            for value in _simpler_values(at.memory[memory], start.memory[memory]):
                yield replace(at, memory={**at.memory, memory: value})
        case m.Lag() if (key := lag_key(node)) in at.lags:
            for value in _simpler_values(at.lags[key], type(at.lags[key])(0)):
                if value >= 0:
                    yield replace(at, lags={**at.lags, key: value})
        case m.Clock(name="elapsed") if at.periods > 2:
            yield replace(at, periods=2)
            yield replace(at, periods=at.periods - 1)


def _simpler_values(value: Value, first: Value) -> Iterator[Value]:
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


# Values in the words of a specification, in SI units.


MOST_ITEMS, MOST_OTHERS = 8, 3


def value_text(value: Value, type_: Type) -> str | None:
    """`0.2 s`, `[u, u, g]`, `translation(0, 0, 1)`; None for what only operators look into."""
    if value is None:
        return "None"
    type_ = complete_type(type_)
    if isinstance(type_, Pose):
        return _pose(value)
    if type_.is_array:
        return _listed([number(item) for item in value]) + unit(type_)
    if kind(type_).sort != "other":
        return _scalar(value, type_)
    inside = kind(type_).map_parts(type_, value, lambda part, item: value_text(item, part))
    if isinstance(inside, tuple):
        return None if None in inside else _listed(inside)
    if isinstance(inside, Fields):
        known = [f"{name}: {text}" for name, text in inside if text is not None]
        return f"{{{', '.join(known)}}}" if known else None
    return inside if isinstance(inside, str) else None


def _scalar(value: Value, type_: Type) -> str:
    if isinstance(value, float) or type(value) is int:
        return number(value) + unit(type_)
    if isinstance(type_, Text):
        return repr(value)
    return str(value).lower() if isinstance(value, bool) else str(value)


def number(value: float) -> str:
    """A number as it is read back, without a needless fraction; `_` for a missing component."""
    if math.isnan(value):
        return "_"
    return repr(value).removesuffix(".0")


def unit(type_: Type) -> str:
    """The unit of all numbers of a value with a space before it; nothing for plain numbers."""
    alone = type_.units if len(type_.units) == 1 else ()
    return "".join(f" {unit.coherent()}" for unit in alone if unit != DIMENSIONLESS)


def _listed(items: Sequence[str]) -> str:
    """All items; of very many the usual one and those that differ, or the first ones."""
    if len(items) <= MOST_ITEMS:
        return f"[{', '.join(items)}]"
    usual = Counter(items).most_common(1)[0][0]
    others = [f"[{index}] = {item}" for index, item in enumerate(items) if item != usual]
    if len(others) <= MOST_OTHERS:
        return " and ".join([f"[{usual}, {usual}, ...]", *others])
    return f"[{', '.join(items[:MOST_ITEMS])}, ...]"


def _pose(rows: Value) -> str:
    match rows:
        case ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), _):
            moved = ", ".join(map(number, (x, y, z)))
            return f"translation({moved})" if any((x, y, z)) else "identity()"
    return _listed([_listed([number(item) for item in row]) for row in rows])


# Values that show a refutation, and how they are said.


@dataclass(frozen=True, slots=True)
class Example:
    """A situation that meets the goals, and the part of it that the witness is about."""

    situation: Situation
    text: str


def example(
    goals: Sequence[Goal],
    about: Sequence[m.Expr],
    meaning: Interpreter,
    start: Situation,
    freedom: FreeVariables,
    budget: SearchBudget,
) -> Example | None:
    """An example near `start` that meets the goals; None if none was found.

    It says what the questions `about` depend on and nothing else.
    """
    if budget.remaining <= 0:
        return None
    found = find(meaning, start, goals, freedom, budget)
    if found is None or not _meets_strictly(meaning, goals, found):
        return None
    parts = list(leaves(about, meaning.lets))
    found = simplify(found, start, parts, meaning, lambda at: _meets_strictly(meaning, goals, at))
    return Example(found, ", ".join(_describe(parts, meaning, found)))


def _meets_strictly(meaning: Interpreter, goals: Sequence[Goal], at: Situation) -> bool:
    """Whether the goals are met by values of their types, with nothing read that is not there."""
    try:
        holds = all(bool(meaning.value(e, at, strictly=True)) is yes for e, yes in goals)
        return holds and meaning.has_types(at)
    except NO_VALUE:
        return False


def _describe(about: Sequence[m.Expr], meaning: Interpreter, at: Situation) -> Iterator[str]:
    read = {leaf.key: leaf for leaf in about if isinstance(leaf, m.Input)}
    tested_for_freshness = {leaf.input.key for leaf in about if isinstance(leaf, m.Fresh)}
    for leaf in dict.fromkeys(_element(leaf, read) for leaf in about):
        match leaf:
            case m.Input():
                value = value_text(at.inputs[leaf.key], leaf.type) if leaf.key in read else None
                yield _describe_input(
                    leaf, value, at, with_freshness=leaf.key in tested_for_freshness
                )
            case m.MemoryRef(name=name) if time := _time_of_mode(name, meaning):
                yield f"`{show(time)}` = {value_text(meaning.value(time, at), time.type)}"
            case m.Clock():
                yield f"`elapsed` = {number(float(f'{at.periods * meaning.period_s:.9g}'))} s"
            case _:
                try:
                    text = value_text(meaning.value(leaf, at), leaf.type)
                except NO_VALUE:
                    continue  # without a value it does not matter
                yield f"`{show(leaf)}` = {text}" if text is not None else f"some `{show(leaf)}`"


def _time_of_mode(memory: str, meaning: Interpreter) -> m.Expr | None:
    """`elapsed(mode)`, if a memory element has the periods of the mode."""
    mode = mode_of("periods", memory)
    name = mode_name("elapsed", mode)
    time = meaning.lets.get(name) if mode else None
    return m.LetRef(name, type=time.type) if time else None


def _element(leaf: m.Expr, read: Mapping[InputName, m.Input]) -> m.Expr:
    """The element to describe: the value and the arrival of an input belong together."""
    if not isinstance(leaf, (m.Fresh, m.Present)):
        return leaf
    name = leaf.input.key
    return read.get(name, m.Input(*name, type=Bool()))


def _describe_input(
    element: m.Input, value: str | None, at: Situation, *, with_freshness: bool
) -> str:
    """An input with its value, if any; that it is not fresh only `with_freshness`."""
    name, shown = element.key, f"`{show(element)}`"
    if name not in at.present:
        return f"{shown} absent"
    if name in at.fresh:
        return f"{shown} fresh{f' = {value}' if value else ''}"
    if value:
        return f"{shown} = {value}{' (not fresh)' if with_freshness else ''}"
    return f"{shown} {'not fresh' if with_freshness else 'there'}"
