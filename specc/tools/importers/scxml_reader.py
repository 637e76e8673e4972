"""SCXML charts as they are written: states, histories and transitions in document order."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from specc.model.expr import TRUE, Expr
from specc.reachable import grouped
from specc.source import Place
from specc.tools.importers.logic import LogicError, atom, parse_logic
from specc.tools.importers.reading import Notes, XmlElement

NAMESPACE = "http://www.w3.org/2005/07/scxml"
_MOST_TRANSITIONS, _MOST_ROWS = 300, 4_000
"""Of one state, those around it included, and of all: the condition of a row grows with those
before it."""
_SPLIT = "split the state: the condition of each row also tests all rows before it"
_FLATTEN = "flatten the chart: one state for every combination that can be active"
_APART = f"write a chart for each of them, which becomes an agent, or {_FLATTEN}"
_STATES = ("state", "final")
_NAMED = (*_STATES, "history")
_ACTIONS = ("send", "invoke", "assign", "cancel", "raise", "log", "if", "foreach", "script")
"""Elements of SCXML that do something; a `target` of theirs is no state."""
_TARGETS = ("target", "next", "to", "goto")
"""Attributes by which elements of dialects name the state that they lead to."""
_IN_STATE = re.compile(r"\bIn\(\s*['\"]([^'\"]+)['\"]\s*\)")


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition; no `events` means that it needs none, no `target` that the state stays.

    If it `is_internal`, it does not leave its own state where the target is inside.
    """

    events: tuple[str, ...]
    guard: Expr
    target: str
    is_internal: bool
    element: XmlElement


@dataclass(frozen=True, slots=True)
class ChartState:
    """A state; a final one has no transitions.

    `parent` is the state that it is in, "" in none; `initial` is what a compound state begins with,
    a state or a history inside, "" for an atomic one.
    """

    id: str
    parent: str
    initial: str
    transitions: tuple[Transition, ...]
    element: XmlElement


@dataclass(frozen=True, slots=True)
class History:
    """What leads back to where its `parent` was left: to the innermost state if it `is_deep`."""

    id: str
    parent: str
    is_deep: bool
    default: str
    element: XmlElement


@dataclass(frozen=True)
class Chart:
    """States in document order; `root` is the document, or the region that the chart is of."""

    name: str
    states: tuple[ChartState, ...]
    histories: tuple[History, ...]
    initial: str
    root: XmlElement

    @property
    def transitions(self) -> list[Transition]:
        """Those of all states."""
        return [transition for state in self.states for transition in state.transitions]

    @cached_property
    def state(self) -> dict[str, ChartState]:
        """The states by name."""
        return {state.id: state for state in self.states}

    @cached_property
    def history(self) -> dict[str, History]:
        """The histories by name."""
        return {history.id: history for history in self.histories}

    @cached_property
    def atomic(self) -> list[ChartState]:
        """The states with no others inside."""
        return [state for state in self.states if not state.initial]

    @cached_property
    def compound(self) -> list[ChartState]:
        """The states with others inside."""
        return [state for state in self.states if state.initial]

    def around(self, name: str) -> list[str]:
        """A state and those around it, innermost first."""
        found = [name] if name else []
        while found and (parent := self.state[found[-1]].parent):
            found.append(parent)
        return found

    @cached_property
    def inside(self) -> dict[str, list[str]]:
        """The atomic states in each state; itself, if it is one."""
        return grouped((name, state.id) for state in self.atomic for name in self.around(state.id))

    def first(self, name: str) -> str:
        """The atomic state in which a state or history begins, if none around it was left yet."""
        if name in self.history:
            return self.first(self.history[name].default)
        return self.first(inner) if (inner := self.state[name].initial) else name


def read_charts(root: XmlElement, notes: Notes) -> tuple[Chart, ...]:
    """The chart of a document; or that of each region, if all of the document is parallel.

    None, with errors in `notes`, if one is not flat or not whole.
    """
    for element in root.walk():  # tags of the namespace of SCXML without it; others keep theirs
        space, _, tag = element.tag.rpartition(" ")
        element.tag = tag if space in ("", NAMESPACE) else f"{space}:{tag}"
    root.used = True
    if root.tag != "scxml":
        message = f"the root is <{root.tag}>, not <scxml>"
        notes.error("E0803", message, root.place, "is this a state chart?")
        return ()
    root.used_attributes.update(("version", "xmlns"))
    reader = _ChartReader(root, notes)
    charts = reader.read()
    reader.refuse_other_transitions()
    return () if notes.failed else charts


class _ChartReader:
    def __init__(self, root: XmlElement, notes: Notes) -> None:
        self._root, self._notes = root, notes
        self._name_states()
        self._nested = dict(_nested(root))
        """States inside others -> the words for the one that they are in."""
        refused = [each for each in root.walk() if each.tag == "parallel"]
        refused += [each for each in root.children if each.tag == "history"]
        self._refused = {each.attributes.get("id") for each in refused}
        self._whole = ""
        """The name of the parallel state that is the whole document."""

    def read(self) -> tuple[Chart, ...]:
        root = self._root
        tops = [child for child in root.children if child.tag in (*_STATES, "parallel", "history")]
        if len(tops) == 1 and tops[0].tag == "parallel":
            return self._regions(tops[0])
        self._refuse_parallel(root)
        self._refuse_inside(root, ("history",))
        return (self._chart(root, root.all(*_STATES)),)

    def _refuse(self, message: str, place: Place, help: str) -> None:
        self._notes.error("E0803", message, place, help)

    def _chart(self, root: XmlElement, elements: list[XmlElement]) -> Chart:
        states: list[ChartState] = []
        histories: list[History] = []
        for element in elements:
            self._read_state(element, "", states, histories)
        initial = self._initial(root, elements)
        if not states and not self._refused:
            help = 'write `<state id="..."/>`'
            self._notes.error("E0803", "the chart has no state", root.place, help)
        chart = Chart(root.get("name"), tuple(states), tuple(histories), initial, root)
        self._check_names(chart)
        if not self._notes.failed:
            self._check_size(chart)
        return chart

    def _initial(self, element: XmlElement, inner: Sequence[XmlElement]) -> str:
        """The name of what begins in an element; the first state in it where nothing says so."""
        named = element.get("initial") or _initial_target(element)
        if len(named.split()) > 1:
            message = "several initial states need parallel states"
            self._refuse(message, element.value_place("initial"), _FLATTEN)
        return named or (inner[0].get("id") if inner else "")

    def _regions(self, parallel: XmlElement) -> tuple[Chart, ...]:
        """A chart for each region of a document that is parallel as a whole."""
        root = self._root
        parallel.used = True
        self._whole = own = parallel.get("id")
        if (root.get("initial") or _initial_target(root) or own) != own:
            message = "the initial states of regions are not carried over from here"
            help = "name each in its region, `<state initial=...>`"
            self._refuse(message, root.value_place("initial"), help)
        self._refuse_inside(parallel, ("parallel", "history", "final"))
        for element in parallel.all("transition"):
            message = "a transition out of all regions at once is not carried over"
            self._refuse(message, element.place, _FLATTEN)
        message = "the regions become agents, which get the same events"
        self._notes.change(message, parallel.place)
        charts = []
        for region in parallel.all("state"):
            name = region.get("id")
            inner = region.all(*_STATES)
            if inner:
                self._refuse_parallel(region)
                self._refuse_inside(region, ("history",))
                for element in region.all("transition"):
                    message = f"a transition out of all states of `{name}` at once"
                    self._refuse(message, element.place, "write it in each of its states")
                chart = self._chart(region, inner)
            else:
                # It is in its one state for ever, whose transitions enter it again.
                chart = self._chart(parallel, [region])
                chart = replace(chart, initial=region.attributes["id"], root=region)
            charts.append(chart)
        if not charts:
            help = "write its states"
            self._notes.error("E0803", "<parallel> has no region", parallel.place, help)
        self._refuse_coupling(charts)
        return tuple(replace(chart, name=chart.root.attributes["id"]) for chart in charts)

    def _refuse_coupling(self, charts: Sequence[Chart]) -> None:
        """Report the transitions of a region that depend on the state of another one."""
        regions = {state.id: c.root.attributes["id"] for c in charts for state in c.states}
        done_events = {f"done.state.{name}": region for name, region in regions.items()}
        done_events |= {f"done.state.{region}": region for region in regions.values()}
        for chart in charts:
            own = chart.root.attributes["id"]
            for element in (transition.element for transition in chart.transitions):
                states = _IN_STATE.findall(element.attributes.get("cond", ""))
                couplings = [(f"In('{name}')", regions.get(name, own), "cond") for name in states]
                events = element.attributes.get("event", "").split()
                couplings += [(event, done_events.get(event, own), "event") for event in events]
                for text, region, attribute in couplings:
                    if region != own:
                        message = f"`{text}` asks for the state of another region, `{region}`"
                        help = f"send an event when `{region}` enters the state, and wait for that"
                        self._refuse(message, element.value_place(attribute), help)

    def _refuse_parallel(self, parent: XmlElement) -> None:
        """Report the parallel states in a chart that has other states, too."""
        for parallel in parent.all("parallel"):
            parallel.use_all()
            names = [f"`{e.attributes['id']}`" for e in parallel.children if e.tag == "state"]
            together = f": {' and '.join(names)} are active at the same time"
            regions = together if len(names) > 1 else ""
            name = parallel.attributes.get("id")
            message = f"{f'`{name}`' if name else 'this'} is a parallel state{regions}"
            self._refuse(message, parallel.place, _APART)

    def _refuse_inside(self, element: XmlElement, tags: tuple[str, ...]) -> None:
        for inner in element.all(*tags):
            inner.use_all()
            message = f"<{inner.tag}> inside <{element.tag}> is not carried over"
            self._refuse(message, inner.place, _FLATTEN)

    def _name_states(self) -> None:
        """Give a name to each state that has none; no transition leads there by one."""
        states = [each for each in self._root.walk() if each.tag in _NAMED]
        known = {element.attributes.get("id", "") for element in states}
        number = 0
        for element in states:
            if element.attributes.get("id", "").strip():
                continue
            number += 1
            while f"state_{number}" in known:
                number += 1
            element.attributes["id"] = f"state_{number}"
            message = f"a <{element.tag}> without `id` is called `state_{number}`"
            self._notes.change(message, element.place)

    def refuse_other_transitions(self) -> None:
        """Report what leads from state to state and is not carried over.

        Dialects of SCXML have elements of their own for it. Without one of them the chart is
        another.
        """
        states = {
            each.attributes.get("id")
            for each in self._root.walk()
            if each.tag in (*_STATES, "parallel")
        }
        unused = (top for top, attribute in self._root.unused() if not attribute)
        for element in (each for top in unused for each in top.walk()):
            is_foreign = element.tag not in _ACTIONS and element.tag != "transition"
            attributes = _TARGETS if is_foreign else ("target",)
            targets = " ".join(element.attributes.get(each, "") for each in attributes).split()
            if element.tag == "transition" or (is_foreign and states.intersection(targets)):
                leads = f" to `{' '.join(targets)}`" if targets else ""
                message = f"<{element.tag}> is a transition{leads} that is not carried over"
                help = (
                    'write `<transition event="..." target="..."/>` in the state that it leads '
                    "out of"
                )
                self._notes.error("E0803", message, element.place, help)

    def _read_state(
        self,
        element: XmlElement,
        parent: str,
        states: list[ChartState],
        histories: list[History],
    ) -> None:
        """Add a state and all that are inside."""
        name, initial = self._notes.need(element, "id"), ""
        inner: list[XmlElement] = []
        transitions = tuple(self._transition(item) for item in element.all("transition"))
        if element.tag == "final":
            self._refuse_inside(element, (*_NAMED, "parallel", "initial"))
            if transitions:
                message = f"a final state has no transitions: `{name}`"
                help = "make it a <state>, or delete the transition"
                self._refuse(message, transitions[0].element.place, help)
        else:
            self._refuse_parallel(element)
            if inner := element.all(*_STATES):
                initial = self._initial(element, inner)
                histories += [self._history(each, name) for each in element.all("history")]
            else:
                self._refuse_inside(element, ("history", "initial"))
        states.append(ChartState(name, parent, initial, transitions, element))
        for each in inner:
            self._read_state(each, name, states, histories)

    def _history(self, element: XmlElement, parent: str) -> History:
        name, default = self._notes.need(element, "id"), _target_in(element)
        if len(default.split()) != 1:
            message = f"history `{name}` does not say where it begins"
            if default:
                message = "a history with several states needs parallel states"
            help = 'write `<transition target="..."/>` in it, with a state'
            self._refuse(message, element.place, help)
        return History(name, parent, element.get("type") == "deep", default, element)

    def _transition(self, element: XmlElement) -> Transition:
        target = element.get("target")
        if len(target.split()) > 1:
            message = "a transition with several targets needs parallel states"
            self._refuse(message, element.value_place("target"), _FLATTEN)
        events, text = tuple(element.get("event").split()), element.get("cond")
        guard: Expr = TRUE
        if text:
            try:
                guard = parse_logic(text)
            except LogicError:  # its structure is not Boolean: one question as a whole
                guard = atom(" ".join(text.split()))
        is_internal = element.get("type") == "internal"
        return Transition(events, guard, target, is_internal, element)

    def _check_names(self, chart: Chart) -> None:
        """Report names that are there twice, and those of no state."""
        known: set[str] = set()
        every: list[ChartState | History] = [*chart.states, *chart.histories]
        for each in every:
            if each.id in known:
                message, place = f"state `{each.id}` is there twice", each.element.value_place("id")
                self._notes.error("E0803", message, place, "rename one of them")
            known.add(each.id)
        if len(known) < len(every):
            return
        help = "correct the initial state"
        self._check_name(chart.initial, chart, chart.root.value_place("initial"), help)
        for state in chart.compound:
            place = state.element.value_place("initial")
            self._check_inside(state.initial, state.id, chart, place, help)
        for history in chart.histories:
            place, help = history.element.place, "name a state inside"
            self._check_inside(history.default, history.parent, chart, place, help)
            if history.default in chart.history:
                message = f"history `{history.id}` begins with another history"
                self._refuse(message, place, "name the state in which it begins")
        for transition in chart.transitions:
            place, help = transition.element.value_place("target"), "declare the state"
            self._check_name(transition.target, chart, place, f"{help}, or correct the name")

    def _check_inside(self, name: str, state: str, chart: Chart, place: Place, help: str) -> None:
        self._check_name(name, chart, place, help)
        found = chart.history.get(name) or chart.state.get(name)
        if found is not None and state not in chart.around(found.parent):
            self._refuse(f"`{name}` is not inside `{state}`", place, help)

    def _check_name(self, name: str, chart: Chart, place: Place, help: str) -> None:
        """Report a name that the chart does not have; what has several is reported elsewhere."""
        if len(name.split()) != 1 or name in chart.state or name in chart.history:
            return
        if name == self._whole:
            message = f"a transition to `{name}`, into all regions at once, is not carried over"
            self._refuse(message, place, "send an event to which each region reacts")
        elif name in self._nested and name not in self._refused:
            message = f"state `{name}` is inside {self._nested[name]}"
            self._refuse(f"{message}: it is active together with others", place, _FLATTEN)
        elif name not in self._refused:
            self._notes.error("E0803", f"there is no state `{name}`", place, help)

    def _check_size(self, chart: Chart) -> None:
        """Report charts with too many rows."""
        total = 0
        for state in chart.atomic:
            around = [chart.state[name] for name in chart.around(state.id)]
            count = sum(len(each.transitions) for each in around)
            total += count
            if count > _MOST_TRANSITIONS:
                message = f"state `{state.id}` has more than {_MOST_TRANSITIONS} transitions"
                self._notes.error("E0017", message, state.element.place, _SPLIT)
        if total > _MOST_ROWS:
            message = f"the states have more than {_MOST_ROWS} transitions"
            self._notes.error("E0017", message, chart.root.place, _SPLIT)


def _initial_target(element: XmlElement) -> str:
    return next((found for each in element.all("initial") if (found := _target_in(each))), "")


def _target_in(element: XmlElement) -> str:
    """Of the transition in an element that has no other."""
    transitions = element.all("transition")
    return transitions[0].get("target") if transitions else ""


def _nested(root: XmlElement) -> Iterator[tuple[str, str]]:
    for parent in root.walk():
        for element in parent.children if parent is not root else ():
            name = element.attributes.get("id")
            if name and element.tag in (*_NAMED, "parallel"):
                above = parent.attributes.get("id")
                yield name, f"`{above}`" if above else f"a <{parent.tag}>"
