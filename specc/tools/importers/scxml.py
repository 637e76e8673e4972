"""`specc import scxml`: a flat state chart, or each region of a parallel one, becomes an agent.

The text is `templates/import/scxml.yaml.j2`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from fractions import Fraction

from specc.lang.packages import PACKAGES
from specc.model.expr import FALSE, TRUE, Expr, negation
from specc.tools.importers.logic import atom, atoms, join, render
from specc.tools.importers.reading import Notes
from specc.tools.importers.scxml_reader import Chart, ChartState, Transition, read_charts
from specc.tools.importers.writing import PEERS, Data, SpecNames, rate

_OUTSIDE = "outside"
DEFAULT_PERIOD_S = Fraction(1, 100)
_DATA = "there is no data model; a guard is an input of type bool"
_CONTENT = "executable content has no counterpart; describe what it does as functions"
_CONTENT_TAGS = "script onentry onexit donedata assign raise send cancel log if foreach"
_REASONS = {
    ("datamodel", ""): _DATA,
    ("scxml", "datamodel"): _DATA,
    ("scxml", "binding"): _DATA,
    ("invoke", ""): "what a state invokes is another agent; describe it",
    ("transition", "type"): "in a flat chart internal and external transitions are the same",
    **{(tag, ""): _CONTENT for tag in _CONTENT_TAGS.split()},
}
_ANY = "*"
_DEEPEST = 16
"""Parts of an event that another one may name a beginning of."""
_EVENTS = "\0"
"""Begins the text of an atom that stands for events; their names follow."""


def import_scxml(path: str, *, name: str = "", period: Fraction | None = None) -> Notes:
    """The specification of the chart in a file; `period` is in seconds."""
    notes = Notes()
    root = notes.read(path, "scxml")
    charts = read_charts(root, notes) if root is not None else ()
    if root is None or not charts:
        return notes
    if period is None:
        message = "a chart has no period; 10 ms is assumed"
        notes.change(message, root.place, "give one with `--period`")
    stem = os.path.splitext(os.path.basename(path))[0]
    own = SpecNames((*PEERS, *PACKAGES, _OUTSIDE)).of(name or root.get("name") or stem)
    events = Events(d for chart in charts for t in chart.transitions for d in t.events)
    guards, names = GuardInputs(events.members), SpecNames((*PEERS, _OUTSIDE))
    agents = [
        _ChartAgent(each, names.of(each.name) if len(charts) > 1 else own, events, guards, notes)
        for each in charts
    ]
    for agent in agents:
        agent.build()
    place = charts[0].root.place
    for old, new in events.renamed.items():
        notes.change(f"event `{old}` is called `{new}`", place)
    if any(not t.events for chart in charts for t in chart.transitions):
        message = "a transition without an event is taken one period after the state began"
        notes.change(message, place)
    notes.report_unused(root, _REASONS)
    inputs: dict[str, Data] = {"event": "Event", "comes": "bool"} if events.members else {}
    inputs |= dict.fromkeys(guards.names.values(), "bool")
    types: dict[str, Data] = {}
    if events.members:
        types["Event"] = f"enum[{', '.join(events.members)}]"
    for agent in agents:
        if not agent.inputs:
            types[agent.state_type] = f"enum[{', '.join(agent.states)}]"
    parts = {
        "system": own,
        "types": types,
        "rate": rate(period or DEFAULT_PERIOD_S),
        "agents": agents,
        "inputs": inputs,
        "first_event": events.members[0] if events.members else "",
        "has_guards": any({*agent.inputs} - {"event"} for agent in agents),
    }
    notes.write("import/scxml.yaml.j2", parts, "Made by `specc import scxml`.")
    return notes


# Events of a chart as members of one enum: the interpreter takes one at a time from its queue.


class Events:
    """The events that a chart names; each stands for those that no longer name covers."""

    def __init__(self, descriptors: Iterable[str]) -> None:
        names = SpecNames()
        plain = dict.fromkeys(map(_plain, descriptors))
        known = {event: names.of(event) for event in plain if event != _ANY}
        self.renamed = {event: name for event, name in known.items() if event != name}
        self.members = (*known.values(), *((names.new("any_other"),) if _ANY in plain else ()))
        """The members of the enum, in the order of the document."""
        self._covered: dict[str, set[str]] = {}
        for event, name in known.items():
            parts = event.split(".")[:_DEEPEST]
            prefixes = [".".join(parts[: count + 1]) for count in range(len(parts))]
            for covering in (*prefixes, event):
                self._covered.setdefault(covering, set()).add(name)

    def matching(self, descriptors: Iterable[str]) -> frozenset[str]:
        """Members that a transition reacts to: `a` also matches `a.b` (3.12.1 of SCXML)."""
        plain = [*map(_plain, descriptors)]
        if _ANY in plain:
            return frozenset(self.members)
        return frozenset().union(*(self._covered.get(each, ()) for each in plain))

    def let(self, members: frozenset[str]) -> tuple[str, str]:
        """Name and expression of the test that one of some events came."""
        if members == frozenset(self.members):
            return "on_any_event", "fresh(x.outside.event)"
        ordered = [name for name in self.members if name in members]
        test = f"fresh(x.outside.event) and x.outside.event in {{{', '.join(ordered)}}}"
        return f"on_{'_or_'.join(ordered)}", test


def _plain(descriptor: str) -> str:
    return descriptor.removesuffix(".*").rstrip(".") or _ANY


def _event_test(members: frozenset[str]) -> Expr:
    """The question for events has no text in the chart; a mark keeps it apart from guards."""
    return atom(_EVENTS + " ".join(sorted(members)))


class GuardInputs:
    """The unknown conditions of all charts: each is one input, which the outside answers."""

    def __init__(self, members: Iterable[str]) -> None:
        self.names: dict[str, str] = {}
        self._unique = SpecNames(("event", "comes", "state", *members))

    def input_of(self, text: str) -> str:
        """The input of a condition."""
        if text not in self.names:
            self.names[text] = self._unique.new(text if text.isidentifier() else f"guard_{text}")
        return self.names[text]


class _ChartAgent:
    """The agent of a chart; what it needs from outside is known once it is built."""

    def __init__(
        self, chart: Chart, name: str, events: Events, guards: GuardInputs, notes: Notes
    ) -> None:
        self._chart, self.name, self.title = chart, name, chart.name
        self._events, self._all_guards, self._notes = events, guards, notes
        self._state_names = SpecNames()
        self.guards: dict[str, str] = {}
        self._lets = SpecNames(events.members)
        self.let: dict[str, Data] = {}
        self._tests: dict[frozenset[str], str] = {}
        self.conditions: dict[str, dict[str, Data]] = {"initial": {}, "terminal": {}}
        self._condition_names = SpecNames(("always", "never"))
        self._known_conditions: dict[tuple[str, str], str] = {}

    def build(self) -> None:
        """Build states, behaviours and rows; report what was renamed or behaves differently."""
        chart = self._chart
        self.behaviours = {self._state_names.of(s.id): self._end(s) for s in chart.states}
        """State, and its one behaviour -> the terminal condition."""
        self.states = list(self.behaviours)
        self.transitions: list[Data] = [row for state in chart.states for row in self._rows(state)]
        self.conditions = {kind: named for kind, named in self.conditions.items() if named}
        self.initial = self._state_names.of(chart.initial)
        reported: set[str] = set()
        for transition in chart.transitions:
            for guard in atoms(transition.guard):
                if guard.name not in reported:
                    reported.add(guard.name)
                    message = f"guard `{guard.name}` is the input `{self._guard(guard.name)}`"
                    self._notes.change(message, transition.element.value_place("cond"))
        if not self.inputs:
            message = "nothing that the chart asks for comes from outside; it tells its state there"
            self._notes.change(message, chart.root.place)
        for state in chart.states:
            name = self._state_names.of(state.id)
            if name != state.id:
                message = f"state `{state.id}` is called `{name}`"
                self._notes.change(message, state.element.value_place("id"))
            if state.element.tag == "final":
                message = f"the chart stops in `{state.id}`; the agent stays there"
                self._notes.change(message, state.element.place)

    @property
    def inputs(self) -> tuple[str, ...]:
        """What it needs from outside; a chart that needs nothing tells its state there."""
        has_events = any(transition.events for transition in self._chart.transitions)
        return (*(["event"] if has_events else []), *self.guards.values())

    @property
    def state_type(self) -> str:
        """The name of the type of its state."""
        return SpecNames((*self.states, "Event")).of(f"State_{self.name}")

    def _atom(self, text: str) -> str:
        """A let for events, an input for a guard."""
        if not text.startswith(_EVENTS):
            return f"x.outside.{self._guard(text)}"
        members = frozenset(text[len(_EVENTS) :].split())
        if members not in self._tests:
            wish, test = self._events.let(members)
            self._tests[members] = self._lets.new(wish)
            self.let[self._tests[members]] = test
        return self._tests[members]

    def _guard(self, text: str) -> str:
        self.guards[text] = self._all_guards.input_of(text)
        return self.guards[text]

    def _end(self, state: ChartState) -> str:
        """The condition under which some transition of a state is taken."""
        if not state.transitions:
            return "never"
        conditions = [
            join("and", (_event_test(self._events.matching(t.events)), t.guard))
            if t.events
            else t.guard
            for t in _by_priority(state)
        ]
        text = render(join("or", conditions), self._atom)
        return self._condition("terminal", text, f"{state.id}_left")

    def _rows(self, state: ChartState) -> list[list[Data]]:
        """A row for each transition, of which exactly one applies.

        SCXML takes the first transition in document order whose event and guard fit, and those
        without an event before the others. Rows have no order, so a row says that no earlier one
        applies.
        """
        found: list[list[Data]] = []
        earlier: list[tuple[Transition, frozenset[str] | None]] = []
        for transition in _by_priority(state):
            matching = self._events.matching(transition.events) if transition.events else None
            logic = _row_condition(transition.guard, matching, earlier)
            earlier.append((transition, matching))
            condition = "False" if logic == FALSE else render(logic, self._atom)
            if logic == FALSE:
                message = "this transition is never taken: an earlier one always is"
                self._notes.change(message, transition.element.place)
            target = transition.target or state.id
            if not transition.target:
                message = f"a transition without a target enters `{state.id}` again"
                self._notes.change(message, transition.element.place)
            name = self._condition("initial", condition, f"{state.id}_to_{target}")
            ends = map(self._state_names.of, (state.id, target))
            found.append([next(ends), "terminal", name, next(ends)])
        return found

    def _condition(self, kind: str, text: str, wish: str) -> str:
        if text == "True":
            return "always"
        key = kind, text
        if key not in self._known_conditions:
            self._known_conditions[key] = self._condition_names.new(wish)
            self.conditions[kind][self._known_conditions[key]] = text
        return self._known_conditions[key]


def _by_priority(state: ChartState) -> list[Transition]:
    return sorted(state.transitions, key=lambda transition: bool(transition.events))


def _row_condition(
    guard: Expr,
    matching: frozenset[str] | None,
    earlier: Sequence[tuple[Transition, frozenset[str] | None]],
) -> Expr:
    """When a transition is taken; events that transitions match are None for any."""
    if matching is None:
        return join("and", (guard, *(negation(t.guard) for t, _ in earlier)))
    parts = [guard]
    for other, theirs in earlier:
        common = matching if theirs is None else matching & theirs
        if theirs is not None and not common:
            continue
        if other.guard == TRUE:
            matching -= common
        elif common == matching:
            parts.append(negation(other.guard))
        else:
            parts.append(negation(join("and", (_event_test(common), other.guard))))
    return join("and", (_event_test(matching), *parts)) if matching else FALSE
