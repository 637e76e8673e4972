"""States, events and transitions of SCXML as a state machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from specc.model.expr import FALSE, TRUE, Expr, negation
from specc.tools.importers.logic import atom, join, render
from specc.tools.importers.scxml.chart import ChartState, Transition
from specc.tools.importers.writing import SpecNames

# Events of a chart as members of one enum: the interpreter takes one at a time from its queue.


_ANY = "*"
_DEEPEST = 16
"""Parts of an event that another one may name a beginning of."""


class Events:
    """The events that a chart names; each stands for those that no longer name covers."""

    def __init__(self, descriptors: Iterable[str]) -> None:
        names = SpecNames()
        plain = dict.fromkeys(_plain(d) for d in descriptors)
        self._any = _ANY in plain
        self._members = {event: names.of(event) for event in plain if event != _ANY}
        self._other = names.new("any_other") if self._any else ""
        self._covered: dict[str, set[str]] = {}
        for event, name in self._members.items():
            parts = event.split(".")[:_DEEPEST]
            for count in range(1, len(parts) + 1):
                self._covered.setdefault(".".join(parts[:count]), set()).add(name)
            self._covered.setdefault(event, set()).add(name)

    @property
    def members(self) -> tuple[str, ...]:
        """The members of the enum, in the order of the document."""
        return (*self._members.values(), *((self._other,) if self._any else ()))

    @property
    def changed(self) -> dict[str, str]:
        """Events whose name could not be kept."""
        return {event: name for event, name in self._members.items() if event != name}

    def matching(self, descriptors: Iterable[str]) -> frozenset[str]:
        """Members that a transition reacts to: `a` also matches `a.b` (3.12.1 of SCXML)."""
        found: set[str] = set()
        for descriptor in map(_plain, descriptors):
            if descriptor == _ANY:
                return frozenset(self.members)
            found |= self._covered.get(descriptor, set())
        return frozenset(found)

    def let(self, members: frozenset[str]) -> tuple[str, str]:
        """Name and expression of the test that one of some events came."""
        if members == frozenset(self.members):
            return "on_any_event", "fresh(x.outside.event)"
        ordered = [name for name in self.members if name in members]
        test = f"fresh(x.outside.event) and x.outside.event in {{{', '.join(ordered)}}}"
        return f"on_{'_or_'.join(ordered)}", test


def _plain(descriptor: str) -> str:
    return descriptor.removesuffix(".*").rstrip(".") or _ANY


# Transitions of a chart as rows of which exactly one applies.
#
# SCXML takes the first transition in document order whose event and guard fit, and those without an
# event before the others. Rows have no order, so a row says that no earlier one applies.


EVENTS = "\0"
"""Begins the text of an atom that asks for events; their names follow."""


def rows_of(
    state: ChartState, events: Events, name: Callable[[str], str]
) -> list[tuple[Transition, str]]:
    """Under which condition each transition of a state is taken; "" if earlier ones always are.

    `name` gives the expression of an atom.
    """
    ordered = sorted(state.transitions, key=lambda t: bool(t.events))
    known = [(t, events.matching(t.events) if t.events else None) for t in ordered]
    return [(t, _condition(t, known[:i], events, name)) for i, t in enumerate(ordered)]


def left(state: ChartState, events: Events, name: Callable[[str], str]) -> str:
    """When some transition of a state is taken."""
    parts = [
        join("and", (_event(t.events, events), t.guard))
        for t in sorted(state.transitions, key=lambda t: bool(t.events))
    ]
    return render(join("or", parts), name)


def _condition(
    own: Transition,
    earlier: Sequence[tuple[Transition, frozenset[str] | None]],
    events: Events,
    name: Callable[[str], str],
) -> str:
    """`earlier` transitions come with the events that they match, None for any."""
    if not own.events:
        parts = [own.guard, *(negation(t.guard) for t, _ in earlier)]
        condition = join("and", parts)
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


def _event(descriptors: tuple[str, ...], events: Events) -> Expr:
    return _members(events.matching(descriptors)) if descriptors else TRUE


def _members(members: frozenset[str]) -> Expr:
    """The question for events has no text in the chart; a mark keeps it apart from guards."""
    return atom(EVENTS + " ".join(sorted(members)))
