"""The data flow of functions, from inputs and memory through operators to what is assigned.

Figs 11-13, 18, 23, 24.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from specc.lang.show import show
from specc.model import expr as m
from specc.model.fsm import Assignment, Function, Trace
from specc.model.system import Let, Subsystem
from specc.reachable import grouped, reachable
from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cells,
    Diagram,
    Look,
    TextLine,
    TextRun,
    broken,
    equations,
    line,
)
from specc.tools.graph.names import is_named

_COLUMNS = 24
_READ = (m.Input, m.MemoryRef, m.LetRef)


def flow(subsystem: Subsystem, name: str, functions: Sequence[Function]) -> Diagram:
    """What the functions read, how it is combined, and what they assign.

    An operator is an ellipse, with those of its arguments that are constant below its name; other
    parts of expressions are written out, `#1` for the result of an operator in them.
    """
    drawn = _Flow()
    for let in _needed(subsystem, functions):
        found = drawn.source(let.value, let.trace)
        drawn.lets[let.name] = _Source(found.id, let.name)
    fixed = []
    for target in (_Target(f, a, len(functions) > 1) for f in functions for a in f.assignments):
        if _is_read(target.assigned.value):
            drawn.assign(target)
        else:
            fixed.append(target)
    nodes, notes = tuple(drawn.nodes.values()), tuple(_constants(fixed))
    if not nodes and notes:  # Graphviz draws no notes of nothing
        nodes, notes = (Box("constants", "table", (), notes),), ()
    return Diagram(f"{subsystem.qualified_name}.{name}", nodes, tuple(drawn.arcs), notes=notes)


def _needed(subsystem: Subsystem, functions: Iterable[Function]) -> list[Let]:
    """The lets that functions read, also by way of other lets, each after those that it reads."""
    lets = {let.name: let for let in subsystem.lets}
    first = (name for f in functions for a in f.assignments for name in _named(a.value))
    names = reachable(first, lambda name: _named(lets[name].value) if name in lets else ())
    return [let for let in subsystem.lets if let.name in names]


def _named(expr: m.Expr) -> Iterator[str]:
    return (node.name for node in m.walk(expr) if isinstance(node, m.LetRef))


@dataclass(frozen=True, slots=True)
class _Target:
    """What a function assigns; the function is named where there are several."""

    function: Function
    assigned: Assignment
    is_named: bool

    @property
    def covered(self) -> str:
        return f"{self.function.name}: {self.assigned.target}"

    @property
    def head(self) -> TextLine:
        """Its name; what memory gets is its value at the next time stamp."""
        name = self.assigned.target if self.assigned.peer else f"next {self.assigned.name}"
        return TextRun(name, "name"), *equations(self.assigned.trace.eq or self.function.trace.eq)

    @property
    def note(self) -> TextLine:
        return (
            line(self.function.name, "note")
            if self.is_named and is_named(self.function)
            else line("")
        )


def _constants(targets: Iterable[_Target]) -> Iterator[Cells]:
    """Targets that get constants, as rows of a table (Tables 11, 12)."""
    for target in targets:
        first, *rest = broken(show(target.assigned.value), _COLUMNS * 2)
        yield Cells((target.head, first, target.note), (target.covered,))
        yield from (Cells((line(" "), each, line(" "))) for each in rest)


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

    def assign(self, target: _Target) -> None:
        """The node of a target, and the arc to it."""
        id = f"assigned {target.covered}"
        while id in self.nodes:  # a second time, which is an error
            id += " again"
        look: Look = "output" if target.assigned.peer else "memory"
        lines = target.head, target.note
        source = self.source(target.assigned.value)
        self.nodes[id] = Box(id, look, lines, covers=(target.covered,))
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
            case m.FieldOf(value=value) | m.Component(value=value) if _is_read(value):
                inner = self.source(value)
                last = show(expr).removeprefix(show(value))
                return _Source(inner.id, f"{inner.label}{last}")
            case m.Call():
                return self._call(expr, trace or Trace())
        return self._combined(expr, trace or Trace())

    def _leaf(self, look: Look, name: str) -> _Source:
        self.nodes.setdefault(name, Box(name, look, (line(name),), covers=(name,)))
        return _Source(name)

    def _call(self, call: m.Call, trace: Trace) -> _Source:
        read = [self.source(arg) for arg in call.args if _is_read(arg)]
        fixed = ", ".join(show(arg) for arg in call.args if not _is_read(arg))
        name = m.source_name(call.operator)
        lines = ((TextRun(name, "name"), *equations(trace.eq)), *broken(fixed, 20, "note", most=3))
        return self._node("operator", name, lines, {each: [] for each in read})

    def _combined(self, expr: m.Expr, trace: Trace) -> _Source:
        calls: list[m.Call] = []
        text = show(_without_calls(expr, calls))
        sources: dict[_Source, list[str]] = {}
        for number, call in enumerate(calls, 1):
            sources.setdefault(self.source(call), []).append(f"#{number}")
        for node in m.walk(_without_calls(expr, [])):
            if isinstance(node, _READ):
                sources.setdefault(self.source(node), [])
        lines = list(broken(text, _COLUMNS, most=5))
        lines[-1] += equations(trace.eq)
        return self._node("value", text, tuple(lines), sources)

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
        together = grouped(
            (source.id, " ".join(filter(None, (*labels, source.label))))
            for source, labels in sources.items()
        )
        for tail, texts in together.items():
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
