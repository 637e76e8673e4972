"""Transitions of a chart as rows of which exactly one applies.

SCXML takes the first transition in document order whose event and guard fit, and those without an
event before the others. Rows have no order, so a row says that no earlier one applies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from specc.importers.logic import FALSE, TRUE, Atom, Logic, join, negation, render
from specc.importers.scxml.chart import State, Transition
from specc.importers.scxml.events import Events

EVENTS = "\0"
"""Begins the text of an atom that asks for events; their names follow."""


@dataclass(frozen=True, slots=True)
class Row:
    """Under which condition a transition is taken, as text; "" if earlier ones always are."""

    transition: Transition
    condition: str


def rows_of(state: State, events: Events, name: Callable[[str], str]) -> list[Row]:
    """The rows of a state; `name` gives the expression of an atom."""
    ordered = sorted(state.transitions, key=lambda t: bool(t.events))
    known = [(t, events.matching(t.events) if t.events else None) for t in ordered]
    return [Row(t, _condition(t, known[:i], events, name)) for i, t in enumerate(ordered)]


def left(state: State, events: Events, name: Callable[[str], str]) -> str:
    """When some transition of a state is taken."""
    parts = [
        join("and", (_event(t.events, events), t.guard))
        for t in sorted(state.transitions, key=lambda t: bool(t.events))
    ]
    return render(join("or", tuple(parts)), name)


def _condition(
    own: Transition,
    earlier: Sequence[tuple[Transition, frozenset[str] | None]],
    events: Events,
    name: Callable[[str], str],
) -> str:
    """`earlier` transitions come with the events that they match, None for any."""
    if not own.events:
        parts = [own.guard, *(negation(t.guard) for t, _ in earlier)]
        condition = join("and", tuple(parts))
        return "" if condition == FALSE else render(condition, name)
    matching = events.matching(own.events)
    parts = [own.guard]
    for other, theirs in earlier:
        if theirs is not None and matching.isdisjoint(theirs):
            continue
        common = matching if theirs is None else matching & theirs
        if other.guard == TRUE:
            matching -= common
        elif common == matching:
            parts.append(negation(other.guard))
        elif common:
            parts.append(negation(join("and", (_members(common), other.guard))))
    condition = join("and", (_members(matching), *parts))
    return "" if not matching or condition == FALSE else render(condition, name)


def _event(descriptors: tuple[str, ...], events: Events) -> Logic:
    return _members(events.matching(descriptors)) if descriptors else TRUE


def _members(members: frozenset[str]) -> Logic:
    """The question for events has no text in the chart; a mark keeps it apart from guards."""
    return Atom(EVENTS + " ".join(sorted(members)))
