"""State charts in a short notation, and an interpreter of SCXML that judges what is imported.

A line is a state, indented below the one that it is in:

    work                     a state, compound if others are in it
    initial first            the attribute of the state that the line is in
    start -> first           the same as the element <initial>
    final end                a final state
    history h -> first       a shallow history with its default; `deep h -> first` is a deep one
    go stop if p -> rest     a transition; without target, event or guard these are left out
    go => first              an internal transition
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import count
from random import Random
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

HISTORIES = {"history": "shallow", "deep": "deep"}
STATES = ("state", "final", "parallel")
MOST_STEPS = 50
"""Of one reaction; a chart that takes more goes on for ever."""


def xml(chart: str) -> str:
    """The document that a chart in the short notation stands for."""
    root = Element("scxml", version="1.0")
    above = [(-1, root)]
    for line in filter(str.strip, chart.splitlines()):
        depth = len(line) - len(line.lstrip())
        while above[-1][0] >= depth:
            above.pop()
        above.append((depth, _element(above[-1][1], line.split())))
    return tostring(root, encoding="unicode")


def _element(parent: Element, words: list[str]) -> Element:
    first, *others = words
    arrow = next((word for word in words if word in ("->", "=>")), "")
    if first in HISTORIES and others:
        made = SubElement(parent, "history", id=others[0], type=HISTORIES[first])
        return _with_target(made, others[2:])
    if first == "start" and arrow:
        return _with_target(SubElement(parent, "initial"), others[1:])
    if first == "initial":
        parent.set("initial", " ".join(others))
        return parent
    if not arrow:
        tag = first if first in STATES else "state"
        return SubElement(parent, tag, id=words[-1])
    made = SubElement(parent, "transition")
    before, after = words[: words.index(arrow)], words[words.index(arrow) + 1 :]
    events, _, guard = " ".join(before).partition("if ")
    found = {"event": events.strip(), "cond": guard, "target": " ".join(after)}
    found["type"] = "internal" if arrow == "=>" else ""
    made.attrib.update({name: value for name, value in found.items() if value})
    return made


def _with_target(element: Element, targets: list[str]) -> Element:
    if targets:
        SubElement(element, "transition", target=" ".join(targets))
    return element


class EndlessError(Exception):
    """Transitions without events lead on and on."""


class Interpreter:
    """A chart that runs as appendix D of the recommendation says, without parallel states and data.

    The procedures have the names of the appendix. A guard is a formula over names, whose truth
    `answers` has; transitions without events are looked at again whenever that changes.
    """

    def __init__(self, text: str) -> None:
        self.answers: Mapping[str, bool] = {}
        self.entered: list[str] = []
        """The atomic states that were entered, in their order."""
        self.running = True
        self._root = fromstring(text)
        self._parents = {child: parent for parent in self._root.iter() for child in parent}
        self._by_id = {each.get("id", ""): each for each in self._root.iter()}
        self._configuration: list[Element] = []
        self._history: dict[Element, list[Element]] = {}
        self._queue: deque[str] = deque()

    @property
    def state(self) -> str:
        """The atomic state that is active."""
        return next(each.get("id", "") for each in self._configuration if self._is_atomic(each))

    def start(self, answers: Mapping[str, bool]) -> None:
        """Enter the initial states."""
        self.answers = answers
        self._enter(self._initial_targets(self._root), self._root)
        self._macrostep()

    def ask(self, answers: Mapping[str, bool]) -> None:
        """Let guards have other answers."""
        self.answers = answers
        self._macrostep()

    def send(self, event: str) -> None:
        """Take an event from outside."""
        if self.running:
            self._microstep(self._select_transition(event))
            self._macrostep()

    # Microsteps.

    def _macrostep(self) -> None:
        for _ in range(MOST_STEPS):
            if not self.running:
                return
            chosen = self._select_transition(None)
            if chosen is None:
                if not self._queue:
                    return
                chosen = self._select_transition(self._queue.popleft())
            self._microstep(chosen)
        raise EndlessError

    def _select_transition(self, event: str | None) -> Element | None:
        """The first one that is enabled, of the atomic state or else of a state around it."""
        atomic = next(each for each in self._configuration if self._is_atomic(each))
        for state in (atomic, *self._proper_ancestors(atomic)):
            for transition in state.findall("transition"):
                if self._is_enabled(transition, event):
                    return transition
        return None

    def _is_enabled(self, transition: Element, event: str | None) -> bool:
        descriptors = transition.get("event", "").split()
        if event is None or not descriptors:
            fits = event is None and not descriptors
        else:
            fits = any(_matches(descriptor, event) for descriptor in descriptors)
        return fits and holds(transition.get("cond", ""), self.answers)

    def _microstep(self, transition: Element | None) -> None:
        if transition is None or not (targets := self._targets(transition)):
            return
        self._exit(self._transition_domain(transition))
        self._enter(targets, self._transition_domain(transition))

    def _exit(self, domain: Element) -> None:
        leaving = [each for each in self._configuration if self._is_descendant(each, domain)]
        for state in leaving:
            for history in state.findall("history"):
                self._history[history] = [
                    each
                    for each in self._configuration
                    if (
                        self._is_atomic(each) and self._is_descendant(each, state)
                        if history.get("type") == "deep"
                        else self._parents[each] is state
                    )
                ]
        self._configuration = [each for each in self._configuration if each not in leaving]

    def _enter(self, targets: list[Element], domain: Element) -> None:
        entering: list[Element] = []
        for target in targets:
            self._add_descendants(target, entering)
        for target in self._effective_targets(targets):
            self._add_ancestors(target, domain, entering)
        order = [each for each in self._root.iter() if each in entering]
        self._configuration += order
        self.entered += [each.get("id", "") for each in order if self._is_atomic(each)]
        for state in order:
            if state.tag == "final":
                parent = self._parents[state]
                if parent is self._root:
                    self.running = False
                else:
                    self._queue.append(f"done.state.{parent.get('id')}")

    def _add_descendants(self, state: Element, entering: list[Element]) -> None:
        if state.tag == "history":
            inner, above = self._effective_targets([state]), self._parents[state]
        else:
            entering.append(state)
            inner, above = self._initial_targets(state), state
        for each in inner:
            self._add_descendants(each, entering)
        for each in self._effective_targets(inner):
            self._add_ancestors(each, above, entering)

    def _add_ancestors(self, state: Element, above: Element, entering: list[Element]) -> None:
        for ancestor in self._proper_ancestors(state):
            if ancestor is above:
                return
            entering.append(ancestor)

    # What the document says.

    def _effective_targets(self, targets: Iterable[Element]) -> list[Element]:
        found: list[Element] = []
        for target in targets:
            if target.tag != "history":
                found.append(target)
            elif target in self._history:
                found += self._history[target]
            else:
                found += self._effective_targets(self._targets(target.find("transition")))
        return found

    def _transition_domain(self, transition: Element) -> Element:
        source = self._parents[transition]
        targets = self._effective_targets(self._targets(transition))
        is_internal = transition.get("type") == "internal" and not self._is_atomic(source)
        if is_internal and all(self._is_descendant(each, source) for each in targets):
            return source
        return next(
            ancestor
            for ancestor in self._proper_ancestors(source)
            if all(self._is_descendant(each, ancestor) for each in targets)
        )

    def _initial_targets(self, state: Element) -> list[Element]:
        inner = [each for each in state if each.tag in STATES]
        if state.get("initial"):
            return self._named(state.get("initial", ""))
        if (initial := state.find("initial")) is not None:
            return self._targets(initial.find("transition"))
        return inner[:1]

    def _targets(self, transition: Element | None) -> list[Element]:
        return [] if transition is None else self._named(transition.get("target", ""))

    def _named(self, names: str) -> list[Element]:
        return [self._by_id[name] for name in names.split()]

    def _proper_ancestors(self, state: Element) -> Iterator[Element]:
        while state in self._parents:
            state = self._parents[state]
            yield state

    def _is_descendant(self, state: Element, other: Element) -> bool:
        return other in self._proper_ancestors(state)

    def _is_atomic(self, state: Element) -> bool:
        return not any(each.tag in STATES for each in state)


def _matches(descriptor: str, event: str) -> bool:
    """`a`, `a.` and `a.*` match `a` and `a.b`; `*` matches every event."""
    prefix = descriptor.removesuffix("*").removesuffix(".")
    return not prefix or event == prefix or event.startswith(f"{prefix}.")


def holds(guard: str, answers: Mapping[str, bool]) -> bool:
    """Whether a formula over names is true."""
    text = re.sub(r"&&", " and ", re.sub(r"\|\|", " or ", guard.replace("!", " not ")))
    return not text or bool(eval(text.replace("true", "True"), {}, dict(answers)))


# Random charts.


@dataclass(eq=False)
class _Drawn:
    """A state of a random chart, with the lines that stand in it before its transitions."""

    name: str
    inner: list[_Drawn]
    is_final: bool = False
    lines: list[str] = field(default_factory=list)

    def walk(self) -> Iterator[_Drawn]:
        yield self
        for each in self.inner:
            yield from each.walk()


def random_chart(rng: Random) -> str:
    """A chart in the short notation: up to three levels, histories, final states and guards."""
    numbers = count()

    def state(depth: int) -> _Drawn:
        made = _Drawn(f"s{next(numbers)}", [])
        if rng.random() < (0.8, 0.45, 0.0)[depth]:
            made.inner = [state(depth + 1) for _ in range(rng.choice((1, 2, 2, 3)))]
            if rng.random() < 0.5:
                made.inner.append(_Drawn(f"s{next(numbers)}", [], is_final=True))
        return made

    tops = [state(0) for _ in range(rng.choice((2, 2, 3)))]
    every = [each for top in tops for each in top.walk()]
    histories: dict[str, _Drawn] = {}
    for each in every:
        if each.inner:
            _draw_beginnings(each, histories, rng)
    lines = [f"initial {rng.choice(every).name}"] if rng.random() < 0.3 else []
    for top in tops:
        lines += _written(top, every, histories, rng)
    return "\n".join(lines)


def _draw_beginnings(state: _Drawn, histories: dict[str, _Drawn], rng: Random) -> None:
    inner = [*state.walk()][1:]
    if rng.random() < 0.5:
        name, kind = f"h{state.name}", rng.choice(("deep", "deep", "history"))
        default = rng.choice(inner if kind == "deep" else state.inner).name
        state.lines.append(f"{kind} {name} -> {default}")
        histories[name] = state
    if rng.random() < 0.3:
        state.lines.append(f"initial {rng.choice(inner).name}")
    elif rng.random() < 0.1 and f"h{state.name}" in histories:
        state.lines.append(f"start -> h{state.name}")


def _written(
    state: _Drawn, every: list[_Drawn], histories: dict[str, _Drawn], rng: Random
) -> list[str]:
    lines = [("final " if state.is_final else "") + state.name, *(f"  {x}" for x in state.lines)]
    ending = [each.name for each in every if any(inner.is_final for inner in each.inner)]
    targets = [each.name for each in every]
    # Most of those from inside are refused.
    outside = [h for h, owner in histories.items() if state not in owner.walk()]
    for _ in range(0 if state.is_final else rng.choice((1, 1, 2, 2, 3))):
        events = rng.choice((*"abcabcabc", "a.b", "a b", "c.*", "*", ""))
        if ending and rng.random() < 0.3:
            events = rng.choice((*[f"done.state.{rng.choice(ending)}"] * 5, "done", "done.state"))
        guards = ("", "", "", "p", "q", "!p", "p && q", "p || !q", "true")
        guard = rng.choice(guards if events else ("p", "q", "!p && q", "p && q"))
        chosen = rng.choice(outside if outside and rng.random() < 0.4 else targets)
        if histories and rng.random() < 0.03:
            chosen = rng.choice([*histories])
        target = "" if events and rng.random() < 0.05 else chosen
        words = (events, f"if {guard}" if guard else "", rng.choice(("->", "->", "=>")), target)
        lines.append("  " + " ".join(filter(None, words)))
    for each in state.inner:
        lines += [f"  {x}" for x in _written(each, every, histories, rng)]
    return lines
