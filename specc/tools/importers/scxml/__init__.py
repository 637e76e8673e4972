"""`specc import scxml`: a flat state chart becomes an agent of a specification."""

from __future__ import annotations

import os
from fractions import Fraction

from specc.lang.packages import PACKAGES
from specc.tools.importers.import_notes import Notes, document, read_markup
from specc.tools.importers.logic import atoms
from specc.tools.importers.scxml.chart import Chart, ChartState, Transition, read_chart
from specc.tools.importers.scxml.machine import EVENTS, Events, left, rows_of
from specc.tools.importers.writing import PEERS, Data, SpecNames, filled, rate

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
    chart = read_chart(root, notes) if root is not None else None
    if chart is None:
        return notes
    if period is None:
        message = "a chart has no period; 10 ms is assumed"
        notes.changed(message, chart.root.place, "give one with `--period`")
    stem = os.path.splitext(os.path.basename(path))[0]
    own = SpecNames((*PEERS, *PACKAGES, "outside")).of(name or chart.name or stem)
    agents = _SystemMaker(chart, own, period or DEFAULT_PERIOD_S, notes).agents()
    notes.leftovers(chart.root, _REASONS)
    data: dict[str, Data] = {"specc": "1", "system": own, **agents}
    notes.text = document("specc import scxml", [], notes, data)
    return notes


class _SystemMaker:
    def __init__(self, chart: Chart, own: str, period: Fraction, notes: Notes) -> None:
        self._chart, self._own, self._period, self._notes = chart, own, period, notes
        self._events = Events(d for s in chart.states for t in s.transitions for d in t.events)
        self._states = SpecNames()
        self._inputs_named = SpecNames(("event", "comes", *self._events.members))
        self._guards: dict[str, str] = {}
        self._lets = SpecNames(self._events.members)
        self._let: dict[str, Data] = {}
        self._tests: dict[frozenset[str], str] = {}
        self._initial: dict[str, Data] = {}
        self._terminal: dict[str, Data] = {}
        self._names = SpecNames(("always", "never"))
        self._named: dict[tuple[int, str], str] = {}

    def agents(self) -> dict[str, Data]:
        """Types and agents: the chart, and a stand-in for what sends events and answers guards."""
        behaviours: dict[str, Data] = {}
        states: dict[str, Data] = {}
        for state in self._chart.states:
            states[self._states.of(state.id)] = self._states.of(state.id)
            behaviours[self._states.of(state.id)] = {"terminal": self._left(state)}
        transitions: list[Data] = [row for s in self._chart.states for row in self._rows(s)]
        self._report()
        inputs = self._inputs()
        control: dict[str, Data] = {
            "title": self._chart.name,
            "rate": rate(self._period),
            "x": {"outside": inputs} if inputs else {},
            "let": self._let,
            "conditions": filled({"initial": self._initial, "terminal": self._terminal}),
            "behaviours": behaviours,
            "states": states,
            "initial_state": self._states.of(self._chart.initial),
            "transitions": transitions,
        }
        agents: dict[str, Data] = {self._own: {"control": filled(control)}}
        if inputs:
            agents["outside"] = self._outside()
        event: Data = f"enum[{', '.join(self._events.members)}]"
        types = {"types": {"Event": event}} if self._events.members else {}
        return {**types, "agents": agents}

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
        if text not in self._guards:
            self._guards[text] = self._inputs_named.new(
                text if text.isidentifier() else f"guard_{text}"
            )
        return self._guards[text]

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
        events: dict[str, Data] = {"event": "Event"} if self._events.members else {}
        guards: dict[str, Data] = {
            name: {"type": "bool", "init": "False", "title": text}
            for text, name in self._guards.items()
        }
        return events | guards

    def _outside(self) -> dict[str, Data]:
        """An agent that sends any event at any time, as a device says; nothing else is known."""
        is_sent = bool(self._events.members)
        types: dict[str, Data] = {"event": "Event", "comes": "bool"} if is_sent else {}
        types |= dict.fromkeys(self._guards.values(), "bool")
        passed: dict[str, Data] = {f"y.c.{name}": f"x.R.{name}" for name in types}
        source: dict[str, Data] = {
            "rate": rate(self._period),
            "x": {"R": types},
            "y": {"c": types},
            "functions": {"pass_on": passed},
            "behaviours": {"pass_on": {"functions": ["pass_on"], "terminal": "never"}},
            "states": {"S0": "pass_on"},
            "initial_state": "S0",
        }
        return {
            "title": "stands for what sends the events and answers the guards, at any time",
            "real_receptors": {"source": {"y": types}},
            "virtual_receptors": {"source": source},
            "control": filled(self._stand_in(types)),
        }

    def _stand_in(self, types: dict[str, Data]) -> dict[str, Data]:
        """Its control subsystem: it answers in every period, and sends an event if one comes."""
        first = {"event": self._events.members[0]} if self._events.members else {}
        inputs: dict[str, Data] = {
            name: {"type": type_, "init": first.get(name, "False")} for name, type_ in types.items()
        }
        sent = [name for name in types if name != "comes"]
        passed = {name: f"x.source.{name}" for name in sent}
        answer: dict[str, Data] = {
            f"y.{self._own}.{name}": text for name, text in passed.items() if name != "event"
        }
        answers: list[Data] = ["answer"] if answer else []
        control: dict[str, Data] = {
            "rate": rate(self._period),
            "x": {"source": inputs},
            "y": {self._own: {name: types[name] for name in sent}},
            "functions": filled({"answer": answer}),
            "behaviours": {"wait": {"functions": answers, "terminal": "never"}},
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
            "functions": filled(
                {"answer": answer, "send": {f"y.{self._own}.event": passed["event"]}}
            ),
            "behaviours": {
                "wait": filled({"functions": answers, "terminal": "comes"}),
                "send": {"functions": [*answers, "send"], "terminal": "always"},
            },
            "states": {"quiet": "wait", "sending": "send"},
            "transitions": [
                ["quiet", "terminal", "always", "sending"],
                ["sending", "terminal", "more", "sending"],
                ["sending", "terminal", "none", "quiet"],
            ],
        }

    def _report(self) -> None:
        """Names that changed, guards that became inputs, and how the two work cycles differ."""
        self._tell_guards()
        for state in self._chart.states:
            if self._states.of(state.id) != state.id:
                message = f"state `{state.id}` is called `{self._states.of(state.id)}`"
                self._notes.changed(message, state.element.value_place("id"))
            if state.element.tag == "final":
                message = f"the chart stops in `{state.id}`; the agent stays there"
                self._notes.changed(message, state.element.place)
        place = self._chart.root.place
        for old, new in self._events.changed.items():
            self._notes.changed(f"event `{old}` is called `{new}`", place)
        if any(not t.events for s in self._chart.states for t in s.transitions):
            message = "a transition without an event is taken one period after the state began"
            self._notes.changed(message, place)

    def _tell_guards(self) -> None:
        told: set[str] = set()
        for state in self._chart.states:
            for transition in state.transitions:
                for atom in atoms(transition.guard):
                    if atom.name not in told:
                        told.add(atom.name)
                        message = f"guard `{atom.name}` is the input `{self._guard(atom.name)}`"
                        self._notes.changed(message, transition.element.value_place("cond"))
