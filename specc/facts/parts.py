"""Which named parts of a subsystem serve it, directly or through others."""

from __future__ import annotations

from collections.abc import Iterable

from specc.expr import RESERVED
from specc.model.expr import Expr, LetRef, MemoryRef, walk
from specc.model.fsm import Behaviour, Condition, Function
from specc.model.system import Let, Memory, Subsystem

Part = Behaviour | Condition | Function | Let | Memory


class Parts:
    """The parts of a subsystem by kind and name, e.g. `let T_c`; `watched` memory is used."""

    def __init__(self, subsystem: Subsystem, watched: Iterable[str]) -> None:
        self.known = {_label(part): part for part in _parts(subsystem)}
        self.names = {label: _names(part) for label, part in self.known.items()}
        self._started = {f"behaviour {state.behaviour.name}" for state in subsystem.states}
        self._started |= {_label(row.condition) for row in subsystem.transitions}
        self._started |= {label for axiom in subsystem.axioms for label in _read(axiom.that)}
        self._started |= {f"memory element {name}" for name in watched}
        # Nothing can name these in an expression, which is an error of its own.
        readable = [p for p in self.known.values() if isinstance(p, Let | Memory)]
        self._started |= {_label(part) for part in readable if part.name in RESERVED}

    def unused(self) -> list[str]:
        """The parts that no other one names, in the order of their kinds and of the file."""
        named = self._started.union(*self.names.values())
        return [label for label in self.known if label not in named]

    def behind(self, label: str) -> list[str]:
        """The parts that serve no other purpose than an unused one."""
        used, found = self._closure(self._started), self._closure(self.names[label])
        return [other for other in self.known if other in found - used]

    def _closure(self, start: Iterable[str]) -> set[str]:
        found, open_ = set(start), list(start)
        while open_:
            new = self.names.get(open_.pop(), frozenset()) - found
            found |= new
            open_ += new
        return found


def _parts(subsystem: Subsystem) -> Iterable[Part]:
    yield from subsystem.behaviours
    yield from subsystem.functions
    yield from subsystem.conditions
    yield from subsystem.lets
    yield from subsystem.memory


def _label(part: Part) -> str:
    match part:
        case Condition():
            return f"{part.kind} condition {part.name}"
        case Memory():
            return f"memory element {part.name}"
    return f"{type(part).__name__.lower()} {part.name}"


def _names(part: Part) -> frozenset[str]:
    """The parts that a part names; what a function writes is not unused, if perhaps not read."""
    match part:
        case Behaviour():
            functions = {f"function {function.name}" for function in part.functions}
            return frozenset(functions | {_label(part.terminal), _label(part.error)})
        case Function():
            read = {label for a in part.assignments for label in _read(a.value)}
            return frozenset(
                read | {f"memory element {a.name}" for a in part.assignments if not a.peer}
            )
        case Condition():
            return _read(part.when)
        case Let():
            return _read(part.value)
    return frozenset()


def _read(expression: Expr) -> frozenset[str]:
    found = set()
    for node in walk(expression):
        if isinstance(node, LetRef):
            found.add(f"let {node.name}")
        elif isinstance(node, MemoryRef):
            found.add(f"memory element {node.name}")
    return frozenset(found)
