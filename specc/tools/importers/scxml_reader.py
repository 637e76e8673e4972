"""Flat SCXML charts as they are written: states and transitions in document order."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from specc.model.expr import TRUE, Expr
from specc.source import Place
from specc.tools.importers.logic import LogicError, atom, parse_logic
from specc.tools.importers.reading import Notes, XmlElement

NAMESPACE = "http://www.w3.org/2005/07/scxml"
_MOST_TRANSITIONS = 300
"""Of one state: the condition of a row grows with those before it."""
_FLATTEN = "flatten the chart: one state for every combination that can be active"
_APART = f"write a chart for each of them, which becomes an agent, or {_FLATTEN}"
_NESTING = ("state", "parallel", "history", "initial", "final")
_STATES = ("state", "final")
_ACTIONS = ("send", "invoke", "assign", "cancel", "raise", "log", "if", "foreach", "script")
"""Elements of SCXML that do something; a `target` of theirs is no state."""
_TARGETS = ("target", "next", "to", "goto")
"""Attributes by which elements of dialects name the state that they lead to."""
_IN_STATE = re.compile(r"\bIn\(\s*['\"]([^'\"]+)['\"]\s*\)")


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition; no `events` means that it needs none, no `target` that the state stays."""

    events: tuple[str, ...]
    guard: Expr
    target: str
    element: XmlElement


@dataclass(frozen=True, slots=True)
class ChartState:
    """A state; a final one has no transitions."""

    id: str
    transitions: tuple[Transition, ...]
    element: XmlElement


@dataclass(frozen=True, slots=True)
class Chart:
    """States in document order; `root` is the document, or the region that the chart is of."""

    name: str
    states: tuple[ChartState, ...]
    initial: str
    root: XmlElement

    @property
    def transitions(self) -> list[Transition]:
        """Those of all states."""
        return [transition for state in self.states for transition in state.transitions]


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
        """States inside others, which no chart has -> the words for the one that they are in."""

    def read(self) -> tuple[Chart, ...]:
        root = self._root
        tops = [child for child in root.children if child.tag in (*_STATES, "parallel", "history")]
        if len(tops) == 1 and tops[0].tag == "parallel":
            return self._regions(tops[0])
        self._refuse_parallel(root)
        self._refuse_nesting(root, ("history",))
        return (self._chart(root, root.all(*_STATES)),)

    def _refuse(self, message: str, place: Place, help: str) -> None:
        self._notes.error("E0803", message, place, help)

    def _chart(self, root: XmlElement, elements: list[XmlElement]) -> Chart:
        states = [self._state(element) for element in elements]
        initial = root.get("initial") or _initial_target(root) or (states[0].id if states else "")
        refused = [each for each in root.children if each.tag in ("parallel", "history")]
        if not states and not refused:
            help = 'write `<state id="..."/>`'
            self._notes.error("E0803", "the chart has no state", root.place, help)
        known = {each.attributes.get("id", "") for each in refused}
        self._check_names(states, initial, root, known)
        return Chart(root.get("name"), tuple(states), initial, root)

    def _regions(self, parallel: XmlElement) -> tuple[Chart, ...]:
        """A chart for each region of a document that is parallel as a whole."""
        root = self._root
        parallel.used = True
        own = parallel.get("id")
        if (root.get("initial") or _initial_target(root) or own) != own:
            message = "the initial states of regions are not carried over from here"
            help = "name each in its region, `<state initial=...>`"
            self._refuse(message, root.value_place("initial"), help)
        self._refuse_nesting(parallel, ("parallel", "history", "final"))
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
                self._refuse_nesting(region, ("history",))
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
        done_events = {f"done.state.{region}": region for region in regions.values()}
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
            regions = f": {' and '.join(names)} are active at the same time" if names else ""
            name = parallel.attributes.get("id")
            message = f"{f'`{name}`' if name else 'this'} is a parallel state{regions}"
            self._refuse(message, parallel.place, _APART)

    def _refuse_nesting(self, element: XmlElement, tags: tuple[str, ...]) -> None:
        for inner in element.all(*tags):
            inner.use_all()
            message = f"<{inner.tag}> inside <{element.tag}>: only flat charts can be imported"
            self._refuse(message, inner.place, _FLATTEN)

    def _name_states(self) -> None:
        """Give a name to each state that has none; no transition leads there by one."""
        states = [each for each in self._root.walk() if each.tag in _STATES]
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

    def _state(self, element: XmlElement) -> ChartState:
        name = self._notes.need(element, "id")
        self._refuse_nesting(element, _NESTING)
        transitions = tuple(self._transition(item) for item in element.all("transition"))
        if len(transitions) > _MOST_TRANSITIONS:
            message = f"state `{name}` has more than {_MOST_TRANSITIONS} transitions"
            place = transitions[_MOST_TRANSITIONS].element.place
            help = "split the state: the condition of each row also tests all rows before it"
            self._notes.error("E0017", message, place, help)
        if element.tag == "final" and transitions:
            message = f"a final state has no transitions: `{name}`"
            help = "make it a <state>, or delete the transition"
            self._refuse(message, transitions[0].element.place, help)
        return ChartState(name, transitions, element)

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
        return Transition(events, guard, target, element)

    def _check_names(
        self, states: list[ChartState], initial: str, root: XmlElement, refused: Collection[str]
    ) -> None:
        """Report names that are there twice, and those of no state; of what is `refused`, none."""
        known = set(refused)
        for state in states:
            if state.id in known:
                message, place = f"state `{state.id}` is there twice", state.element
                self._notes.error("E0803", message, place.value_place("id"), "rename one of them")
            known.add(state.id)
        if states and initial and initial not in known:
            self._unknown(initial, root.value_place("initial"), "correct the initial state")
        for transition in (each for state in states for each in state.transitions):
            target, element = transition.target, transition.element
            if target and target not in known and len(target.split()) == 1:
                help = "declare the state, or correct the name"
                self._unknown(target, element.value_place("target"), help)

    def _unknown(self, name: str, place: Place, help: str) -> None:
        """Report a name that no state of the flat chart has."""
        if name in self._nested:
            where = f"inside {self._nested[name]}: nested states are not carried over"
            self._refuse(f"state `{name}` is {where}", place, _FLATTEN)
        else:
            self._notes.error("E0803", f"there is no state `{name}`", place, help)


def _initial_target(root: XmlElement) -> str:
    transitions = [each for element in root.all("initial") for each in element.all("transition")]
    return transitions[0].get("target") if transitions else ""


def _nested(root: XmlElement) -> Iterator[tuple[str, str]]:
    for parent in root.walk():
        for element in parent.children if parent is not root else ():
            name = element.attributes.get("id")
            if name and element.tag in _NESTING:
                above = parent.attributes.get("id")
                yield name, f"`{above}`" if above else f"a <{parent.tag}>"
