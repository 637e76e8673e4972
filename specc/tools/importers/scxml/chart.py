"""A flat SCXML chart as it is written: states and transitions in document order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from specc.frozen import frozen
from specc.model.expr import TRUE, Expr
from specc.source import Place
from specc.tools.importers.import_notes import Notes
from specc.tools.importers.logic import LogicError, atom, parse_logic
from specc.tools.importers.markup import XmlElement

NAMESPACE = "http://www.w3.org/2005/07/scxml"
_MOST_TRANSITIONS = 300
"""Of one state: the condition of a row grows with those before it."""
_FLATTEN = "flatten the chart: one state for every combination that can be active"
_NESTING = ("state", "parallel", "history", "initial", "final")


@frozen
class Transition:
    """A transition; no `events` means that it needs none, no `target` that the state stays."""

    events: tuple[str, ...]
    guard: Expr
    target: str
    element: XmlElement


@frozen
class ChartState:
    """A state; a final one has no transitions."""

    id: str
    transitions: tuple[Transition, ...]
    element: XmlElement


@frozen
class Chart:
    """States in document order."""

    name: str
    states: tuple[ChartState, ...]
    initial: str
    root: XmlElement


def read_chart(root: XmlElement, notes: Notes) -> Chart | None:
    """The chart of a document; None, with errors in `notes`, if it is not flat or not whole."""
    _plain_tags(root)
    root.seen = True
    if root.tag != "scxml":
        message = f"the root is <{root.tag}>, not <scxml>"
        notes.error("E0803", message, root.place, "is this a state chart?")
        return None
    for attribute in ("version", "xmlns"):
        root.get(attribute)
    states = [_state(element, notes) for element in root.all("state", "final")]
    _refuse_nesting(root, notes, ("parallel", "history"))
    initial = root.get("initial") or (_initial_element(root) or (states[0].id if states else ""))
    if not states:
        message = "the chart has no state"
        notes.error("E0804", message, root.place, 'write `<state id="..."/>`')
    _check_names(states, initial, root, dict(_nested(root)), notes)
    if notes.failed:
        return None
    return Chart(root.get("name") or "", tuple(states), initial, root)


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
    notes: Notes,
) -> None:
    known: set[str] = set()
    for state in states:
        if state.id in known:
            place = state.element.value_place("id")
            notes.error("E0806", f"state `{state.id}` is there twice", place, "rename one of them")
        known.add(state.id)
    if states and initial not in known:
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
