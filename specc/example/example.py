"""Values that show a refutation, and how they are said."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from specc.example.freedom import Freedom
from specc.example.leaves import leaves
from specc.example.patience import Patience
from specc.example.search import Goal, find
from specc.example.situation import NO_VALUE, Meaning, Situation
from specc.example.tidy import tidied
from specc.example.words import number, worded
from specc.expr import show
from specc.model import expr as m
from specc.model.types import Bool
from specc.proof import InputName


@dataclass(frozen=True, slots=True)
class Wanted:
    """What an example is asked for.

    Attributes:
        goals: what must hold or fail.
        about: the questions of the witness; nothing else is said.
    """

    goals: tuple[Goal, ...]
    about: tuple[m.Expr, ...]


@dataclass(frozen=True, slots=True)
class Example:
    """A situation that meets the goals, and the part of it that the witness is about."""

    situation: Situation
    text: str


def example(
    wanted: Wanted, meaning: Meaning, start: Situation, freedom: Freedom, patience: Patience
) -> Example | None:
    """An example near `start`; None if none was found."""
    if patience.left <= 0:
        return None
    found = find(meaning, start, wanted.goals, freedom, patience)
    if found is None or not _shows(meaning, wanted.goals, found):
        return None
    about = list(leaves(wanted.about, meaning.lets))
    found = tidied(found, start, about, meaning, lambda at: _shows(meaning, wanted.goals, at))
    return Example(found, ", ".join(_said(about, meaning, found)))


def _shows(meaning: Meaning, goals: Sequence[Goal], at: Situation) -> bool:
    """Whether the goals are met, with nothing read that is not there."""
    try:
        return all(bool(meaning.value(e, at, strictly=True)) is yes for e, yes in goals)
    except NO_VALUE:
        return False


def _said(about: Sequence[m.Expr], meaning: Meaning, at: Situation) -> Iterator[str]:
    read = {_name(leaf): leaf for leaf in about if isinstance(leaf, m.Input)}
    asked = {_name(leaf.input) for leaf in about if isinstance(leaf, m.Fresh)}
    for leaf in dict.fromkeys(_element(leaf, read) for leaf in about):
        match leaf:
            case m.Input():
                value = worded(at.inputs[_name(leaf)], leaf.type) if _name(leaf) in read else None
                yield _input(leaf, value, at, told=_name(leaf) in asked)
            case m.Clock():
                yield f"`elapsed` = {number(float(f'{at.periods * meaning.period_s:.9g}'))} s"
            case _:
                yield from _other(leaf, meaning, at)


def _other(leaf: m.Expr, meaning: Meaning, at: Situation) -> Iterator[str]:
    """What memory or an operator gives; nothing where it has no value, and so does not matter."""
    try:
        text = worded(meaning.value(leaf, at), leaf.type)
    except NO_VALUE:
        return
    yield f"`{show(leaf)}` = {text}" if text is not None else f"some `{show(leaf)}`"


def _element(leaf: m.Expr, read: Mapping[InputName, m.Input]) -> m.Expr:
    """What is said once: the value of an input and whether it came belong together."""
    if not isinstance(leaf, (m.Fresh, m.Present)):
        return leaf
    name = _name(leaf.input)
    return read.get(name, m.Input(*name, type=Bool()))


def _input(element: m.Input, value: str | None, at: Situation, *, told: bool) -> str:
    """An input with its value, if any; that it is not fresh only if that is to be `told`."""
    name, shown = _name(element), f"`{show(element)}`"
    if name not in at.present:
        return f"{shown} absent"
    if name in at.fresh:
        return f"{shown} fresh{f' = {value}' if value else ''}"
    if value:
        return f"{shown} = {value}{' (not fresh)' if told else ''}"
    return f"{shown} {'not fresh' if told else 'there'}"


def _name(element: m.Input) -> InputName:
    return element.peer, element.element
