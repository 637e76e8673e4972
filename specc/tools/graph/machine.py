"""Pictures of a machine: its states (Figs 10, 17, 22), and what its functions compute
(Figs 11-13, 18, 23, 24)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from specc.lang.show import show
from specc.model import expr as m
from specc.model.fsm import Assignment, Condition, Function, State, Trace, Transition
from specc.model.system import Let, Subsystem
from specc.reachable import grouped, reachable
from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cells,
    Diagram,
    Look,
    Stroke,
    TextLine,
    TextRun,
    equations,
    is_named,
    line,
    wrap_lines,
)

# The state machine, with the conditions on its arcs.

_START = "start of the machine"
_CONDITION, _EXPRESSION = 26, 84


def states(subsystem: Subsystem) -> Diagram:
    """A node for each state, an arc for the rows of one cause between two states."""
    rows = subsystem.transitions
    known = {state.name: _state(state) for state in subsystem.states}
    ends = dict.fromkeys(end for row in rows for end in (row.source, row.target))
    missing = (line("not there", "note"),)
    nodes = [*known.values()]
    nodes += [Box(end, "missing", (line(end), *missing)) for end in ends if end not in known]
    arcs = []
    by_ends = grouped(((row.source, row.target, row.cause), n) for n, row in enumerate(rows))
    for (source, target, cause), own in by_ends.items():
        lines = tuple(each for number in own for each in _row(rows[number]))
        stroke: Stroke = "solid" if cause == "terminal" else "error"
        arcs.append(Arc(source, target, lines, stroke, covers=tuple(map(str, own))))
    if subsystem.has_initial_state and subsystem.initial_state in known:
        nodes.insert(0, Box(_START, "start", ()))
        arcs.insert(0, Arc(_START, subsystem.initial_state))
    notes = tuple(_notes(subsystem))
    return Diagram(subsystem.qualified_name, tuple(nodes), tuple(arcs), notes=notes)


def _state(state: State) -> Box:
    behaviour = state.behaviour
    name = TextRun(state.name, "name"), TextRun("  "), TextRun(behaviour.name, "italic")
    lines = [
        (*name, *equations(behaviour.trace.eq)),
        *wrap_lines(state.title or behaviour.title, 34),
    ]
    for cause, condition in reversed(behaviour.endings):
        if condition.when != m.FALSE:
            sign = "ends" if cause == "terminal" else "error"
            when = " at once" if condition.when == m.TRUE else f": {_condition(condition)}"
            *most, last = wrap_lines(f"{sign}{when}", 36, "note")
            lines += [*most, last + equations(condition.trace.eq)]
    if state.holds:
        names = ", ".join(f"y.{peer}.{name}" for peer, name in state.holds)
        lines += wrap_lines(f"holds {names}", 36, "note")
    return Box(state.name, "state", tuple(lines), covers=(state.name,))


def _condition(condition: Condition) -> str:
    """The condition's name, or its expression if it is inline."""
    return condition.name if is_named(condition) else show(condition.when)


def _row(row: Transition) -> tuple[TextLine, ...]:
    """The initial condition of a row, unless it only says that it always holds."""
    if row.condition.name == "always" and not row.trace.eq:
        return ()
    *most, last = wrap_lines(_condition(row.condition), _CONDITION) or ((),)
    return *most, last + equations(row.condition.trace.eq or row.trace.eq)


def _notes(subsystem: Subsystem) -> Iterator[Cells]:
    """What conditions with a name say, and what dashed arcs are."""
    used = {row.condition.name for row in subsystem.transitions}
    endings = [c for s in subsystem.states for _, c in s.behaviour.endings]
    used |= {condition.name for condition in endings if condition.when != m.FALSE}
    for condition in subsystem.conditions:
        if condition.name in used and is_named(condition):
            head = (TextRun(condition.name, "name"), *equations(condition.trace.eq))
            for number, each in enumerate(wrap_lines(show(condition.when), _EXPRESSION)):
                yield Cells((head if number == 0 else line(" "), each))
    if any(row.cause == "error" for row in subsystem.transitions):
        yield Cells((line("dashed", "italic"), line("after an error")))


# The data flow of functions, from inputs and memory through operators to what is assigned.

_COLUMNS = 24
_READ = (m.Input, m.MemoryRef, m.LetRef, m.ParameterRef)


def flow(subsystem: Subsystem, name: str, functions: Sequence[Function]) -> Diagram:
    """What the functions read, how it is combined, and what they assign.

    An operator is an ellipse, with those of its arguments that are constant below its name; other
    parts of expressions are written out, `#1` for the result of an operator in them.
    """
    drawn = _Flow()
    for let in _needed_lets(subsystem, functions):
        drawn.lets[let.name] = _Source(drawn.source(let.value, let.trace).id, let.name)
    fixed: list[Cells] = []
    for function, assigned in ((f, a) for f in functions for a in f.assignments):
        covered = f"{function.name}: {assigned.target}"
        # What memory gets is its value at the next time stamp.
        target = assigned.target if assigned.peer else f"next {assigned.name}"
        head = (TextRun(target, "name"), *equations(assigned.trace.eq or function.trace.eq))
        is_noted = len(functions) > 1 and is_named(function)
        note = line(function.name, "note") if is_noted else line("")
        if _is_read(assigned.value):
            drawn.assign(assigned, covered, (head, note))
        else:  # a row of a table (Tables 11, 12)
            first, *rest = wrap_lines(show(assigned.value), _COLUMNS * 2)
            fixed.append(Cells((head, first, note), (covered,)))
            fixed += (Cells((line(" "), each, line(" "))) for each in rest)
    nodes, notes = tuple(drawn.nodes.values()), tuple(fixed)
    if not nodes and notes:  # Graphviz draws no notes of nothing
        nodes, notes = (Box("constants", "table", (), notes),), ()
    return Diagram(f"{subsystem.qualified_name}.{name}", nodes, tuple(drawn.arcs), notes=notes)


def _needed_lets(subsystem: Subsystem, functions: Iterable[Function]) -> list[Let]:
    """The lets that functions read, also by way of other lets, each after those that it reads."""

    def read(expr: m.Expr) -> Iterator[str]:
        return (node.name for node in m.walk(expr) if isinstance(node, m.LetRef))

    lets = {let.name: let for let in subsystem.lets}
    first = (name for f in functions for a in f.assignments for name in read(a.value))
    names = reachable(first, lambda name: read(lets[name].value) if name in lets else ())
    return [let for let in subsystem.lets if let.name in names]


@dataclass(frozen=True, slots=True)
class _Source:
    """A node, and what is taken from it."""

    id: str
    label: str = ""


class _Flow:
    """Nodes and arcs as they are found; what is computed in the same way twice is one node."""

    def __init__(self) -> None:
        self.nodes: dict[str, Box] = {}
        self.arcs: list[Arc] = []
        self.lets: dict[str, _Source] = {}
        self._computed: dict[object, str] = {}

    def assign(self, assigned: Assignment, covered: str, lines: tuple[TextLine, ...]) -> None:
        """Add the node of a target and the arc to it."""
        id = f"assigned {covered}"
        while id in self.nodes:  # a second time, which is an error
            id += " again"
        source = self.source(assigned.value)
        look: Look = "output" if assigned.peer else "memory"
        self.nodes[id] = Box(id, look, lines, covers=(covered,))
        self._connect({source: []}, id)

    def source(self, expr: m.Expr, trace: Trace | None = None) -> _Source:
        """The node that gives the value of an expression."""
        match expr:
            case m.Unwrap(value=value):
                return self.source(value, trace)
            case m.LetRef(name=name) if name in self.lets:
                return self.lets[name]
            case m.Input(peer=peer, element=element):
                return self._leaf("input", f"x.{peer}.{element}")
            case m.MemoryRef(name=name):
                return self._leaf("memory", name)
            case m.ParameterRef(name=name):
                return self._leaf("input", name)
            case m.FieldOf(value=value) | m.Component(value=value) if _is_read(value):
                inner = self.source(value)
                last = show(expr).removeprefix(show(value))
                return _Source(inner.id, f"{inner.label}{last}")
            case m.Call(args=args):
                name = m.source_name(expr.operator)
                fixed = ", ".join(show(arg) for arg in args if not _is_read(arg))
                head = (TextRun(name, "name"), *equations(trace.eq if trace else ()))
                read: dict[_Source, list[str]] = {self.source(a): [] for a in args if _is_read(a)}
                return self._node("operator", name, (head, *wrap_lines(fixed, 20, "note", 3)), read)
        calls: list[m.Call] = []
        rest = _without_calls(expr, calls)
        text, sources = show(rest), dict[_Source, list[str]]()
        for number, call in enumerate(calls, 1):
            sources.setdefault(self.source(call), []).append(f"#{number}")
        for node in m.walk(rest):
            if isinstance(node, _READ):
                sources.setdefault(self.source(node), [])
        lines = list(wrap_lines(text, _COLUMNS, most=5))
        lines[-1] += equations(trace.eq if trace else ())
        return self._node("value", text, tuple(lines), sources)

    def _leaf(self, look: Look, name: str) -> _Source:
        self.nodes.setdefault(name, Box(name, look, (line(name),), covers=(name,)))
        return _Source(name)

    def _node(
        self, look: Look, name: str, lines: tuple[TextLine, ...], sources: dict[_Source, list[str]]
    ) -> _Source:
        key = name, lines[1:], tuple((each, *labels) for each, labels in sources.items())
        if key not in self._computed:
            id = f"{len(self._computed) + 1} {name[:40]}"
            self._computed[key] = id
            self.nodes[id] = Box(id, look, lines)
            self._connect(sources, id)
        return _Source(self._computed[key])

    def _connect(self, sources: dict[_Source, list[str]], head: str) -> None:
        """One arc from each node, whatever is taken from it."""
        labels = grouped(
            (source.id, " ".join(filter(None, (*labels, source.label))))
            for source, labels in sources.items()
        )
        for tail, texts in labels.items():
            lines = tuple(line(text) for text in dict.fromkeys(texts) if text)
            self.arcs.append(Arc(tail, head, lines))


def _is_read(expr: m.Expr) -> bool:
    """Whether a value is more than constants."""
    return any(isinstance(node, (*_READ, m.Call)) for node in m.walk(expr))


def _without_calls(expr: m.Expr, calls: list[m.Call]) -> m.Expr:
    """An expression with a sign in the place of each operator, which are added to `calls`."""
    if isinstance(expr, m.Call):
        calls.append(expr)
        return m.BoundVariable(f"#{len(calls)}", type=expr.type)
    if isinstance(expr, m.Quantifier):
        return expr
    return m.map_children(expr, lambda part: _without_calls(part, calls))
