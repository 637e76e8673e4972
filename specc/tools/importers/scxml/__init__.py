"""`specc import scxml`: a flat state chart, or each region of a parallel one, becomes an agent."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from fractions import Fraction

from specc.lang.packages import PACKAGES
from specc.tools.importers.import_notes import Notes, document, read_markup
from specc.tools.importers.logic import atoms
from specc.tools.importers.scxml.chart import Chart, ChartState, Transition, read_charts
from specc.tools.importers.scxml.machine import EVENTS, Events, left, rows_of
from specc.tools.importers.writing import PEERS, Data, SpecNames, rate, without_empty

_OUTSIDE = "outside"
DEFAULT_PERIOD_S = Fraction(1, 100)
_DATA = "there is no data model; a guard is an input of type bool"
_CONTENT = "executable content has no counterpart; describe what it does as functions"
_REASONS = {
    ("datamodel", ""): _DATA,
    ("scxml", "datamodel"): _DATA,
    ("scxml", "binding"): _DATA,
    ("script", ""): _CONTENT,
    ("onentry", ""): _CONTENT,
    ("onexit", ""): _CONTENT,
    ("donedata", ""): _CONTENT,
    ("invoke", ""): "what a state invokes is another agent; describe it",
    ("transition", "type"): "in a flat chart internal and external transitions are the same",
    **{
        (tag, ""): _CONTENT for tag in ("assign", "raise", "send", "cancel", "log", "if", "foreach")
    },
}


def import_scxml(path: str, *, name: str = "", period: Fraction | None = None) -> Notes:
    """The specification of the chart in a file; `period` is in seconds."""
    notes = Notes()
    root = read_markup(path, "scxml", notes)
    charts = read_charts(root, notes) if root is not None else ()
    if root is None or not charts:
        return notes
    if period is None:
        message = "a chart has no period; 10 ms is assumed"
        notes.changed(message, root.place, "give one with `--period`")
    stem = os.path.splitext(os.path.basename(path))[0]
    own = SpecNames((*PEERS, *PACKAGES, _OUTSIDE)).of(name or root.get("name") or stem)
    sections = _SystemMaker(charts, own, period or DEFAULT_PERIOD_S, notes).sections()
    notes.leftovers(root, _REASONS)
    data: dict[str, Data] = {"specc": "1", "system": own, **sections}
    notes.text = document("specc import scxml", [], notes, data)
    return notes


class _SystemMaker:
    """An agent for each chart, and one for what sends the events and answers the guards."""

    def __init__(self, charts: Sequence[Chart], own: str, period: Fraction, notes: Notes) -> None:
        self._period, self._notes = period, notes
        states = [state for chart in charts for state in chart.states]
        self._events = Events(d for s in states for t in s.transitions for d in t.events)
        guards = GuardInputs(self._events.members)
        names = SpecNames((*PEERS, _OUTSIDE))
        several = len(charts) > 1
        self._makers = [
            _ChartMaker(each, names.of(each.name) if several else own, self._events, guards, notes)
            for each in charts
        ]
        self._guards = guards

    def sections(self) -> dict[str, Data]:
        """Types and agents."""
        agents: dict[str, Data] = {
            maker.own: {"control": maker.control(self._period)} for maker in self._makers
        }
        self._tell_events()
        types: dict[str, Data] = {}
        if self._events.members:
            types["Event"] = f"enum[{', '.join(self._events.members)}]"
        for maker in self._makers:
            types |= maker.types
        agents[_OUTSIDE] = self._outside()
        return without_empty({"types": types, "agents": agents})

    def _tell_events(self) -> None:
        """Names that changed, and how the two work cycles differ."""
        place = self._makers[0].chart.root.place
        for old, new in self._events.changed.items():
            self._notes.changed(f"event `{old}` is called `{new}`", place)
        states = [state for maker in self._makers for state in maker.chart.states]
        if any(not t.events for s in states for t in s.transitions):
            message = "a transition without an event is taken one period after the state began"
            self._notes.changed(message, place)

    def _outside(self) -> dict[str, Data]:
        """An agent that sends any event at any time, as a device says; nothing else is known."""
        types: dict[str, Data] = {}
        if self._events.members:
            types = {"event": "Event", "comes": "bool"}
        types |= dict.fromkeys(self._guards.names.values(), "bool")
        found: dict[str, Data] = {"title": "stands for who wants to know the state"}
        if types:
            title = "stands for what sends the events and answers the guards, at any time"
            found["title"] = title
            found["real_receptors"] = {"source": {"y": types}}
            found["virtual_receptors"] = {"source": self._source(types)}
        return {**found, "control": without_empty(self._stand_in(types))}

    def _source(self, types: dict[str, Data]) -> dict[str, Data]:
        passed: dict[str, Data] = {f"y.c.{name}": f"x.R.{name}" for name in types}
        return {
            "rate": rate(self._period),
            "x": {"R": types},
            "y": {"c": types},
            "functions": {"pass_on": passed},
            "behaviours": {"pass_on": {"functions": ["pass_on"], "terminal": "never"}},
            "states": {"S0": "pass_on"},
            "initial_state": "S0",
        }

    def _stand_in(self, types: dict[str, Data]) -> dict[str, Data]:
        """Its control subsystem: it answers in every period, and sends an event if one comes."""
        first = {"event": self._events.members[0]} if self._events.members else {}
        inputs: dict[str, Data] = {
            name: {"type": type_, "init": first.get(name, "False")} for name, type_ in types.items()
        }
        x: dict[str, Data] = {"source": inputs} if inputs else {}
        y: dict[str, Data] = {}
        answer: dict[str, Data] = {}
        send: dict[str, Data] = {}
        for maker in self._makers:
            x |= {maker.own: maker.outputs} if maker.outputs else {}
            y |= {maker.own: {name: types[name] for name in maker.inputs}} if maker.inputs else {}
            for name in maker.inputs:
                target = send if name == "event" else answer
                target[f"y.{maker.own}.{name}"] = f"x.source.{name}"
        answers: list[Data] = ["answer"] if answer else []
        control: dict[str, Data] = {
            "rate": rate(self._period),
            "x": x,
            "y": y,
            "functions": without_empty({"answer": answer}),
            "behaviours": {"wait": without_empty({"functions": answers, "terminal": "never"})},
            "states": {"quiet": "wait"},
            "initial_state": "quiet",
        }
        if not first:
            return control
        return control | {
            "conditions": {
                "initial": {"more": "x.source.comes", "none": "not x.source.comes"},
                "terminal": {"comes": "x.source.comes"},
            },
            "functions": without_empty({"answer": answer, "send": send}),
            "behaviours": {
                "wait": without_empty({"functions": answers, "terminal": "comes"}),
                "send": {"functions": [*answers, "send"], "terminal": "always"},
            },
            "states": {"quiet": "wait", "sending": "send"},
            "transitions": [
                ["quiet", "terminal", "always", "sending"],
                ["sending", "terminal", "more", "sending"],
                ["sending", "terminal", "none", "quiet"],
            ],
        }


class GuardInputs:
    """The unknown conditions of all charts: each is one input, which the outside answers."""

    def __init__(self, members: Iterable[str]) -> None:
        self.names: dict[str, str] = {}
        self._given = SpecNames(("event", "comes", "state", *members))

    def of(self, text: str) -> str:
        """The input of a condition."""
        if text not in self.names:
            self.names[text] = self._given.new(text if text.isidentifier() else f"guard_{text}")
        return self.names[text]


class _ChartMaker:
    """The control subsystem of a chart. What it asks for and tells is known once that is made."""

    def __init__(
        self, chart: Chart, own: str, events: Events, guards: GuardInputs, notes: Notes
    ) -> None:
        self.chart, self.own = chart, own
        self._events, self._guards, self._notes = events, guards, notes
        self._states = SpecNames()
        self._own_guards: dict[str, str] = {}
        self._lets = SpecNames(events.members)
        self._let: dict[str, Data] = {}
        self._tests: dict[frozenset[str], str] = {}
        self._initial: dict[str, Data] = {}
        self._terminal: dict[str, Data] = {}
        self._names = SpecNames(("always", "never"))
        self._named: dict[tuple[int, str], str] = {}

    def control(self, period: Fraction) -> dict[str, Data]:
        """The control subsystem."""
        ends = {self._states.of(state.id): self._left(state) for state in self.chart.states}
        behaviours: dict[str, Data] = {name: {"terminal": end} for name, end in ends.items()}
        transitions: list[Data] = [row for s in self.chart.states for row in self._rows(s)]
        self._report()
        tells = self._state_functions() if not self.inputs else {}
        for name in behaviours if tells else ():
            behaviours[name] = {"functions": [f"tell_{name}"], "terminal": ends[name]}
        return without_empty(
            {
                "title": self.chart.name,
                "rate": rate(period),
                "x": {_OUTSIDE: self._inputs()} if self.inputs else {},
                "y": {_OUTSIDE: {"state": self._type}} if tells else {},
                "let": self._let,
                "conditions": without_empty({"initial": self._initial, "terminal": self._terminal}),
                "functions": tells,
                "behaviours": behaviours,
                "states": {name: name for name in behaviours},
                "initial_state": self._states.of(self.chart.initial),
                "transitions": transitions,
            }
        )

    @property
    def inputs(self) -> tuple[str, ...]:
        """The inputs of the chart."""
        has_events = any(t.events for s in self.chart.states for t in s.transitions)
        return (*(["event"] if has_events else []), *self._own_guards.values())

    @property
    def outputs(self) -> dict[str, Data]:
        """What a chart tells that asks for nothing: an agent talks to somebody."""
        if self.inputs:
            return {}
        return {"state": {"type": self._type, "init": self._states.of(self.chart.initial)}}

    @property
    def types(self) -> dict[str, Data]:
        """The type of what it tells."""
        members = ", ".join(self._states.of(state.id) for state in self.chart.states)
        return {} if self.inputs else {self._type: f"enum[{members}]"}

    @property
    def _type(self) -> str:
        members = [self._states.of(state.id) for state in self.chart.states]
        return SpecNames((*members, "Event")).of(f"State_{self.own}")

    def _state_functions(self) -> dict[str, Data]:
        names = [self._states.of(state.id) for state in self.chart.states]
        return {f"tell_{name}": {f"y.{_OUTSIDE}.state": name} for name in names}

    def _atom(self, text: str) -> str:
        """What a condition asks: a let for events, an input for a guard."""
        if not text.startswith(EVENTS):
            return f"x.outside.{self._guard(text)}"
        members = frozenset(text[len(EVENTS) :].split())
        if members not in self._tests:
            wish, test = self._events.let(members)
            self._tests[members] = self._lets.new(wish)
            self._let[self._tests[members]] = test
        return self._tests[members]

    def _guard(self, text: str) -> str:
        self._own_guards[text] = self._guards.of(text)
        return self._own_guards[text]

    def _left(self, state: ChartState) -> str:
        if not state.transitions:
            return "never"
        text = left(state, self._events, self._atom)
        return self._condition(self._terminal, text, f"{state.id}_left")

    def _rows(self, state: ChartState) -> list[list[Data]]:
        found: list[list[Data]] = []
        for transition, condition in rows_of(state, self._events, self._atom):
            if not condition:
                message = "this transition is never taken: an earlier one always is"
                self._notes.changed(message, transition.element.place)
            found.append(self._row(state, transition, condition or "False"))
        return found

    def _row(self, state: ChartState, transition: Transition, condition: str) -> list[Data]:
        target = transition.target or state.id
        if not transition.target:
            message = f"a transition without a target enters `{state.id}` again"
            self._notes.changed(message, transition.element.place)
        name = self._condition(self._initial, condition, f"{state.id}_to_{target}")
        return [self._states.of(state.id), "terminal", name, self._states.of(target)]

    def _condition(self, group: dict[str, Data], text: str, wish: str) -> str:
        if text == "True":
            return "always"
        key = id(group), text
        if key not in self._named:
            self._named[key] = self._names.new(wish)
            group[self._named[key]] = text
        return self._named[key]

    def _inputs(self) -> dict[str, Data]:
        """The queue of events, and each guard as an input that is false until it is answered."""
        events: dict[str, Data] = {"event": "Event"} if "event" in self.inputs else {}
        guards: dict[str, Data] = {
            name: {"type": "bool", "init": "False", "title": text}
            for text, name in self._own_guards.items()
        }
        return events | guards

    def _report(self) -> None:
        """Names that changed, and guards that became inputs."""
        self._tell_guards()
        if not self.inputs:
            message = "nothing that the chart asks for comes from outside; it tells its state there"
            self._notes.changed(message, self.chart.root.place)
        for state in self.chart.states:
            if self._states.of(state.id) != state.id:
                message = f"state `{state.id}` is called `{self._states.of(state.id)}`"
                self._notes.changed(message, state.element.value_place("id"))
            if state.element.tag == "final":
                message = f"the chart stops in `{state.id}`; the agent stays there"
                self._notes.changed(message, state.element.place)

    def _tell_guards(self) -> None:
        told: set[str] = set()
        for state in self.chart.states:
            for transition in state.transitions:
                for atom in atoms(transition.guard):
                    if atom.name not in told:
                        told.add(atom.name)
                        message = f"guard `{atom.name}` is the input `{self._guard(atom.name)}`"
                        self._notes.changed(message, transition.element.value_place("cond"))
