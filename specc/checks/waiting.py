"""States that wait for what their senders never send, or may never send again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import product
from typing import NamedTuple

from specc.analysis.facts import Facts
from specc.analysis.graph import Step, reached_from
from specc.analysis.words import listed
from specc.diagnostics import Diagnostic, Related
from specc.model.expr import Expr, Fresh, LetRef, Logic, Truth, Unary
from specc.model.fsm import State, Transition
from specc.model.system import Port, Subsystem, System
from specc.proof import InputName
from specc.reachable import grouped, reachable

# Ways in which a condition comes to hold, as sets of inputs that must be fresh for it.
#
# Other questions are left out, so that a condition has rather too many ways than too few.


Way = frozenset[InputName]
Ways = tuple[Way, ...]
FREE: Ways = (frozenset(),)
_MOST = 64


@dataclass(slots=True)
class Conditions:
    """The ways of the conditions of a subsystem."""

    subsystem: Subsystem
    _lets: dict[str, Expr] = field(init=False)
    _known: dict[tuple[str, bool], Ways] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._lets = {item.name: item.value for item in self.subsystem.lets}

    def ways(self, expr: Expr, holds: bool = True) -> Ways:
        """Ways in which a condition comes to hold, or not to hold."""
        match expr:
            case Truth(value=value):
                return FREE if value == holds else ()
            case Fresh(input=element) if holds:
                return (frozenset(((element.peer, element.element),)),)
            case Unary(op="not", operand=operand):
                return self.ways(operand, not holds)
            case LetRef(name=name) if name in self._lets:
                if (name, holds) not in self._known:
                    self._known[name, holds] = self.ways(self._lets[name], holds)
                return self._known[name, holds]
            case Logic(op=op, operands=operands):
                parts = [self.ways(part, holds) for part in operands]
                return (
                    all_of(parts)
                    if (op == "and") == holds
                    else least(way for p in parts for way in p)
                )
        return FREE


def all_of(parts: Iterable[Ways]) -> Ways:
    """Ways in which several things come to hold at once."""
    found = FREE
    for part in parts:
        found = least(one | other for one, other in product(found, part))
    return found


def least(ways: Iterable[Way]) -> Ways:
    """Without ways that need more than another one does; too many ways count as no need at all."""
    found: list[Way] = []
    for way in sorted(set(ways), key=lambda w: (len(w), sorted(w))):
        if not any(other <= way for other in found):
            found.append(way)
    return tuple(found) if len(found) <= _MOST else FREE


# What a state waits for, and whether the subsystem that is to send it may come to rest without.


class Rest(NamedTuple):
    """A sender gets to `state` and from there never sends what the waiting state needs.

    `row` is the row of the sender that accepts what the waiting subsystem sent earlier and no
    longer sends, if such a row leads there.
    """

    sender: Subsystem
    state: State
    row: Transition | None


class Waiting:
    """Follows two machines that are connected."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._conditions: dict[str, Conditions] = {}
        self._known: dict[tuple[object, ...], Ways] = {}
        self._leaving: dict[str, dict[str, list[Step]]] = {}
        self._entering: dict[str, dict[str, list[Step]]] = {}
        self._waits: dict[tuple[str, str, frozenset[Way]], _Wait] = {}

    def in_vain(self, reader: Subsystem, state: State) -> Iterator[tuple[Way, Rest]]:
        """Of every sender that all ways out need: what is needed of it, and where it may rest."""
        found = self._ways_out(reader, state)
        for port in reader.ports if found and all(found) else ():
            needs = frozenset(frozenset(n for n in way if n[0] == port.peer) for way in found)
            if port.direction == "x" and all(needs):
                wait = self._wait(reader, port, needs)
                rest = self._rest(wait, state) if wait else None
                if rest is not None:
                    yield frozenset().union(*needs), rest

    def _wait(self, reader: Subsystem, port: Port, needs: frozenset[Way]) -> _Wait | None:
        """What many states may wait for, which is looked into once."""
        key = reader.qualified_name, port.peer, needs
        if key not in self._waits:
            sender = self._facts.connections.subsystems.get(port.other_end)
            end = self._facts.connections.other_port(reader, port)
            if sender is None or end is None:
                return None
            self._waits[key] = _Wait(self._facts, reader, sender, end, port, needs)
        return self._waits[key]

    def _ways_out(self, subsystem: Subsystem, state: State) -> Ways:
        """The ways out of a state to others, or to itself if there is no other."""
        steps = self._steps_from(subsystem, state.name)
        leaving = [s for s in steps if s.row.target != state.name] or steps
        found: set[Way] = set()
        for step in leaving:
            found.update(self._asked(subsystem, step))
            if frozenset() in found:
                return FREE
        return least(found)

    def _steps_from(self, subsystem: Subsystem, state: str) -> list[Step]:
        name = subsystem.qualified_name
        if name not in self._leaving:
            steps = self._facts.steps(subsystem)
            self._leaving[name] = grouped((step.row.source, step) for step in steps)
        return self._leaving[name].get(state, [])

    def _steps_to(self, subsystem: Subsystem, state: str) -> list[Step]:
        name = subsystem.qualified_name
        if name not in self._entering:
            steps = self._facts.steps(subsystem)
            self._entering[name] = grouped((step.row.target, step) for step in steps)
        return self._entering[name].get(state, [])

    def _asked(self, subsystem: Subsystem, step: Step) -> Ways:
        behaviour = subsystem.state(step.row.source).behaviour
        cause = behaviour.terminal if step.row.cause == "terminal" else behaviour.error
        asked = (cause, step.row.condition)
        key = (subsystem.qualified_name, *((c.kind, c.name) for c in asked))
        if key not in self._known:
            name = subsystem.qualified_name
            conditions = self._conditions.setdefault(name, Conditions(subsystem))
            self._known[key] = all_of(conditions.ways(c.when) for c in asked)
        return self._known[key]

    def _rest(self, wait: _Wait, state: State) -> Rest | None:
        if wait.served.isdisjoint(wait.reached):
            return None  # said of the element, or of the state that would send it
        if wait.rest is not None and self._returns(wait.reader, state):
            return wait.rest
        still = _sent(state, wait.back, wait.end)
        spent = self._sent_before(wait, state) - still
        if (spent, still) not in wait.unanswered:
            wait.unanswered[spent, still] = self._unanswered(wait, spent, still)
        return wait.unanswered[spent, still]

    def _unanswered(self, wait: _Wait, spent: Way, still: Way) -> Rest | None:
        """Where the sender may rest after it has taken up what was sent before this state.

        `spent` is no longer sent, `still` is still sent.
        """
        free: list[Step] = []
        taking: list[Step] = []
        for step in wait.steps if spent else ():
            found = self._asked(wait.sender, step)
            bound = all(any(n[0] == wait.end.peer and n not in still for n in way) for way in found)
            if not bound:
                free.append(step)
            elif any(way & spent for way in found):
                taking.append(step)
        resting = _resting(wait, free) if taking else frozenset()
        silent = [s for s in free if not {s.row.source, s.row.target} & wait.served]
        for step in taking if resting else ():
            if step.row.target not in wait.served:
                here = resting & reached_from(step.row.target, silent)
                for state in wait.sender.states if here else ():
                    if state.name in here:
                        return Rest(wait.sender, state, step.row)
        return None

    def _sent_before(self, wait: _Wait, state: State) -> Way:
        """What the states before the waiting one send to the one that is waited for."""
        before = {step.row.source for step in self._steps_to(wait.reader, state.name)}
        sent = (
            _sent(wait.reader.state(name), wait.back, wait.end) for name in before - {state.name}
        )
        return frozenset().union(*sent)

    def _returns(self, subsystem: Subsystem, state: State) -> bool:
        """Whether a state can be entered again after it was left."""

        def following(name: str) -> list[str]:
            return [step.row.target for step in self._steps_from(subsystem, name)]

        return state.name in reachable(following(state.name), following)


@dataclass(frozen=True, eq=False)
class _Wait:
    """States of `reader` that need, on each of their ways out, something of `sender`.

    `port` is where the reader receives it, `end` where the sender has it. `unanswered` keeps where
    the sender may rest for what such a state sends no more, and still sends.
    """

    facts: Facts
    reader: Subsystem
    sender: Subsystem
    end: Port
    port: Port
    needs: frozenset[Way]
    unanswered: dict[tuple[Way, Way], Rest | None] = field(default_factory=dict)

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The rows that the sender may take."""
        return self.facts.steps(self.sender)

    @cached_property
    def reached(self) -> frozenset[str]:
        """The states that the sender can enter."""
        return self.facts.reached(self.sender)

    @cached_property
    def served(self) -> frozenset[str]:
        """The states of the sender that send all that some way out needs."""
        return frozenset(
            s.name
            for s in self.sender.states
            if any(need <= _sent(s, self.end, self.port) for need in self.needs)
        )

    @cached_property
    def rest(self) -> Rest | None:
        """Where the sender may come to rest whatever is sent to it."""
        resting = _resting(self, self.steps) & self.reached
        if not resting or _is_trap(resting, self.reached, self.steps):
            return None
        return Rest(self.sender, next(s for s in self.sender.states if s.name in resting), None)

    @property
    def back(self) -> Port:
        """Where the reader sends to the sender; the port of its own if it sends nothing."""
        found = (p for p in self.reader.ports if p.direction == "y" and p.peer == self.port.peer)
        return next(found, self.port)


def _resting(wait: _Wait, steps: Iterable[Step]) -> frozenset[str]:
    """States from which the sender can reach neither a sending state nor a declared end."""
    sources = grouped((step.row.target, step.row.source) for step in steps)
    ends = (s.name for s in wait.sender.states if _is_end(s))
    active = reachable((*wait.served, *ends), lambda name: sources.get(name, ()))
    return frozenset(s.name for s in wait.sender.states if s.name not in active)


def _is_end(state: State) -> bool:
    when = state.behaviour.terminal.when
    return isinstance(when, Truth) and not when.value


def _is_trap(resting: frozenset[str], reached: frozenset[str], steps: Sequence[Step]) -> bool:
    """Whether the machine gives up other work there, which is a finding of its own."""
    edges = {(s.row.source, s.row.target) for s in steps}
    if any((name, name) in edges for name in resting):
        return True
    outside: dict[str, set[str]] = {}
    for source, target in edges:
        if source in reached - resting and target not in resting:
            outside.setdefault(source, set()).add(target)
    try:
        TopologicalSorter(outside).prepare()
    except CycleError:
        return True
    return False


def _sent(state: State, end: Port, port: Port) -> frozenset[InputName]:
    """What a state of the sender sends, as its reader calls it."""
    return frozenset((port.peer, a.name) for a in state.behaviour.assignments if a.peer == end.peer)


# What a state waits for is sent, however the sender goes on.


def waits_end(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0417, once for each sender that a state may wait for forever."""
    waiting = Waiting(facts)
    for subsystem in facts.whole_subsystems:
        reached = facts.reached(subsystem)
        for state in subsystem.states:
            if state.name in reached:
                for needed, rest in waiting.in_vain(subsystem, state):
                    if facts.ways_are_known(rest.sender):
                        yield _finding(state, needed, rest)


def _finding(state: State, needed: Way, rest: Rest) -> Diagnostic:
    names = [f"`x.{peer}.{element}`" for peer, element in sorted(needed)]
    sender = f"`{rest.sender.qualified_name}`"
    related = [Related(rest.state.place, f"from here on {sender} never sends it")]
    if rest.row is not None:
        words = f"here {sender} accepts what it was sent before"
        where = f"may come to `{rest.state.name}` without an answer"
        related = [Related(rest.row.place, words), Related(rest.state.place, where)]
    return Diagnostic(
        "W0417",
        f"state `{state.name}` may wait forever for {listed(names, 'or')}",
        state.place,
        "nothing else ends it",
        tuple(related),
        f"let {sender} send it on every path, or leave `{state.name}` after some time, with "
        "`elapsed`; if the sender is meant to end there, say so with `terminal: never`",
    )


USES = (waits_end,)
