"""`specc import scxml`: a state chart, or each region of a parallel one, becomes an agent.

Compound states become modes. In SCXML an inner transition comes before an outer one; rows have no
order, so that those of modes say for each state that none inside applies.

The text is `templates/import/scxml.yaml.j2`.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from specc.lang.packages import PACKAGES
from specc.model.expr import FALSE, TRUE, Expr, negation
from specc.model.fsm import NEVER_LEFT
from specc.reachable import grouped
from specc.source import Place
from specc.tools.importers.logic import atom, atoms, join, render
from specc.tools.importers.reading import Notes, XmlElement
from specc.tools.importers.scxml_reader import (
    Chart,
    ChartState,
    History,
    Transition,
    read_charts,
)
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
    **{(tag, ""): _CONTENT for tag in _CONTENT_TAGS.split()},
}
_ANY = "*"
_DEEPEST = 16
"""Parts of an event that another one may name a beginning of."""
_EVENTS = "\0"
"""Begins the text of an atom that stands for events; their names follow."""
_DONE = "\1"
"""The text of the atom that is true while the `done` event of a final state waits."""


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
    done = {f"done.state.{state.id}" for chart in charts for state in chart.compound}
    named = [d for chart in charts for t in chart.transitions for d in t.events]
    events = Events(d for d in named if _plain(d) not in done)
    guards, names = GuardInputs(events.members), SpecNames((*PEERS, _OUTSIDE))
    agents = [
        _ChartAgent(each, names.of(each.name) if len(charts) > 1 else own, events, guards, notes)
        for each in charts
    ]
    for agent in agents:
        agent.build()
    if notes.failed:
        return notes
    place = charts[0].root.place
    for old, new in events.renamed.items():
        notes.change(f"event `{old}` is called `{new}`", place)
    if any(not t.events for chart in charts for t in chart.transitions):
        message = "a transition without an event is taken one period after the state began"
        notes.change(message, place)
    if any(agent.is_done for agent in agents):
        notes.change("`done.state` comes one period after the final state began", place)
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


@dataclass(frozen=True, slots=True)
class _Choice:
    """A transition that a state may take, in the order in which SCXML looks at them.

    `members` are the events that it reacts to, None if it needs none: then the question whether a
    `done` event waits is part of its `guard`. `when` says that it is taken, and none before it.
    """

    state: ChartState
    transition: Transition
    guard: Expr
    members: frozenset[str] | None
    when: Expr
    next: _Next | None
    """None where it only takes its event."""


@dataclass(frozen=True, slots=True)
class _Next:
    """A state, an atomic or a compound one, which is resumed if a history led there."""

    state: str
    history: History | None = None


class _ChartAgent:
    """The agent of a chart; what it needs from outside is known once it is built."""

    def __init__(
        self, chart: Chart, name: str, events: Events, guards: GuardInputs, notes: Notes
    ) -> None:
        self._chart, self.name, self.title = chart, name, chart.name
        self._events, self._all_guards, self._notes = events, guards, notes
        self._state_names = SpecNames((NEVER_LEFT,) if chart.compound else ())
        self.guards: dict[str, str] = {}
        self._lets = SpecNames(events.members)
        self.let: dict[str, Data] = {}
        self._tests: dict[frozenset[str], str] = {}
        self.conditions: dict[str, dict[str, Data]] = {"initial": {}, "terminal": {}}
        self._condition_names = SpecNames(("always", "never"))
        self._known_conditions: dict[tuple[str, str], str] = {}
        self.done = ""
        """The memory element that says whether a `done` event waits; "" if nothing asks."""

    def build(self) -> None:
        """Build states, behaviours and rows; report what was renamed or behaves differently."""
        chart = self._chart
        for state in chart.states:
            self._state_names.of(state.id)
        self._starts = {state.id: self._start(state) for state in chart.compound}
        self._choices = {state.id: self._choices_of(state) for state in chart.atomic}
        self._check_shallow_histories()
        self._check_waiting_done_events()
        self._report_never_taken()
        if self._notes.failed:
            return
        self.states = {self._state_names.of(s.id): self._end(s) for s in chart.atomic}
        """State -> the terminal condition of its behaviour."""
        self.transitions: list[Data] = [*self._rows()]
        is_alone = not self.inputs
        self.functions = {
            self._state_names.of(s.id): [*self._functions(s.id, is_alone)] for s in chart.atomic
        }
        self.modes: dict[str, Data] = {
            self._state_names.of(state.id): self._mode(state) for state in chart.compound
        }
        self.conditions = {kind: named for kind, named in self.conditions.items() if named}
        self.initial = self._state_names.of(chart.first(chart.initial))
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
            if state.element.tag == "final" and not state.parent:
                message = f"the chart stops in `{state.id}`; the agent stays there"
                self._notes.change(message, state.element.place)

    @property
    def inputs(self) -> tuple[str, ...]:
        """What it needs from outside; a chart that needs nothing tells its state there."""
        has_events = any(self._events.matching(t.events) for t in self._chart.transitions)
        return (*(["event"] if has_events else []), *self.guards.values())

    @property
    def state_type(self) -> str:
        """The name of the type of its state."""
        return SpecNames((*self.states, "Event")).of(f"State_{self.name}")

    @property
    def is_done(self) -> bool:
        """Whether a `done` event leads anywhere."""
        every = (choice for choices in self._choices.values() for choice in choices)
        return any(c.members is None and c.transition.events for c in every)

    def _atom(self, text: str) -> str:
        """A let for events, an input for a guard, memory for the `done` event."""
        if text == _DONE:
            self.done = self.done or self._lets.new("done")
            return self.done
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

    # What a state may do.

    def _choices_of(self, state: ChartState) -> list[_Choice]:
        """What an atomic state may do, in the order in which SCXML looks at it.

        SCXML takes the first transition whose event and guard fit, in document order, of the state
        or else of those around it, from the inner to the outer ones: without an event first, then
        for a `done` event, then for one from outside.
        """
        chart = self._chart
        around = [chart.state[name] for name in chart.around(state.id)]
        every = [(source, transition) for source in around for transition in source.transitions]
        done = [(s, t) for s, t in every if _is_done_event(t, state)]
        is_left = all(t.target for _, t in done) and any(t.guard == TRUE for _, t in done)
        waits = TRUE if is_left else atom(_DONE)
        found = [
            *((s, t, t.guard, None) for s, t in every if not t.events),
            *((s, t, join("and", (waits, t.guard)), None) for s, t in done),
            *((s, t, t.guard, m) for s, t in every if (m := self._events.matching(t.events))),
        ]
        choices: list[_Choice] = []
        for source, transition, guard, members in found:
            earlier = [(choice.guard, choice.members) for choice in choices]
            when = _row_condition(guard, members, earlier)
            next = None
            if transition.target:
                domain = self._domain(source, transition)
                next = self._led_to(state.id, transition.target, domain, transition.element)
            elif source is state:
                next = _Next(state.id)
            choices.append(_Choice(source, transition, guard, members, when, next))
        return choices

    def _domain(self, source: ChartState, transition: Transition) -> list[str]:
        """The states around a transition that it does not leave; SCXML names the innermost one."""
        chart = self._chart
        history = chart.history.get(transition.target)
        above = chart.around(history.parent) if history else chart.around(transition.target)[1:]
        around = chart.around(source.id)
        if not (transition.is_internal and source.initial):
            del around[0]
        return [name for name in around if name in above]

    def _led_to(self, state: str, target: str, domain: Sequence[str], element: XmlElement) -> _Next:
        """Where a target leads from an atomic state, if all around it but `domain` is left.

        The history of a state that is just left is where it was: no row has to resume it.
        """
        around = self._chart.around(state)
        while True:
            history = self._chart.history.get(target)
            if history is None:
                if not self._begins_with_history(target):
                    return _Next(target)
                target = self._chart.state[target].initial
            elif history.parent not in around:
                return _Next(history.parent, history)
            elif history.parent in domain:
                message = f"`{target}` is a history of `{history.parent}`, which is not left here"
                help = "a mode is resumed from outside; name a state, or the history of one inside"
                self._refuse(message, element.value_place("target"), help)
                return _Next(state)
            elif history.is_deep:
                return _Next(state)
            else:
                target = around[around.index(history.parent) - 1]

    def _begins_with_history(self, name: str) -> bool:
        """Whether entering a state goes through a history inside."""
        while name not in self._chart.history:
            name = self._chart.state[name].initial
            if not name:
                return False
        return True

    def _start(self, state: ChartState) -> str:
        """The atomic state in which the mode of a compound state begins.

        `resume` leads there if the mode was never left.
        """
        chart = self._chart
        named = {transition.target for transition in chart.transitions}
        named |= {each.initial for each in chart.compound}
        own = [h for h in chart.histories if h.parent == state.id and h.id in named]
        starts = dict.fromkeys(chart.first(history.id) for history in own)
        if len(starts) > 1:
            names = " and ".join(f"`{name}`" for name in starts)
            message = f"the histories of `{state.id}` begin in different states, {names}"
            help = "a mode has one initial state: let both begin in the same one"
            self._refuse(message, own[1].element.place, help)
        return next(iter(starts), chart.first(state.id))

    def _check_shallow_histories(self) -> None:
        """Report those that lead elsewhere than to the innermost state that was left."""
        chart = self._chart
        every = [choice for choices in self._choices.values() for choice in choices]
        resumed = [choice.next.history for choice in every if choice.next]
        for history in dict.fromkeys(each for each in resumed if each and not each.is_deep):
            for state in chart.inside[history.parent]:
                around = chart.around(state)
                inner = around[around.index(history.parent) - 1]
                next = self._led_to(state, inner, (), history.element)
                first = chart.first(next.state)
                if first != state and self._leaves(state, history.parent):
                    message = (
                        f"`{history.id}` is a shallow history: where `{history.parent}` was left "
                        f"in `{state}` it leads to `{first}`, and `resume` to `{state}`"
                    )
                    help = f'write `type="deep"` if that may be, or flatten `{inner}`'
                    self._refuse(message, history.element.place, help)
                    break

    def _leaves(self, state: str, compound: str) -> bool:
        """Whether some transition of an atomic state leads out of a state around it."""
        return any(
            choice.when != FALSE
            and choice.next is not None
            and compound not in self._chart.around(choice.next.state)
            for choice in self._choices[state]
        )

    def _check_waiting_done_events(self) -> None:
        """Report `done` events that another state may take.

        Transitions without an event come first; the `done` event waits until there is none.
        """
        chart = self._chart
        for final in filter(_raises_done, chart.atomic):
            reached = self._reached_without_events(final.id) - {final.id}
            for name in sorted(reached):
                around = [chart.state[each] for each in chart.around(name)]
                for transition in (t for each in around for t in each.transitions):
                    if _is_done_event(transition, final):
                        message = (
                            f"`done.state.{final.parent}` may come in `{name}`, after a transition "
                            f"without an event out of `{final.id}`"
                        )
                        help = "let the transition without an event wait for one"
                        self._refuse(message, transition.element.value_place("event"), help)

    def _reached_without_events(self, name: str) -> set[str]:
        """The atomic states to which transitions without events lead from one, itself included."""
        chart, reached, new = self._chart, {name}, [name]
        while new:
            for choice in self._choices[new.pop()]:
                if choice.transition.events or choice.when == FALSE or choice.next is None:
                    continue
                state = choice.next.state
                found = chart.inside[state] if choice.next.history else [chart.first(state)]
                new += [each for each in found if each not in reached]
                reached.update(found)
        return reached

    def _report_never_taken(self) -> None:
        every = (choice for choices in self._choices.values() for choice in choices)
        conditions = grouped((id(choice.transition), choice.when) for choice in every)
        for transition in self._chart.transitions:
            found = conditions.get(id(transition), [])
            if not found:
                message = "this transition is never taken: no final state raises its event"
                self._notes.change(message, transition.element.place)
            elif all(when == FALSE for when in found):
                message = "this transition is never taken: an earlier one always is"
                self._notes.change(message, transition.element.place)

    def _refuse(self, message: str, place: Place, help: str) -> None:
        if all(
            (each.message, each.primary) != (message, place) for each in self._notes.diagnostics
        ):
            self._notes.error("E0803", message, place, help)

    # What the specification has.

    def _end(self, state: ChartState) -> str:
        """The condition under which some transition of an atomic state is taken."""
        choices = [c for c in self._choices[state.id] if c.when != FALSE or c.state is state]
        if not any(choice.next for choice in choices):
            return "never"
        if all(choice.next for choice in choices):
            conditions = [_fits(choice) for choice in choices]
        else:
            conditions = [choice.when for choice in choices if choice.next]
        text = render(join("or", conditions), self._atom)
        sources = {choice.state.id for choice in choices}
        source = next(name for name in self._chart.around(state.id) if name in sources)
        return self._condition("terminal", text, f"{source}_left")

    def _functions(self, state: str, is_alone: bool) -> Iterator[str]:
        """What tells the state to the outside, and what notes that its `done` event waits."""
        if is_alone:
            yield f"tell_{self._state_names.of(state)}"
        conditions = [choice.when for choice in self._choices[state] if choice.next]
        if any(part.name == _DONE for when in conditions for part in atoms(when)):
            yield "note_done"

    def _rows(self) -> Iterator[list[Data]]:
        """A row for each transition and the states in which it applies under the same condition.

        Rows have no order, so a row says that no transition applies which comes before.
        """
        order = {state.id: index for index, state in enumerate(self._chart.states)}
        found: dict[tuple[int, int, str, str], list[str]] = {}
        reported: set[int] = set()
        for name, choices in self._choices.items():
            for choice in choices:
                transition = choice.transition
                if not transition.target and id(transition) not in reported:
                    reported.add(id(transition))
                    message = f"a transition without a target enters `{name}` again"
                    if choice.next is None:
                        message = "a transition without a target only takes its event"
                    self._notes.change(message, transition.element.place)
                if choice.next is None or (choice.when == FALSE and choice.state.id != name):
                    continue
                text = "False" if choice.when == FALSE else render(choice.when, self._atom)
                wish = f"{choice.state.id}_to_{transition.target or name}"
                condition = self._condition("initial", text, wish)
                row = order[choice.state.id], id(transition), condition, self._target(choice.next)
                found.setdefault(row, []).append(name)
        for row in sorted(found, key=lambda row: row[0]):
            sources = self._cover(found[row])
            yield [sources[0] if len(sources) == 1 else sources, "terminal", row[2], row[3]]

    def _cover(self, names: Sequence[str]) -> list[str]:
        """The modes and states that stand for some atomic ones."""
        chart = self._chart
        counts = Counter(around for name in names for around in chart.around(name))
        whole = {name for name, count in counts.items() if count == len(chart.inside[name])}
        found = ([each for each in chart.around(name) if each in whole][-1] for name in names)
        return [self._state_names.of(name) for name in dict.fromkeys(found)]

    def _target(self, next: _Next) -> str:
        if next.history:
            return f"resume({self._state_names.of(next.state)})"
        return self._entered(next.state)

    def _entered(self, state: str) -> str:
        """The name by which a row enters a state; that of a mode if it begins in the same state."""
        first = self._chart.first(state)
        return self._state_names.of(state if self._starts.get(state, first) == first else first)

    def _mode(self, state: ChartState) -> Data:
        inner = [each.id for each in self._chart.states if each.parent == state.id]
        start = self._starts[state.id]
        begins_so = start == self._chart.first(state.initial) and state.initial in inner
        return {
            "states": [self._state_names.of(name) for name in inner],
            "initial": self._entered(state.initial if begins_so else start),
        }

    def _condition(self, kind: str, text: str, wish: str) -> str:
        if text == "True":
            return "always"
        key = kind, text
        if key not in self._known_conditions:
            self._known_conditions[key] = self._condition_names.new(wish)
            self.conditions[kind][self._known_conditions[key]] = text
        return self._known_conditions[key]


def _raises_done(state: ChartState) -> bool:
    return state.element.tag == "final" and state.parent != ""


def _is_done_event(transition: Transition, state: ChartState) -> bool:
    """Whether a transition reacts to the event that an atomic state raises when it begins."""
    event = f"done.state.{state.parent}."
    plain = map(_plain, transition.events)
    return _raises_done(state) and any(p == _ANY or event.startswith(f"{p}.") for p in plain)


def _fits(choice: _Choice) -> Expr:
    """Whether event and guard of a transition fit."""
    if choice.members is None:
        return choice.guard
    return join("and", (_event_test(choice.members), choice.guard))


def _row_condition(
    guard: Expr,
    matching: frozenset[str] | None,
    earlier: Sequence[tuple[Expr, frozenset[str] | None]],
) -> Expr:
    """When a transition is taken; events that transitions match are None for any."""
    if matching is None:
        return join("and", (guard, *(negation(other) for other, _ in earlier)))
    parts = [guard]
    for other, theirs in earlier:
        common = matching if theirs is None else matching & theirs
        if theirs is not None and not common:
            continue
        if other == TRUE:
            matching -= common
        elif common == matching:
            parts.append(negation(other))
        else:
            parts.append(negation(join("and", (_event_test(common), other))))
    return join("and", (_event_test(matching), *parts)) if matching else FALSE
