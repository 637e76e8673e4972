"""Flat SCXML charts as they are written: states and transitions in document order."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from specc.model.expr import TRUE, Expr
from specc.source import Place
from specc.tools.importers.import_notes import Notes
from specc.tools.importers.logic import LogicError, atom, parse_logic
from specc.tools.importers.markup import XmlElement

NAMESPACE = "http://www.w3.org/2005/07/scxml"
_MOST_TRANSITIONS = 300
"""Of one state: the condition of a row grows with those before it."""
_FLATTEN = "flatten the chart: one state for every combination that can be active"
_APART = f"write a chart for each of them, which becomes an agent, or {_FLATTEN}"
_NESTING = ("state", "parallel", "history", "initial", "final")
_STATES = ("state", "final")
_ACTIONS = ("send", "invoke", "assign", "cancel", "raise", "log", "if", "foreach", "script")
"""Elements of SCXML that do something; a `target` of theirs is no state."""
_LEADS = ("target", "next", "to", "goto")
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


def read_charts(root: XmlElement, notes: Notes) -> tuple[Chart, ...]:
    """The chart of a document; or that of each region, if all of the document is parallel.

    None, with errors in `notes`, if one is not flat or not whole.
    """
    _plain_tags(root)
    root.seen = True
    if root.tag != "scxml":
        message = f"the root is <{root.tag}>, not <scxml>"
        notes.error("E0803", message, root.place, "is this a state chart?")
        return ()
    for attribute in ("version", "xmlns"):
        root.get(attribute)
    _name_states(root, notes)
    tops = [child for child in root.children if child.tag in (*_STATES, "parallel", "history")]
    nested = dict(_nested(root))
    if len(tops) == 1 and tops[0].tag == "parallel":
        charts = _regions(root, tops[0], nested, notes)
    else:
        _refuse_parallel(root, notes)
        _refuse_nesting(root, notes, ("history",))
        charts = (_chart(root, root.all(*_STATES), nested, notes),)
    _refuse_other_transitions(root, notes)
    return () if notes.failed else charts


def _chart(
    root: XmlElement, elements: list[XmlElement], nested: Mapping[str, str], notes: Notes
) -> Chart:
    states = [_state(element, notes) for element in elements]
    initial = root.get("initial") or (_initial_element(root) or (states[0].id if states else ""))
    refused = [each for each in root.children if each.tag in ("parallel", "history")]
    if not states and not refused:
        message = "the chart has no state"
        notes.error("E0804", message, root.place, 'write `<state id="..."/>`')
    known = {each.attributes.get("id", "") for each in refused}
    _check_names(states, initial, root, nested, known, notes)
    return Chart(root.get("name") or "", tuple(states), initial, root)


def _regions(
    root: XmlElement, parallel: XmlElement, nested: Mapping[str, str], notes: Notes
) -> tuple[Chart, ...]:
    """A chart for each region of a document that is parallel as a whole."""
    parallel.seen = True
    own = parallel.get("id")
    if (root.get("initial") or _initial_element(root) or own) != own:
        message = "the initial states of regions are not carried over from here"
        place = root.value_place("initial")
        notes.error("E0808", message, place, "name each in its region, `<state initial=...>`")
    _refuse_nesting(parallel, notes, ("parallel", "history", "final"))
    for element in parallel.all("transition"):
        message = "a transition out of all regions at once is not carried over"
        notes.error("E0808", message, element.place, _FLATTEN)
    message = "the regions become agents, which get the same events"
    notes.changed(message, parallel.place)
    charts = []
    for region in parallel.all("state"):
        region.get("id")
        inner = region.all(*_STATES)
        if not inner:
            # It is in its one state for ever, whose transitions enter it again.
            charts.append(_chart(parallel, [region], nested, notes))
            charts[-1] = replace(charts[-1], initial=region.attributes["id"], root=region)
            continue
        _refuse_parallel(region, notes)
        _refuse_nesting(region, notes, ("history",))
        for element in region.all("transition"):
            message = f"a transition out of all states of `{region.attributes['id']}` at once"
            notes.error("E0808", message, element.place, "write it in each of its states")
        charts.append(_chart(region, inner, nested, notes))
    if not charts:
        notes.error("E0804", "<parallel> has no region", parallel.place, "write its states")
    _refuse_coupling(charts, notes)
    return tuple(replace(c, name=c.root.attributes["id"]) for c in charts)


def _refuse_coupling(charts: Sequence[Chart], notes: Notes) -> None:
    """Report the transitions of a region that depend on the state of another one."""
    region_of = {
        state.id: chart.root.attributes["id"] for chart in charts for state in chart.states
    }
    done = {f"done.state.{region}": region for region in region_of.values()}
    for chart in charts:
        own = chart.root.attributes["id"]
        for element in (t.element for state in chart.states for t in state.transitions):
            named = _IN_STATE.findall(element.attributes.get("cond", ""))
            couplings = [(f"In('{name}')", region_of.get(name, own), "cond") for name in named]
            events = element.attributes.get("event", "").split()
            couplings += [(event, done.get(event, own), "event") for event in events]
            for text, region, attribute in couplings:
                if region != own:
                    message = f"`{text}` asks for the state of another region, `{region}`"
                    help = f"send an event when `{region}` enters the state, and wait for that"
                    notes.error("E0808", message, element.value_place(attribute), help)


def _refuse_parallel(parent: XmlElement, notes: Notes) -> None:
    """Report the parallel states in a chart that has other states, too."""
    for parallel in parent.all("parallel"):
        parallel.take_whole()
        named = [f"`{each.attributes['id']}`" for each in parallel.children if each.tag == "state"]
        regions = f": {' and '.join(named)} are active at the same time" if named else ""
        name = parallel.attributes.get("id")
        message = f"{f'`{name}`' if name else 'this'} is a parallel state{regions}"
        notes.error("E0808", message, parallel.place, _APART)


def _name_states(root: XmlElement, notes: Notes) -> None:
    """Give a name to each state that has none; no transition leads there by one."""
    every = [element for element in _below(root) if element.tag in _STATES]
    known = {element.attributes.get("id", "") for element in every}
    number = 0
    for element in every:
        if element.attributes.get("id", "").strip():
            continue
        number += 1
        while f"state_{number}" in known:
            number += 1
        element.attributes["id"] = f"state_{number}"
        message = f"a <{element.tag}> without `id` is called `state_{number}`"
        notes.changed(message, element.place)


def _refuse_other_transitions(root: XmlElement, notes: Notes) -> None:
    """Report what leads from state to state and is not carried over.

    Dialects of SCXML have elements of their own for it. Without one of them the chart is another.
    """
    states = {e.attributes.get("id") for e in _below(root) if e.tag in (*_STATES, "parallel")}
    left = (each for top, attribute in root.untaken() if not attribute for each in _with(top))
    for element in left:
        is_foreign = element.tag not in _ACTIONS and element.tag != "transition"
        attributes = _LEADS if is_foreign else ("target",)
        named = " ".join(element.attributes.get(each, "") for each in attributes)
        targets = named.split()
        if element.tag == "transition" or (is_foreign and states.intersection(targets)):
            what = f" to `{' '.join(targets)}`" if targets else ""
            message = f"<{element.tag}> is a transition{what} that is not carried over"
            help = (
                'write `<transition event="..." target="..."/>` in the state that it leads out of'
            )
            notes.error("E0809", message, element.place, help)


def _with(top: XmlElement) -> Iterator[XmlElement]:
    yield top
    yield from _below(top)


def _below(top: XmlElement) -> Iterator[XmlElement]:
    """All elements in another one, in the order of the document."""
    for child in top.children:
        yield from _with(child)


def _plain_tags(element: XmlElement) -> None:
    """Tags of the namespace of SCXML without it; others keep theirs."""
    space, _, tag = element.tag.rpartition(" ")
    element.tag = tag if space in ("", NAMESPACE) else f"{space}:{tag}"
    for child in element.children:
        _plain_tags(child)


def _initial_element(root: XmlElement) -> str:
    for element in root.all("initial"):
        for transition in element.all("transition"):
            return transition.get("target") or ""
    return ""


def _state(element: XmlElement, notes: Notes) -> ChartState:
    name = notes.need(element, "id")
    _refuse_nesting(element, notes, _NESTING)
    transitions = tuple(_transition(item, notes) for item in element.all("transition"))
    if len(transitions) > _MOST_TRANSITIONS:
        message = f"state `{name}` has more than {_MOST_TRANSITIONS} transitions"
        place = transitions[_MOST_TRANSITIONS].element.place
        notes.error(
            "E0017",
            message,
            place,
            "split the state: the condition of each row also tests all rows before it",
        )
    if element.tag == "final" and transitions:
        message = f"a final state has no transitions: `{name}`"
        place = transitions[0].element.place
        notes.error("E0808", message, place, "make it a <state>, or delete the transition")
    return ChartState(name, transitions, element)


def _refuse_nesting(element: XmlElement, notes: Notes, tags: tuple[str, ...]) -> None:
    for inner in element.all(*tags):
        inner.take_whole()
        message = f"<{inner.tag}> inside <{element.tag}>: only flat charts can be imported"
        notes.error("E0808", message, inner.place, _FLATTEN)


def _transition(element: XmlElement, notes: Notes) -> Transition:
    target = element.get("target") or ""
    if len(target.split()) > 1:
        message = "a transition with several targets needs parallel states"
        notes.error("E0808", message, element.value_place("target"), _FLATTEN)
    events = tuple((element.get("event") or "").split())
    return Transition(events, _guard(element), target, element)


def _guard(element: XmlElement) -> Expr:
    """The condition; a text whose structure is not Boolean is one question as a whole."""
    text = element.get("cond")
    if not text:
        return TRUE
    try:
        return parse_logic(text)
    except LogicError:
        return atom(" ".join(text.split()))


def _nested(root: XmlElement) -> Iterator[tuple[str, str]]:
    """The states inside others, each with the words for the one that it is in."""
    open_ = [(child, root) for child in root.children]
    while open_:
        element, parent = open_.pop()
        name = element.attributes.get("id")
        if name and parent is not root and element.tag in _NESTING:
            above = parent.attributes.get("id")
            yield name, f"`{above}`" if above else f"a <{parent.tag}>"
        open_ += [(child, element) for child in element.children]


def _check_names(
    states: list[ChartState],
    initial: str,
    root: XmlElement,
    nested: Mapping[str, str],
    refused: Collection[str],
    notes: Notes,
) -> None:
    """Report names that are there twice, and those of no state; of what is `refused`, nothing."""
    known: set[str] = set(refused)
    for state in states:
        if state.id in known:
            place = state.element.value_place("id")
            notes.error("E0806", f"state `{state.id}` is there twice", place, "rename one of them")
        known.add(state.id)
    if states and initial and initial not in known:
        help = "correct the initial state"
        _unknown(initial, root.value_place("initial"), nested, help, notes)
    for state in states:
        for transition in state.transitions:
            target, element = transition.target, transition.element
            if target and target not in known and len(target.split()) == 1:
                help = "declare the state, or correct the name"
                _unknown(target, element.value_place("target"), nested, help, notes)


def _unknown(name: str, place: Place, nested: Mapping[str, str], help: str, notes: Notes) -> None:
    """Report a name that no state of the flat chart has."""
    if name in nested:
        message = f"state `{name}` is inside {nested[name]}: nested states are not carried over"
        notes.error("E0808", message, place, _FLATTEN)
    else:
        notes.error("E0805", f"there is no state `{name}`", place, help)
