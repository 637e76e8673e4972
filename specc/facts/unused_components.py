"""Where the value `_` of a component that is not used can come to: through buffers and memory."""

from __future__ import annotations

from dataclasses import dataclass, field

from specc.facts.connections import Connections
from specc.model.expr import Call, Expr, Input, LetRef, MemoryRef, Unused, children
from specc.model.system import Subsystem

_LET = "let "  # no peer has a space in its name


@dataclass(slots=True)
class Carriers:
    """Inputs, memory elements and lets that may hold `_`: subsystem, peer or kind, and name.

    Operators let none through, and what devices measure is a number.
    """

    connections: Connections
    _found: set[tuple[str, str, str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        size = -1
        while len(self._found) > size:
            size = len(self._found)
            for subsystem in self.connections.subsystems.values():
                self._follow(subsystem)

    def in_conditions(self, subsystem: Subsystem) -> bool:
        """Whether a condition of the subsystem may meet one."""
        return any(self.may_be_unused(c.when, subsystem) for c in subsystem.conditions)

    def may_be_unused(self, expr: Expr, subsystem: Subsystem) -> bool:
        """Whether the value of an expression may have a component that is not used."""
        match expr:
            case Unused():
                return True
            case Call():
                return False
            case Input(peer=peer, element=element):
                return (subsystem.qualified_name, peer, element) in self._found
            case MemoryRef(name=name):
                return (subsystem.qualified_name, "", name) in self._found
            case LetRef(name=name):
                return (subsystem.qualified_name, _LET, name) in self._found
        return any(self.may_be_unused(child, subsystem) for child in children(expr))

    def _follow(self, subsystem: Subsystem) -> None:
        name = subsystem.qualified_name
        for item in subsystem.lets:  # in order of dependence, so each is looked at once
            if self.may_be_unused(item.value, subsystem):
                self._found.add((name, _LET, item.name))
        for memory in subsystem.memory:
            if self.may_be_unused(memory.init, subsystem):
                self._found.add((name, "", memory.name))
        for port in subsystem.ports:
            for element in port.elements if port.direction == "x" else ():
                if element.init is not None and self.may_be_unused(element.init, subsystem):
                    self._found.add((name, port.peer, element.name))
        for function in subsystem.functions:
            for assignment in function.assignments:
                if self.may_be_unused(assignment.value, subsystem):
                    self._found |= self._targets(subsystem, assignment.peer, assignment.name)

    def _targets(self, subsystem: Subsystem, peer: str, name: str) -> set[tuple[str, str, str]]:
        if not peer:
            return {(subsystem.qualified_name, "", name)}
        port = subsystem.port("y", peer)
        end = self.connections.other_port(subsystem, port) if port else None
        return {(port.other_end, end.peer, name)} if port and end else set()
