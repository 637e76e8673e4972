"""Where NaN can come to, through buffers and memory: components that are not used, and results."""

from __future__ import annotations

from dataclasses import dataclass, field

from specc.facts.connections import Connections
from specc.model.expr import (
    Binary,
    Builtin,
    Call,
    Choice,
    Clock,
    ConstantRef,
    Expr,
    Input,
    LetRef,
    MemoryRef,
    Number,
    Unused,
    children,
)
from specc.model.system import Subsystem
from specc.model.types import ListOf, OptionalOf, Pose, Real, Record, Spatial, Type, Vector

_LET = "let "  # no peer has a space in its name


@dataclass(slots=True)
class Carriers:
    """Inputs, memory elements and lets that may hold NaN: subsystem, peer or kind, and name.

    It comes from `_`, from operators, of which nothing is known, and from a division by zero. What
    devices measure is a number.
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
        """Whether the value of an expression may be NaN, or have a component that is."""
        match expr:
            case Unused():
                return True
            case Call():
                return has_reals(expr.type)
            case Binary(op="/", right=right) if not _is_constant(right):
                return True
            case Builtin(name="len"):
                return False
            case Choice(then=then, otherwise=otherwise):
                return any(self.may_be_unused(part, subsystem) for part in (then, otherwise))
            case Input() | MemoryRef() | LetRef():
                return (subsystem.qualified_name, *_name(expr)) in self._found
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


def _name(expr: Input | MemoryRef | LetRef) -> tuple[str, str]:
    if isinstance(expr, Input):
        return expr.peer, expr.element
    return "" if isinstance(expr, MemoryRef) else _LET, expr.name


def has_reals(type_: Type) -> bool:
    """Whether a value of the type has real numbers in it."""
    match type_:
        case Real() | Spatial() | Pose():
            return True
        case Vector(element=element) | ListOf(element=element):
            return has_reals(element)
        case OptionalOf(value=value):
            return has_reals(value)
        case Record(fields=fields):
            return any(has_reals(field) for _, field in fields)
    return False


def is_real(expr: Expr) -> bool:
    """Whether the value of an expression has real numbers in it that are not written down."""
    return has_reals(expr.type) and not isinstance(expr, (Number, Clock))


def _is_constant(divisor: Expr) -> bool:
    """Whether a divisor is written down, and not zero as far as that shows."""
    if isinstance(divisor, Number):
        return divisor.value != 0
    return isinstance(divisor, ConstantRef) or (
        isinstance(divisor, Clock) and divisor.name == "period"
    )
