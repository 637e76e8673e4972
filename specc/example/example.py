"""Values that show a refutation, and how they are said."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from specc.example.freedom import Freedom
from specc.example.leaves import leaves, says_all
from specc.example.patience import Patience
from specc.example.search import Goal, find
from specc.example.situation import NO_VALUE, Meaning, Situation
from specc.example.tidy import tidied
from specc.example.words import number, worded
from specc.expr import show
from specc.model import expr as m
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
    """An example near `start`; None if none was found, or if the witness says all values itself."""
    if all(map(says_all, wanted.about)):
        return None
    found = find(meaning, start, wanted.goals, freedom, patience)
    if found is None or not _shows(meaning, wanted.goals, found):
        return None
    about = list(leaves(wanted.about, meaning.lets))
    found = tidied(found, start, about, lambda at: _shows(meaning, wanted.goals, at))
    return Example(found, ", ".join(_said(about, meaning, found)))


def _shows(meaning: Meaning, goals: Sequence[Goal], at: Situation) -> bool:
    """Whether the goals are met, with nothing read that is not there."""
    try:
        return all(bool(meaning.value(e, at, strictly=True)) is yes for e, yes in goals)
    except NO_VALUE:
        return False


def _said(about: Sequence[m.Expr], meaning: Meaning, at: Situation) -> Iterator[str]:
    asked = {name for leaf in about if isinstance(leaf, m.Fresh) for name in (_name(leaf.input),)}
    read = {leaf for leaf in about if isinstance(leaf, m.Input)}
    for leaf in dict.fromkeys(_merged(about, read, at)):
        match leaf:
            case m.Fresh(input=element):
                yield f"`{show(element)}` {'' if _name(element) in at.fresh else 'not '}fresh"
            case m.Present(input=element):
                yield f"`{show(element)}` {'there' if _name(element) in at.present else 'absent'}"
            case m.Input():
                yield _input(leaf, at, asked)
            case m.Clock():
                yield f"`elapsed` = {number(float(f'{at.periods * meaning.period_s:.9g}'))} s"
            case _:
                text = worded(meaning.value(leaf, at), leaf.type)
                yield f"`{show(leaf)}` = {text}" if text is not None else f"some `{show(leaf)}`"


def _merged(about: Sequence[m.Expr], read: set[m.Input], at: Situation) -> Iterator[m.Expr]:
    """An input once, where its value and its freshness are told."""
    values = {_name(element): element for element in read}
    fresh = {_name(leaf.input) for leaf in about if isinstance(leaf, m.Fresh)} & at.fresh
    for leaf in about:
        if isinstance(leaf, m.Present) and _name(leaf.input) in fresh - values.keys():
            continue
        if isinstance(leaf, (m.Fresh, m.Present)):
            yield values.get(_name(leaf.input), leaf)
        else:
            yield leaf


def _input(element: m.Input, at: Situation, asked: set[InputName]) -> str:
    name = _name(element)
    if name not in at.present:
        return f"`{show(element)}` absent"
    text = worded(at.inputs[name], element.type)
    value = "" if text is None else f" = {text}"
    if name in at.fresh:
        return f"`{show(element)}` fresh{value}"
    return f"`{show(element)}`{value}{' (not fresh)' if name in asked else ''}"


def _name(element: m.Input) -> InputName:
    return element.peer, element.element
