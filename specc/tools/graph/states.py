"""The state machine of a subsystem, with the conditions on its arcs (Figs 10, 17, 22)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.lang.show import show
from specc.model import expr as m
from specc.model.fsm import Cause, Condition, State, Transition
from specc.model.system import Subsystem
from specc.reachable import grouped
from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cells,
    Diagram,
    Stroke,
    TextLine,
    TextRun,
    broken,
    equations,
    line,
)
from specc.tools.graph.names import is_named

_START = "start of the machine"
_COLUMNS = 26
_EXPRESSION = 84


def states(subsystem: Subsystem) -> Diagram:
    """A node for each state, an arc for the rows of one cause between two states."""
    nodes = [_state(state) for state in subsystem.states]
    known = {state.name for state in subsystem.states}
    ends = dict.fromkeys(end for row in subsystem.transitions for end in (row.source, row.target))
    nodes += [
        Box(end, "missing", (line(end), line("not there", "note")))
        for end in ends
        if end not in known
    ]
    arcs = list(_arcs(subsystem))
    if subsystem.has_initial_state and subsystem.initial_state in known:
        nodes.insert(0, Box(_START, "start", ()))
        arcs.insert(0, Arc(_START, subsystem.initial_state))
    return Diagram(
        subsystem.qualified_name, tuple(nodes), tuple(arcs), notes=tuple(_notes(subsystem))
    )


def _state(state: State) -> Box:
    behaviour = state.behaviour
    lines: list[TextLine] = [
        (
            *(TextRun(state.name, "name"), TextRun("  "), TextRun(behaviour.name, "italic")),
            *equations(behaviour.trace.eq),
        ),
        *broken(state.title or behaviour.title, 34),
    ]
    for cause, condition in reversed(behaviour.endings):
        if condition.when != m.FALSE:
            lines += _ending(cause, condition)
    if state.holds:
        names = ", ".join(f"y.{peer}.{name}" for peer, name in state.holds)
        lines += broken(f"holds {names}", 36, "note")
    return Box(state.name, "state", tuple(lines), covers=(state.name,))


def _ending(cause: Cause, condition: Condition) -> Iterator[TextLine]:
    """What ends a behaviour, in the colour of a note."""
    sign = "ends" if cause == "terminal" else "error"
    said = "at once" if condition.when == m.TRUE else _called(condition)
    first, *rest = broken(f"{sign}: {said}" if said != "at once" else f"{sign} {said}", 36, "note")
    yield first + (() if rest else equations(condition.trace.eq))
    for number, each in enumerate(rest):
        yield each + (equations(condition.trace.eq) if number == len(rest) - 1 else ())


def _called(condition: Condition) -> str:
    """Its name; what it says if it has none, since it stands where it is used."""
    return condition.name if is_named(condition) else show(condition.when)


def _arcs(subsystem: Subsystem) -> Iterator[Arc]:
    rows = enumerate(subsystem.transitions)
    together = grouped(((row.source, row.target, row.cause), (n, row)) for n, row in rows)
    for (source, target, cause), own in together.items():
        lines = [each for _, row in own for each in _row(row)]
        covers = tuple(str(index) for index, _ in own)
        stroke: Stroke = "solid" if cause == "terminal" else "error"
        yield Arc(source, target, tuple(lines), stroke, covers=covers)


def _row(row: Transition) -> Iterator[TextLine]:
    """The initial condition of a row, unless nothing can be said of it but that it holds."""
    if row.condition.name == "always" and not row.trace.eq:
        return
    *most, last = broken(_called(row.condition), _COLUMNS) or ((),)
    yield from most
    yield last + equations(row.condition.trace.eq or row.trace.eq)


def _notes(subsystem: Subsystem) -> Iterator[Cells]:
    """What conditions with a name say, and what dashed arcs are."""
    used = {row.condition.name for row in subsystem.transitions}
    endings = [c for s in subsystem.states for _, c in s.behaviour.endings]
    used |= {condition.name for condition in endings if condition.when != m.FALSE}
    for condition in subsystem.conditions:
        if condition.name in used and is_named(condition):
            said = broken(show(condition.when), _EXPRESSION)
            head = (TextRun(condition.name, "name"), *equations(condition.trace.eq))
            for number, each in enumerate(said):
                yield Cells((head if number == 0 else line(" "), each))
    if any(row.cause == "error" for row in subsystem.transitions):
        yield Cells((line("dashed", "italic"), line("after an error")))
