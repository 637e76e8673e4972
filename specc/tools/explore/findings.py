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
from specc.tools.explore.bottom_components import BottomComponent, StuckMachine, terminal_components
from specc.tools.explore.composition import Composition, Edge
from specc.tools.explore.graph import Cost, Graph
from specc.tools.explore.lost_values import LostValue, lost_once
from specc.tools.explore.trace import ExploredTrace, Step, easiest_trace

_MOST_NAMED = 5
"""Conditions that a message names."""


@dataclass(frozen=True, slots=True)
class TracedFinding:
    """A finding with its trace. `identity` is the same across slices and abstractions.

    It names the first of several copies, since exploring takes copies in any order.

    It is not confirmed if it was found only on a coarse abstraction (any time passes, or not all
    values are followed) and is not refuted on a finer one.
    """

    identity: tuple[object, ...]
    code: str
    message: str
    place: Place
    label: str
    help: str
    trace: ExploredTrace
    related: tuple[Related, ...] = ()
    is_advice: bool = False
    is_confirmed: bool = True

    @property
    def diagnostic(self) -> Diagnostic:
        """The diagnostic: an error if every run takes the trace, unless it is only advice."""
        free = list(self.trace.choices)
        if len(free) > _MOST_NAMED:
            free[_MOST_NAMED:] = [f"{len(free) - _MOST_NAMED} more"]
        rests = f"this rests on {join_words(free, 'and')}; " if free else ""
        if not self.is_confirmed:
            rests = f"whether a run comes to this is not decided; {rests}"
        related = (*self.trace.shown_steps(), *self.related)
        return Diagnostic(
            self.code,
            self.message,
            self.place,
            self.label,
            related,
            f"{rests}{self.help}",
            promoted=self.trace.is_decided and not self.is_advice,
        )


FindingsById = dict[tuple[object, ...], TracedFinding]


def add_best(findings: FindingsById, finding: TracedFinding) -> None:
    """Add a finding; of several about the same thing a confirmed one stays, of these a decided one,
    of these the easiest.
    """
    known = findings.get(finding.identity)
    if known is None or _rank(finding) < _rank(known):
        findings[finding.identity] = finding


def _rank(finding: TracedFinding) -> tuple[bool, bool, int, Fraction]:
    path = finding.trace
    avoidable = sum(
        step.transition.row >= 0 and bool(step.transition.choices) for step in path.steps
    )
    return not finding.is_confirmed, not path.is_decided, avoidable, path.time_s


def findings(graph: Graph, abstraction: Abstraction, system: System) -> FindingsById:
    """All findings in a graph, by `identity`."""
    found: FindingsById = {}
    for component in terminal_components(graph, abstraction):
        stuck = [*_wait_cycle_findings(component), *_stuck_findings(component)]
        for finding in stuck or _task_findings(component, system):
            add_best(found, finding)
    for finding in _event_findings(graph):
        add_best(found, finding)
    for number, edge in sorted(graph.faults, key=lambda fault: graph.cost(*fault)):
        for finding in _assumption_findings(graph, easiest_trace(graph, number, edge)):
            add_best(found, finding)
    for lost in lost_once(graph, abstraction):
        finding = _lost_once_finding(graph, lost)
        if ("W1005", *finding.identity[1:], None) not in found:
            add_best(found, finding)
    return found


# Machines that cannot go on.


def _wait_cycle_findings(component: BottomComponent) -> Iterator[TracedFinding]:
    for circle in component.wait_cycles:
        members = [component.stuck[i] for i in circle]
        lost = [f for s in members for f in _lost_causes(component, s)]
        if lost:
            yield from lost
            continue
        names = [f"`{component.walkers[s.index].name}`" for s in members]
        yield TracedFinding(
            ("W1002", *sorted((component.walkers[s.index].kind, s.state.name) for s in members)),
            "W1002",
            f"{join_words(names, 'and')} wait for one another",
            members[0].state.place,
            _wait_description(component, members[0]),
            "let one of them go on without the other, after some time or from the start",
            component.trace,
            tuple(Related(s.state.place, _wait_description(component, s)) for s in members[1:]),
        )


def _stuck_findings(component: BottomComponent) -> Iterator[TracedFinding]:
    for stuck in component.root_causes:
        lost = list(_lost_causes(component, stuck))
        yield from lost or [_stuck_finding(component, stuck)]
    for stuck in component.intended_waits:
        if not stuck.is_cycling:
            yield from _missed_findings(component, stuck)


def _missed_findings(component: BottomComponent, stuck: StuckMachine) -> Iterator[TracedFinding]:
    """Findings on a resting machine that missed its awaited input every time it was sent."""
    for key in sorted(stuck.missing):
        if _is_always_missed(component, stuck.index, key):
            yield _missed_finding(component, stuck, stuck.index, key)


def _is_always_missed(component: BottomComponent, index: int, key: InputName) -> bool:
    """Whether every sent value was missed, so that the sender's end cannot excuse it."""
    sender, output = component.sender(index, key)
    sent = sum(
        s.index == sender and output in dict(s.transition.sent) for s in component.trace.steps
    )
    missed = sum(s.index == index and key in dict(s.transition.lost) for s in component.trace.steps)
    return sent == missed > 0


def _stuck_finding(component: BottomComponent, stuck: StuckMachine) -> TracedFinding:
    walker, state = component.walkers[stuck.index], stuck.state.name
    name = walker.name
    code, message = "W1004", f"`{name}` can never leave `{state}`"
    others = tuple(
        Related(s.state.place, _wait_description(component, s))
        for i, s in component.stuck.items()
        if i != stuck.index
    )
    if component.is_static:
        code, message = "W1001", f"no machine can go on: `{name}` stays in `{state}`"
    elif stuck.missing:
        code, message = (
            "W1003",
            f"`{name}` waits in `{state}` for what {_absence(component, stuck)}",
        )
    return TracedFinding(
        (code, walker.kind, state),
        code,
        message,
        stuck.state.place,
        _wait_description(component, stuck),
        "let it be sent on every way, or leave the state after some time, with `elapsed`; an end "
        "that is meant is declared with `terminal: never`",
        component.trace,
        others,
    )


def _absence(component: BottomComponent, stuck: StuckMachine) -> str:
    """Words for an awaited input: `never comes`, or `no longer comes`."""
    outputs = [component.sender(stuck.index, key) for key in stuck.missing]
    came = any(
        (s.index, output) in outputs
        for s in component.trace.steps
        for output, _ in s.transition.sent
    )
    return "no longer comes" if came else "never comes"


def _wait_description(component: BottomComponent, stuck: StuckMachine) -> str:
    name = f"`{component.walkers[stuck.index].name}`"
    if not stuck.needed:
        return f"no condition of {name} comes true any more"
    names = join_words((f"`x.{p}.{e}`" for p, e in sorted(stuck.awaited)), "and")
    return f"{name} {'waits for' if stuck.missing else 'gets no other'} {names}" + (
        f", which {_absence(component, stuck)}" if stuck.missing else ""
    )


def _lost_causes(component: BottomComponent, stuck: StuckMachine) -> Iterator[TracedFinding]:
    """Lost events behind a wait: the awaited input was missed, or the request for it was."""
    candidates = [(stuck.index, key) for key in sorted(stuck.missing)]
    for sender in sorted(component.awaited_senders(stuck)):
        walker = component.walkers[sender]
        decides = frozenset[InputName]().union(*walker.input_use.read_by_conditions.values())
        keys = [key for key in walker.inputs if key in decides]
        candidates += [
            (sender, key) for key in keys if component.sender(sender, key)[0] == stuck.index
        ]
    for reader, key in candidates:
        if key in component.walkers[reader].events:
            continue  # said of every state in which it is lost
        if component.sender(reader, key) in component.sent and _is_read(component, reader, key):
            continue  # it comes again, and is passed over for something else
        step = component.trace.last_missed(reader, key)
        if step or (reader, key) in component.trace.overwritten:
            yield _missed_finding(component, stuck, reader, key)


def _is_read(component: BottomComponent, reader: int, key: InputName) -> bool:
    """Whether conditions or functions read an input in the states where the reader stays."""
    looks, states = component.walkers[reader].input_use, component.states[reader]
    return any(
        key in looks.read_by_conditions[s] or key in looks.read_by_functions[s] for s in states
    )


def _missed_finding(
    component: BottomComponent, stuck: StuckMachine, reader: int, key: InputName
) -> TracedFinding:
    step = component.trace.last_missed(reader, key)
    waiting = Related(stuck.state.place, _wait_description(component, stuck))
    return _event_finding(
        component.graph.composition, reader, key, component.trace, step, (waiting,)
    )


def _event_finding(
    composition: Composition,
    reader: int,
    key: InputName,
    trace: ExploredTrace,
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
        member = dict(step.transition.lost).get(key, "")
        what, looks = (f"`{member}` of {what}", "react to it") if member else (what, looks)
        state = walker.subsystem.state(step.transition.source or step.transition.target)
        message = f"{what} is lost: {name} does not {looks} in `{state.name}`"
        place, label = state.place, "it comes here"
        missed_in = state.name
    return TracedFinding(
        (
            "W1005",
            *composition.representative(reader, key),
            (member, missed_in) if key in walker.events else None,
        ),
        "W1005",
        message,
        place,
        label,
        f"send it until it is answered, {looks} in every state in which it can come, or say "
        f"there `ignores: [x.{key[0]}.{key[1]}]`",
        trace,
        related,
    )


def _event_findings(graph: Graph) -> Iterator[TracedFinding]:
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
        path = easiest_trace(graph, number, edge)
        step = path.last_missed(reader, key) if state else None
        if not state:  # it is, before anybody moves
            before = easiest_trace(graph, number)
            path = replace(path, steps=before.steps, choices=before.choices)
        if walkers[reader].may_be_absent(key):
            path = replace(path, choices=(*path.choices, f"`x.{key[0]}.{key[1]}` coming then"))
        yield _event_finding(graph.composition, reader, key, path, step)


def _lost_events(
    graph: Graph, number: int, edge: Edge
) -> Iterator[tuple[int, InputName, str, str]]:
    """Machine, lost input, the state that missed it (none if it was overtaken), and the member to
    which that did not react (none if it does not look at the input).
    """
    composition = graph.composition
    frame, walkers = graph.frame(number), composition.walkers
    for i, move in (composition.real_transition(frame, *each) for each in edge.transitions):
        missed = (lost for lost in move.lost if lost[0] in walkers[i].events)
        yield from ((i, key, move.source, member) for key, member in missed)
    for i, key in composition.real_overwritten(frame, edge):
        if key in walkers[i].events:
            yield i, key, "", ""


def _lost_once_finding(graph: Graph, lost: LostValue) -> TracedFinding:
    """Advice on a value that is sent once and lost without being declared an event."""
    path = easiest_trace(graph, lost.number, lost.edge)
    walker, key = graph.composition.walkers[lost.reader], lost.key
    what, how = f"`x.{key[0]}.{key[1]}`", "is overtaken by the next value"
    if not lost.is_overwritten:
        step = path.last_missed(lost.reader, key)
        assert step is not None  # it is that of the last edge
        state = step.transition.source or step.transition.target
        how = f"comes in `{state}`, where nobody looks at it"
    return TracedFinding(
        ("W1008", *graph.composition.representative(lost.reader, key)),
        "W1008",
        f"{what} of `{walker.name}` is sent once and {how}",
        walker.subsystem.inputs[key].place,
        "it is not sent again before the reader has acted",
        f"if it must not be missed, declare it with `event: true`, and look at it there or say "
        f"`ignores: [x.{key[0]}.{key[1]}]`",
        path,
        is_advice=True,
    )


def _task_findings(component: BottomComponent, system: System) -> Iterator[TracedFinding]:
    """Findings where the transition that ends a cycle of the task is never taken again.

    This is intended if its machine waits for a sender at a declared end.
    """
    task = system.task
    names = component.graph.composition.names
    if task is None or task.subsystem not in names:
        return
    index = names.index(task.subsystem)
    waits = [stuck for stuck in component.intended_waits if stuck.index == index]
    for stuck in waits:
        yield from _missed_findings(component, stuck)
    if waits or component.is_at_end(index):
        return
    subsystem = component.walkers[index].subsystem
    rows = [subsystem.transitions[row] for i, row in component.rows if i == index]
    if any((row.source, row.target) == (task.source, task.target) for row in rows):
        return
    states = join_words((f"`{s}`" for s in sorted(component.states[index])), "and")
    yield TracedFinding(
        ("W1004", "task"),
        "W1004",
        f"no cycle of the task can end any more: `{task.subsystem}` stays in {states}",
        task.place,
        f"from `{task.source}` to `{task.target}`",
        "give these states a way back",
        component.trace,
    )


# Assumptions that a run breaks.


def _assumption_findings(graph: Graph, path: ExploredTrace) -> Iterator[TracedFinding]:
    for step in path.steps:
        for index in step.transition.broken:
            axiom: Axiom = step.walker.subsystem.axioms[index]
            yield TracedFinding(
                ("W1006", step.walker.kind, index),
                "W1006",
                f"this assumption fails in `{step.transition.source}` of `{step.walker.name}`",
                axiom.place,
                f"it is wrong {float(path.time_s):g} s after the start",
                "weaken it and give the rows that rested on it their cases, or change what is sent",
                path,
            )
