"""The findings of an exploration: deadlocks, lost events, failing assumptions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from operator import itemgetter

from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.model.fsm import Axiom
from specc.model.system import System
from specc.proof import InputName
from specc.source import Place
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.bottom_components import BottomComponent, Stuck, terminal_components
from specc.tools.explore.composition import Composition, Edge
from specc.tools.explore.graph import Cost, Graph
from specc.tools.explore.lost_values import Lost, lost_once
from specc.tools.explore.trace import ExploredTrace, Step, trace

_MOST_NAMED = 5
"""Conditions that a message names."""


@dataclass(frozen=True, slots=True)
class TracedFinding:
    """A finding with its trace. `about` identifies it across slices and abstractions.

    It names the first of several copies, since exploring takes copies in any order.

    It is not confirmed if it was found only on a coarse abstraction (any time passes, or not all
    values are followed) and is not refuted on a finer one.
    """

    about: tuple[object, ...]
    code: str
    message: str
    place: Place
    label: str
    help: str
    way: ExploredTrace
    related: tuple[Related, ...] = ()
    is_advice: bool = False
    is_confirmed: bool = True

    @property
    def diagnostic(self) -> Diagnostic:
        """The diagnostic: an error if every run takes the trace, unless it is only advice."""
        free = list(self.way.free)
        if len(free) > _MOST_NAMED:
            free[_MOST_NAMED:] = [f"{len(free) - _MOST_NAMED} more"]
        rests = f"this rests on {join_words(free, 'and')}; " if free else ""
        if not self.is_confirmed:
            rests = f"whether a run comes to this is not decided; {rests}"
        related = (*self.way.related(), *self.related)
        return Diagnostic(
            self.code,
            self.message,
            self.place,
            self.label,
            related,
            f"{rests}{self.help}",
            promoted=self.way.is_decided and not self.is_advice,
        )


FindingsByAbout = dict[tuple[object, ...], TracedFinding]


def add_best(findings: FindingsByAbout, finding: TracedFinding) -> None:
    """Add a finding; of several about the same thing a confirmed one stays, of these a decided one,
    of these the easiest.
    """
    known = findings.get(finding.about)
    if known is None or _rank(finding) < _rank(known):
        findings[finding.about] = finding


def _rank(finding: TracedFinding) -> tuple[bool, bool, int, Fraction]:
    way = finding.way
    avoidable = sum(step.move.row >= 0 and bool(step.move.free) for step in way.steps)
    return not finding.is_confirmed, not way.is_decided, avoidable, way.time_s


def findings(graph: Graph, abstraction: Abstraction, system: System) -> FindingsByAbout:
    """All findings in a graph, by `about`."""
    found: FindingsByAbout = {}
    for last in terminal_components(graph, abstraction):
        told = [*_circles(last), *_roots(last)]
        for finding in told or _no_progress(last, system):
            add_best(found, finding)
    for finding in _events(graph):
        add_best(found, finding)
    for number, edge in sorted(graph.faults, key=lambda fault: graph.cost(*fault)):
        for finding in _broken(graph, trace(graph, number, edge)):
            add_best(found, finding)
    for lost in lost_once(graph, abstraction):
        finding = _once(graph, lost)
        if ("W1005", *finding.about[1:], None) not in found:
            add_best(found, finding)
    return found


# Machines that cannot go on.


def _circles(last: BottomComponent) -> Iterator[TracedFinding]:
    for circle in last.circles:
        members = [last.stuck[i] for i in circle]
        lost = [f for s in members for f in _lost(last, s)]
        if lost:
            yield from lost
            continue
        names = [f"`{last.walkers[s.index].name}`" for s in members]
        yield TracedFinding(
            ("W1002", *sorted((last.walkers[s.index].kind, s.state.name) for s in members)),
            "W1002",
            f"{join_words(names, 'and')} wait for one another",
            members[0].state.place,
            _waiting(last, members[0]),
            "let one of them go on without the other, after some time or from the start",
            last.way,
            tuple(Related(s.state.place, _waiting(last, s)) for s in members[1:]),
        )


def _roots(last: BottomComponent) -> Iterator[TracedFinding]:
    for stuck in last.roots:
        lost = list(_lost(last, stuck))
        yield from lost or [_held(last, stuck)]
    for stuck in last.resting:
        if not stuck.goes_round:
            yield from _all_missed(last, stuck)


def _all_missed(last: BottomComponent, stuck: Stuck) -> Iterator[TracedFinding]:
    """Findings on a resting machine that missed its awaited input every time it was sent."""
    for key in sorted(stuck.missing):
        if _never_seen(last, stuck.index, key):
            yield _missed(last, stuck, stuck.index, key)


def _never_seen(last: BottomComponent, index: int, key: InputName) -> bool:
    """Whether every sent value was missed, so that the sender's end cannot excuse it."""
    sender, output = last.sender(index, key)
    sent = sum(s.index == sender and output in dict(s.move.sent) for s in last.way.steps)
    missed = sum(s.index == index and key in dict(s.move.lost) for s in last.way.steps)
    return sent == missed > 0


def _held(last: BottomComponent, stuck: Stuck) -> TracedFinding:
    walker, state = last.walkers[stuck.index], stuck.state.name
    name = walker.name
    code, message = "W1004", f"`{name}` can never leave `{state}`"
    others = tuple(
        Related(s.state.place, _waiting(last, s)) for i, s in last.stuck.items() if i != stuck.index
    )
    if last.still:
        code, message = "W1001", f"no machine can go on: `{name}` stays in `{state}`"
    elif stuck.missing:
        code, message = "W1003", f"`{name}` waits in `{state}` for what {_gone(last, stuck)}"
    return TracedFinding(
        (code, walker.kind, state),
        code,
        message,
        stuck.state.place,
        _waiting(last, stuck),
        "let it be sent on every way, or leave the state after some time, with `elapsed`; an end "
        "that is meant is declared with `terminal: never`",
        last.way,
        others,
    )


def _gone(last: BottomComponent, stuck: Stuck) -> str:
    """Words for an awaited input: `never comes`, or `no longer comes`."""
    asked = [last.sender(stuck.index, key) for key in stuck.missing]
    came = any((s.index, output) in asked for s in last.way.steps for output, _ in s.move.sent)
    return "no longer comes" if came else "never comes"


def _waiting(last: BottomComponent, stuck: Stuck) -> str:
    name = f"`{last.walkers[stuck.index].name}`"
    if not stuck.needs:
        return f"no condition of {name} comes true any more"
    names = join_words((f"`x.{p}.{e}`" for p, e in sorted(stuck.awaited)), "and")
    return f"{name} {'waits for' if stuck.missing else 'gets no other'} {names}" + (
        f", which {_gone(last, stuck)}" if stuck.missing else ""
    )


def _lost(last: BottomComponent, stuck: Stuck) -> Iterator[TracedFinding]:
    """Lost events behind a wait: the awaited input was missed, or the request for it was."""
    asked = [(stuck.index, key) for key in sorted(stuck.missing)]
    for sender in sorted(last.waits(stuck)):
        walker = last.walkers[sender]
        decides = frozenset[InputName]().union(*walker.attention.conditions.values())
        keys = [key for key in walker.inputs if key in decides]
        asked += [(sender, key) for key in keys if last.sender(sender, key)[0] == stuck.index]
    for reader, key in asked:
        if key in last.walkers[reader].events:
            continue  # said of every state in which it is lost
        if last.sender(reader, key) in last.sent and _is_looked_at(last, reader, key):
            continue  # it comes again, and is passed over for something else
        step = last.way.lost(reader, key)
        if step or (reader, key) in last.way.overtaken:
            yield _missed(last, stuck, reader, key)


def _is_looked_at(last: BottomComponent, reader: int, key: InputName) -> bool:
    """Whether conditions or functions read an input in the states where the reader stays."""
    looks, states = last.walkers[reader].attention, last.states[reader]
    return any(key in looks.conditions[s] or key in looks.functions[s] for s in states)


def _missed(last: BottomComponent, stuck: Stuck, reader: int, key: InputName) -> TracedFinding:
    step = last.way.lost(reader, key)
    waiting = Related(stuck.state.place, _waiting(last, stuck))
    return _event(last.graph.composition, reader, key, last.way, step, (waiting,))


def _event(
    composition: Composition,
    reader: int,
    key: InputName,
    way: ExploredTrace,
    step: Step | None,
    related: tuple[Related, ...] = (),
) -> TracedFinding:
    """The finding on an event that is lost at a step or, without a step, overtaken."""
    walker, missed_in = composition.walkers[reader], ""
    what, name = f"`x.{key[0]}.{key[1]}`", f"`{walker.name}`"
    message = f"{what} is lost: the next value comes before {name} reads it"
    place, label = walker.subsystem.inputs[key].place, "is overtaken"
    member, looks = "", "look at it"
    if step is not None:
        member = dict(step.move.lost).get(key, "")
        what, looks = (f"`{member}` of {what}", "react to it") if member else (what, looks)
        state = walker.subsystem.state(step.move.source or step.move.target)
        message = f"{what} is lost: {name} does not {looks} in `{state.name}`"
        place, label = state.place, "it comes here"
        missed_in = state.name
    return TracedFinding(
        (
            "W1005",
            *composition.of_kind(reader, key),
            (member, missed_in) if key in walker.events else None,
        ),
        "W1005",
        message,
        place,
        label,
        f"send it until it is answered, {looks} in every state in which it can come, or say "
        f"there `ignores: [x.{key[0]}.{key[1]}]`",
        way,
        related,
    )


def _events(graph: Graph) -> Iterator[TracedFinding]:
    """Findings on declared events that are neither looked at nor ignored where they arrive."""
    walkers = graph.composition.walkers
    easiest: dict[tuple[int, InputName, str, str], tuple[Cost, int, Edge]] = {}
    declared = any(walker.events for walker in walkers)
    for number, out in enumerate(graph.edges if declared else ()):
        for edge in out:
            for lost in _lost_events(graph, number, edge):
                one = graph.cost(number, edge), number, edge
                easiest[lost] = min(easiest.get(lost, one), one, key=itemgetter(0))
    for (reader, key, state, _), (_, number, edge) in easiest.items():
        way = trace(graph, number, edge)
        step = way.lost(reader, key) if state else None
        if not state:  # it is, before anybody moves
            before = trace(graph, number)
            way = replace(way, steps=before.steps, free=before.free)
        if walkers[reader].may_be_absent(key):
            way = replace(way, free=(*way.free, f"`x.{key[0]}.{key[1]}` coming then"))
        yield _event(graph.composition, reader, key, way, step)


def _lost_events(
    graph: Graph, number: int, edge: Edge
) -> Iterator[tuple[int, InputName, str, str]]:
    """Machine, lost input, the state that missed it (none if it was overtaken), and the member to
    which that did not react (none if it does not look at the input).
    """
    composition = graph.composition
    frame, walkers = graph.frame(number), composition.walkers
    for i, move in (composition.real_move(frame, *each) for each in edge.moves):
        missed = (lost for lost in move.lost if lost[0] in walkers[i].events)
        yield from ((i, key, move.source, member) for key, member in missed)
    for i, key in composition.real_overtaken(frame, edge):
        if key in walkers[i].events:
            yield i, key, "", ""


def _once(graph: Graph, lost: Lost) -> TracedFinding:
    """Advice on a value that is sent once and lost without being declared an event."""
    way = trace(graph, lost.number, lost.edge)
    walker, key = graph.composition.walkers[lost.reader], lost.key
    what, how = f"`x.{key[0]}.{key[1]}`", "is overtaken by the next value"
    if not lost.overtaken:
        step = way.lost(lost.reader, key)
        assert step is not None  # it is that of the last edge
        how = f"comes in `{step.move.source or step.move.target}`, where nobody looks at it"
    return TracedFinding(
        ("W1008", *graph.composition.of_kind(lost.reader, key)),
        "W1008",
        f"{what} of `{walker.name}` is sent once and {how}",
        walker.subsystem.inputs[key].place,
        "it is not sent again before the reader has acted",
        f"if it must not be missed, declare it with `event: true`, and look at it there or say "
        f"`ignores: [x.{key[0]}.{key[1]}]`",
        way,
        is_advice=True,
    )


def _no_progress(last: BottomComponent, system: System) -> Iterator[TracedFinding]:
    """Findings where the transition that ends a cycle of the task is never taken again.

    This is intended if its machine waits for a sender at a declared end.
    """
    task = system.task
    names = last.graph.composition.names
    if task is None or task.subsystem not in names:
        return
    index = names.index(task.subsystem)
    resting = [stuck for stuck in last.resting if stuck.index == index]
    for stuck in resting:
        yield from _all_missed(last, stuck)
    if resting or last.is_at_end(index):
        return
    subsystem = last.walkers[index].subsystem
    rows = [subsystem.transitions[row] for i, row in last.rows if i == index]
    if any((row.source, row.target) == (task.source, task.target) for row in rows):
        return
    states = join_words((f"`{s}`" for s in sorted(last.states[index])), "and")
    yield TracedFinding(
        ("W1004", "task"),
        "W1004",
        f"no cycle of the task can end any more: `{task.subsystem}` stays in {states}",
        task.place,
        f"from `{task.source}` to `{task.target}`",
        "give these states a way back",
        last.way,
    )


# Assumptions that a run breaks.


def _broken(graph: Graph, way: ExploredTrace) -> Iterator[TracedFinding]:
    for step in way.steps:
        for index in step.move.broken:
            axiom: Axiom = step.walker.subsystem.axioms[index]
            yield TracedFinding(
                ("W1006", step.walker.kind, index),
                "W1006",
                f"this assumption fails in `{step.move.source}` of `{step.walker.name}`",
                axiom.place,
                f"it is wrong {float(way.time_s):g} s after the start",
                "weaken it and give the rows that rested on it their cases, or change what is sent",
                way,
            )
