"""What is defined, sent or remembered without being used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set

from specc.analysis import Facts
from specc.analysis.reads import inputs_read, nodes
from specc.diagnostics import Diagnostic, Related
from specc.lang import RESERVED
from specc.model.expr import Call, ConstantRef, Expr, FileRef, LetRef, MemoryRef, walk
from specc.model.fsm import Behaviour, Condition, Function
from specc.model.system import Definition, Let, Memory, Subsystem, System
from specc.reachable import reachable

NONE: frozenset[str] = frozenset()

# Which named parts of a subsystem serve it, directly or through others.


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
        self._used = _closure(self._started, self.names)
        self._order = {label: index for index, label in enumerate(self.known)}

    def unused(self) -> list[str]:
        """The parts that no other one names, in the order of their kinds and of the file."""
        named = self._started.union(*self.names.values())
        return [label for label in self.known if label not in named]

    def behind(self, label: str) -> list[str]:
        """The parts that serve no other purpose than an unused one."""
        found = _closure(self.names[label], self.names, self._used) & self._order.keys()
        return sorted(found, key=self._order.__getitem__)


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


# Which definitions of the main file serve its agents, directly or through others.


def unused(system: System) -> Iterator[tuple[Definition, tuple[Definition, ...]]]:
    """What nothing uses, each with the others that only it uses."""
    edges = _edges(system)
    used = _closure(_needed_by_agents(system), edges)
    idle = {d.label: d for d in system.definitions if d.label not in used}
    order = {label: index for index, label in enumerate(idle)}
    inner = {label for one in idle for label in edges.get(one, ()) if label != one}
    for label, definition in idle.items():
        if label not in inner:
            behind = _closure(edges.get(label, NONE), edges, used) & idle.keys()
            yield definition, tuple(idle[o] for o in sorted(behind, key=order.__getitem__))


def _needed_by_agents(system: System) -> set[str]:
    found = set(system.named_in_agents)
    for subsystem in system.subsystems:
        found |= _labels(nodes(subsystem))
    for device in system.devices:
        for _, safe in device.safe:
            found |= _labels(walk(safe.value))
            found |= _labels(walk(safe.otherwise)) if safe.otherwise else set()
    return found


def _edges(system: System) -> dict[str, frozenset[str]]:
    edges = {d.label: d.names for d in system.definitions}
    for constant in system.constants:
        label = f"constant {constant.name}"
        edges[label] = edges.get(label, frozenset()) | _labels(walk(constant.value))
    return edges


def _labels(nodes: Iterable[Expr]) -> frozenset[str]:
    """The definitions that parts of expressions name."""
    found = set()
    for node in nodes:
        if isinstance(node, Call):
            found.add(f"operator {node.operator}")
        elif isinstance(node, ConstantRef):
            found.add(f"constant {node.name}")
        elif isinstance(node, FileRef):
            found.add(f"file {node.name}")
    return frozenset(found)


def _closure(start: Set[str], edges: Mapping[str, Set[str]], without: Set[str] = NONE) -> Set[str]:
    """What the start leads to, itself included, but not through what is left out."""
    return reachable(start - without, lambda one: edges.get(one, NONE) - without).keys()


# Every named part of a subsystem is used somewhere in it.


MOST = 8
"""Parts that are shown with one that is not used."""


def parts_used(facts: Facts) -> Iterator[Diagnostic]:
    """W0611; what only unused parts use is shown with them."""
    task = facts.system.task
    for machine in facts.whole:
        subsystem = machine.subsystem
        watched = task.watch if task and task.subsystem == subsystem.qualified_name else ()
        parts = Parts(subsystem, watched)
        for label in parts.unused():
            yield Diagnostic(
                "W0611",
                f"{_quoted(label)} is not used",
                parts.known[label].place,
                related=tuple(
                    Related(parts.known[other].place, f"and so is {_quoted(other)}")
                    for other in parts.behind(label)[:MOST]
                ),
                help="use or delete it",
            )


def _quoted(label: str) -> str:
    kind, _, name = label.rpartition(" ")
    return f"{kind} `{name}`"


# What the main file defines for all agents is used by one of them.


"""Definitions that are shown with one that is not used."""


def definitions_used(facts: Facts) -> Iterator[Diagnostic]:
    """W0240, once there are agents; a library may well define more than one system needs.

    What only unused definitions use is shown with them.
    """
    if not facts.system.subsystems:
        return
    for definition, behind in unused(facts.system):
        related = [
            Related(other.place, f"and so is {other.kind} `{other.name}`")
            for other in behind[:MOST]
        ]
        yield Diagnostic(
            "W0240",
            f"{definition.kind} `{definition.name}` is not used",
            definition.place,
            related=tuple(related),
            help="use or delete it",
        )


# What is sent to a subsystem is read there.


def elements_read(facts: Facts) -> Iterator[Diagnostic]:
    """W0412, at the end that receives the element.

    What devices and reused descriptions send is not for the reader to choose.
    """
    for subsystem in facts.subsystems:
        read = inputs_read(subsystem)
        for port in subsystem.ports:
            sender = facts.connections.subsystems.get(port.other_end)
            if port.direction == "y" or sender is None or _is_given(sender, subsystem):
                continue
            for element in port.elements:
                if (port.peer, element.name) not in read:
                    yield Diagnostic(
                        "W0412",
                        f"`{subsystem.qualified_name}` never reads `x.{port.peer}.{element.name}`",
                        element.place,
                        related=(Related(sender.place, f"`{port.other_end}` has it in its `y`"),),
                        help="use it, or delete it at both ends",
                    )


def _is_given(sender: Subsystem, reader: Subsystem) -> bool:
    return sender.place.file != reader.place.file


# Every element of an output buffer is written by some behaviour.


def elements_written(facts: Facts) -> Iterator[Diagnostic]:
    """W0413."""
    for subsystem in facts.subsystems:
        behaviours = {state.behaviour.name: state.behaviour for state in subsystem.states}
        written = {(a.peer, a.name) for b in behaviours.values() for a in b.assignments}
        for port in subsystem.ports:
            for element in port.elements if port.direction == "y" else ():
                if (port.peer, element.name) in written:
                    continue
                reader = facts.connections.subsystems.get(port.other_end)
                yield Diagnostic(
                    "W0413",
                    f"no behaviour of `{subsystem.qualified_name}` writes "
                    f"`y.{port.peer}.{element.name}`",
                    element.place,
                    "never sent",
                    (Related(reader.place, "waits for it forever"),) if reader else (),
                    "write it in a function of a behaviour, or delete it at both ends",
                )


# What is remembered is used for something.


def memory_read(facts: Facts) -> Iterator[Diagnostic]:
    """W0615; memory that is not even written is `parts_used`'s matter."""
    task = facts.system.task
    for subsystem in facts.subsystems:
        read = {node.name for node in nodes(subsystem) if isinstance(node, MemoryRef)}
        if task and task.subsystem == subsystem.qualified_name:
            read.update(task.watch)
        writers = {a.name: a for f in subsystem.functions for a in f.assignments if not a.peer}
        for element in subsystem.memory:
            if element.name in writers and element.name not in read:
                yield Diagnostic(
                    "W0615",
                    f"memory element `{element.name}` is written and never read",
                    element.place,
                    related=(Related(writers[element.name].place, "written here"),),
                    help="read it, delete it, or list it under `watch:` of the task",
                )


CHECKS = (parts_used,)
USES = (definitions_used, elements_read, elements_written, memory_read)
