"""Pictures of a machine: its states (Figs 10, 17, 22), and what its functions compute
(Figs 11-13, 18, 23, 24)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from specc.lang.show import show
from specc.model import expr as m
from specc.model.fsm import (
    Assignment,
    Cause,
    Condition,
    Function,
    Mode,
    State,
    Trace,
    Transition,
)
from specc.model.system import Let, Subsystem
from specc.reachable import grouped, reachable
from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cells,
    Cluster,
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
_COLUMN = 3
"""States of a mode from which on it stands beside what is before and behind it."""


def states(subsystem: Subsystem) -> Diagram:
    """A node for each state, a frame for each mode, an arc for the rows of one kind of cause
    between two of them."""
    rows = subsystem.transitions
    own = {state.name: _state(subsystem, state) for state in subsystem.states}
    ends = dict.fromkeys(end for row in rows for end in (row.source, row.target))
    missing = (line("not there", "note"),)
    modes = _Modes(subsystem, own)
    nodes = [own[state.name] for state in subsystem.states if not state.modes]
    nodes += [Box(end, "missing", (line(end), *missing)) for end in ends if end not in own]
    by_ends = grouped(
        ((row.source_mode or row.source, _head(row), row.cause == "terminal"), n)
        for n, row in enumerate(rows)
    )
    arcs: list[Arc] = []
    for (tail, head, is_terminal), numbers in by_ends.items():
        stroke: Stroke = "solid" if is_terminal else "error"
        written = grouped((rows[n].place, rows[n]) for n in numbers).values()
        lines = tuple(each for flat in written for each in _row(flat))
        covers = tuple(map(str, numbers))
        arcs += modes.arcs(tail, head, rows[numbers[0]], lines, stroke, covers)
    if subsystem.has_initial_state and subsystem.initial_state in own:
        nodes.insert(0, Box(_START, "start", ()))
        arcs.insert(0, Arc(_START, subsystem.initial_state))
        if subsystem.modes:
            modes.levels.append((_START, subsystem.initial_state))
    arcs += modes.starts
    nodes += modes.marks.get("", {}).values()
    notes = tuple(_notes(subsystem))
    groups = tuple(modes.frame(mode) for mode in subsystem.modes if not mode.parent)
    levels = tuple(modes.levels)
    return Diagram(subsystem.qualified_name, tuple(nodes), tuple(arcs), groups, levels, notes)


def _head(row: Transition) -> str:
    """What a row leads to: a mode that it resumes, a mode, or a state."""
    return f"resume {row.resumes}" if row.resumes else row.target_mode or row.target


def _start(mode: str) -> str:
    return f"start of {mode}"


def _history(mode: str) -> str:
    return f"history of {mode}"


def _any(mode: str) -> str:
    return f"any state of {mode}"


@dataclass(eq=False, slots=True)
class _Modes:
    """The frames of modes, with marks inside where arcs begin or end."""

    subsystem: Subsystem
    own: Mapping[str, Box]
    """The nodes of states."""
    marks: dict[str, dict[str, Box]] = field(default_factory=dict)
    """Mode -> marks in its frame by their names; "" has those outside of all."""
    starts: list[Arc] = field(default_factory=list)
    """From the mark at which a mode is entered to its initial state."""
    levels: list[tuple[str, ...]] = field(default_factory=list)

    def arcs(
        self,
        tail: str,
        head: str,
        row: Transition,
        lines: tuple[TextLine, ...],
        stroke: Stroke,
        covers: tuple[str, ...],
    ) -> Iterator[Arc]:
        """The arc of rows between states and modes; `row` is one of them.

        Graphviz would place a text as if the arc began and ended at nodes, so the text of one that
        ends at a frame is a node outside.
        """
        tail, tail_frame = self._tail(tail, row)
        head, head_frame = self._head(head, row)
        if not lines or not (tail_frame or head_frame):
            is_loose = self._is_between_columns(tail, head)
            yield Arc(tail, head, lines, stroke, "down", covers, tail_frame, head_frame, is_loose)
            return
        text = f"text {' '.join(covers)}"
        around = [self._around(row.source, tail_frame), self._around(row.target, head_frame)]
        common = [mode for mode in around[0] if mode in around[1]]
        self._mark(common[-1] if common else "", Box(text, "value", lines))
        yield Arc(tail, text, (), stroke, "none", (), tail_frame)
        yield Arc(text, head, (), stroke, "down", covers, "", head_frame)

    def _tail(self, tail: str, row: Transition) -> tuple[str, str]:
        """The node at which the arc of a row begins, and the frame, if it does at a frame."""
        if not row.source_mode:
            return tail, ""
        inside = self.subsystem.mode(row.source_mode).states
        if row.target in inside:
            # Graphviz has no arc from a frame to what is in it.
            return self._mark(tail, Box(_any(tail), "value", (line("any", "italic"),))), ""
        # From the second state it goes to the side of the frame, above what the frame is left for.
        return inside[:2][-1], tail

    def _head(self, head: str, row: Transition) -> tuple[str, str]:
        """The node at which it ends, and the frame, if it does at a frame."""
        if row.resumes:
            sign = "H*" if self._inner(row.resumes) else "H"
            mark = Box(_history(row.resumes), "history", (line(sign),))
            return self._mark(row.resumes, mark), ""
        if not row.target_mode:
            return head, ""
        mode = self.subsystem.mode(head)
        if _start(head) not in self.marks.get(head, ()):
            self.starts.append(Arc(_start(head), mode.initial))
            if self._mode_of(mode.initial) == head:
                self.levels.append((_start(head), mode.initial))
        is_inside = row.source in mode.states
        return self._mark(head, Box(_start(head), "start", ())), "" if is_inside else head

    def _around(self, state: str, frame: str) -> tuple[str, ...]:
        """The modes around a state, or around one of these that has a frame."""
        modes = self.subsystem.state(state).modes
        return modes[: modes.index(frame)] if frame else modes

    def _mark(self, mode: str, box: Box) -> str:
        return self.marks.setdefault(mode, {}).setdefault(box.id, box).id

    def _is_between_columns(self, tail: str, head: str) -> bool:
        """Whether an arc crosses a frame that is high enough to have a column of its own."""
        ends = [{*self._modes_around(self._mode_of(node))} for node in (tail, head)]
        crossed = (self.subsystem.mode(name) for name in ends[0] ^ ends[1])
        return any(len(mode.states) >= _COLUMN for mode in crossed)

    def _modes_around(self, mode: str) -> Iterator[str]:
        """A mode and those around it; none for ""."""
        while mode:
            yield mode
            mode = self.subsystem.mode(mode).parent

    def _mode_of(self, node: str) -> str:
        """The innermost mode around a state or a mark; "" if there is none."""
        marked = {name: mode for mode, marks in self.marks.items() for name in marks}
        around = {state.name: state.modes[-1] for state in self.subsystem.states if state.modes}
        return (around | marked).get(node, "")

    def _inner(self, name: str) -> list[Mode]:
        return [mode for mode in self.subsystem.modes if mode.parent == name]

    def frame(self, mode: Mode) -> Cluster:
        """The frame of a mode, with its error conditions."""
        lines = [
            (TextRun(mode.name, "name"), *equations(mode.trace.eq)),
            *wrap_lines(mode.title, 46),
        ]
        for cause, condition in mode.errors:
            lines += _ending(cause, condition, 46)
        states = (s.name for s in self.subsystem.states if s.modes[-1:] == (mode.name,))
        nodes = *self.marks.get(mode.name, {}).values(), *(self.own[name] for name in states)
        groups = tuple(map(self.frame, self._inner(mode.name)))
        return Cluster(mode.name, tuple(lines), nodes, groups, "mode")


def _state(subsystem: Subsystem, state: State) -> Box:
    behaviour = state.behaviour
    name = [TextRun(state.name, "name")]
    if behaviour.name != state.name:
        name += (TextRun("  "), TextRun(behaviour.name, "italic"))
    lines = [
        (*name, *equations(behaviour.trace.eq)),
        *wrap_lines(state.title or behaviour.title, 34),
    ]
    around = sum(len(subsystem.mode(mode).errors) for mode in state.modes)
    for cause, condition in reversed(behaviour.endings[around:]):
        if condition.when != m.FALSE:
            lines += _ending(cause, condition, 36)
    if state.holds:
        names = ", ".join(f"y.{peer}.{name}" for peer, name in state.holds)
        lines += wrap_lines(f"holds {names}", 36, "note")
    return Box(state.name, "state", tuple(lines), covers=(state.name,))


def _ending(cause: Cause, condition: Condition, columns: int) -> list[TextLine]:
    """A terminal or error condition in a box, by the name of its cause if it has one."""
    text = _condition(condition)
    name = f" {cause}" if cause not in ("terminal", "error", text) else ""
    sign = "ends" if cause == "terminal" else f"error{name}"
    when = " at once" if condition.when == m.TRUE else f": {text}"
    *most, last = wrap_lines(f"{sign}{when}", columns, "note")
    return [*most, last + equations(condition.trace.eq)]


def _condition(condition: Condition) -> str:
    """The condition's name, or its expression if it is inline."""
    return condition.name if is_named(condition) else show(condition.when)


def _row(rows: Sequence[Transition]) -> tuple[TextLine, ...]:
    """The cause, if it has a name, and the initial condition of a row of the file.

    A condition that always holds is left out. `rows` are those of the flat machine.
    """
    row = rows[0]
    causes = {each.cause for each in rows}
    cause = row.cause if len(causes) == 1 and row.cause not in ("terminal", "error") else ""
    is_always = row.condition.name == "always"
    if is_always and not row.trace.eq and not cause:
        return ()
    text = "" if is_always and cause else _condition(row.condition)
    text = ": ".join(filter(None, (cause, text)))
    *most, last = wrap_lines(text, _CONDITION) or ((),)
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
    if any(row.cause != "terminal" for row in subsystem.transitions):
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
