"""Buffers, memory and lets of a subsystem: what its expressions may refer to."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from graphlib import CycleError, TopologicalSorter
from typing import Literal

from specc.diagnostics import nearest
from specc.lang import RESERVED, Declared, ExprError, Scope, parse
from specc.lang.parse import names_in
from specc.model.system import Let, Memory, Port
from specc.resolve.context import SourceValue, trace_of, unknown_at
from specc.resolve.definitions import inlined
from specc.resolve.elements import all_elements
from specc.resolve.expressions import Expressions
from specc.resolve.library import constant_scope
from specc.schema.subsystem import BufferDef, SubsystemDef

DEEPEST_LET = 100
"""Longest chain of lets that depend on each other; nobody reads more, and passes recurse."""


@dataclass(eq=False, slots=True)
class Buffers:
    """The static declarations of a subsystem: ports, memory, lets, and their scope."""

    ports: tuple[Port, ...] = ()
    """As they are declared; `other_end` is "" where the peer is unknown."""
    memory: tuple[Memory, ...] = ()
    lets: tuple[Let, ...] = ()
    scope: Scope = field(default_factory=Scope)


def resolve_buffers(
    definition: SubsystemDef, where: SourceValue, ends: Mapping[str, str], expressions: Expressions
) -> Buffers:
    """Resolve ports (`ends`: peer -> name of the other end), memory and lets, in this order."""
    ports = _ports(definition, where, ends, expressions)
    inputs = {
        (port.peer, element.name): Declared(element.type, element.place)
        for port in ports
        for element in (port.elements if port.direction == "x" else ())
    }
    expressions.broken |= _twice(definition, expressions)
    constants = _without(constant_scope(expressions.definitions), expressions.broken)
    outside = replace(constants, inputs=inputs, later=expressions.later)
    memory = _memory(definition, where, outside, expressions)
    known = _without(outside, expressions.broken)
    clear = {m.name: Declared(m.type, m.place) for m in memory if _is_clear(m.name, expressions)}
    inside = replace(known, memory=clear, later=(), allow_clock=True)
    resolver = _Lets(definition, where["let"], inside, expressions)
    return Buffers(ports, memory, resolver.resolve(), resolver.scope)


def _twice(definition: SubsystemDef, expressions: Expressions) -> set[str]:
    """Names that stand for two things here; what expressions mean by them is not known."""
    constants, files = expressions.definitions.constants, expressions.definitions.files
    memory, lets = definition.memory.keys(), definition.let.keys()
    outside = {name for name in memory | lets if name in constants or name in files}
    return (memory & lets) | outside


def _is_clear(name: str, expressions: Expressions) -> bool:
    """Whether expressions mean a memory element or a let by its name."""
    return name not in expressions.broken and name not in RESERVED


def _without(scope: Scope, broken: Collection[str]) -> Scope:
    """The scope without constants and files whose names could mean something with an error."""
    constants = scope.constants
    if any(name in constants for name in broken):
        constants = {name: type for name, type in constants.items() if name not in broken}
    files = {name: known for name, known in scope.files.items() if name not in broken}
    return replace(scope, constants=constants, files=files)


def _ports(
    definition: SubsystemDef, where: SourceValue, ends: Mapping[str, str], expressions: Expressions
) -> tuple[Port, ...]:
    ports = []
    directions: tuple[tuple[Literal["x", "y"], Mapping[str, BufferDef]], ...] = (
        ("x", definition.x),
        ("y", definition.y),
    )
    for direction, buffers in directions:
        for peer, buffer in buffers.items():
            at = where[direction][peer]
            own = _port(peer, direction, buffer, at, expressions)
            if peer not in ends:
                expressions.unresolved |= {f"{direction}.{end}" for end in nearest(peer, ends)}
            ports.append(replace(own, other_end=ends.get(peer, "")))
    return tuple(ports)


def _port(
    peer: str,
    direction: Literal["x", "y"],
    buffer: BufferDef,
    at: SourceValue,
    expressions: Expressions,
) -> Port:
    """A port that has the elements of an interface, if the buffer names one, and its own."""
    found, shared = all_elements(buffer, at, direction, expressions)
    if (buffer.elements and not found) or (buffer.interface and not shared):
        expressions.broken.add(peer)
    if buffer.interface and not shared:
        expressions.unresolved.add(f"{direction}.{peer}")
    return Port(peer, direction, found, "", at.key, shared)


def _memory(
    definition: SubsystemDef, where: SourceValue, scope: Scope, expressions: Expressions
) -> tuple[Memory, ...]:
    found = []
    for name, item in definition.memory.items():
        at = where["memory"][name]
        type_ = expressions.type(at["type"], item.type)
        init = None
        if item.init is None:
            message = f"memory element `{name}` has no initial value"
            help_text = "add `init:`, the value in the first period"
            expressions.findings.report("O0203", message, at.key, help=help_text)
        elif type_ is not None:
            indices, inside = expressions.indexed(item.each, at, scope)
            init = expressions.value(at["init"], item.init, inside, type_, at.key)
            init = inlined(init, indices) if init else None
        if type_ is None:
            expressions.broken.add(name)
        else:
            init = init or unknown_at(at, type_)
            found.append(Memory(name, type_, init, item.title, trace_of(item), at.key))
    return tuple(found)


@dataclass(eq=False, slots=True)
class _Lets:
    """Lets in order of dependence. One that depends on itself is reported with its cycle.

    `scope` is what a let may name; in the end, it has all of them.
    """

    definition: SubsystemDef
    where: SourceValue
    scope: Scope
    expressions: Expressions
    _numbers: dict[str, int] = field(default_factory=dict)

    def resolve(self) -> tuple[Let, ...]:
        self._numbers = {name: number for number, name in enumerate(self.definition.let)}
        found: list[Let] = []
        depths: dict[str, int] = {}
        # One scope, which grows: in this order each let finds those that it may name.
        lets: dict[str, Declared] = {}
        self.scope = replace(self.scope, lets=lets, lets_to_come=self.definition.let.keys())
        uses = {name: self._uses(name) for name in self.definition.let}
        for name in self._order(uses):
            item, at = self.definition.let[name], self.where[name]
            depths[name] = 1 + max((depths.get(used, 0) for used in uses[name]), default=0)
            if depths[name] > DEEPEST_LET:
                self._too_deep(name, is_first=depths[name] == DEEPEST_LET + 1)
                continue
            wanted = self.expressions.type(at["type"], item.type) if item.type else None
            indices, scope = self.expressions.indexed(item.each, at, self.scope)
            scope = replace(scope, defines=name)
            value = self.expressions.value(at["is"], item.value, scope, wanted)
            if value is None:
                self.expressions.broken.add(name)
            else:
                value = inlined(value, indices)
                found.append(Let(name, value, item.title, trace_of(item), at.key))
                if _is_clear(name, self.expressions):
                    lets[name] = Declared(value.type, at.key, value)
        self.scope = replace(self.scope, lets_to_come=())
        return tuple(found)

    def _order(self, uses: Mapping[str, list[str]]) -> tuple[str, ...]:
        try:
            return tuple(TopologicalSorter(uses).static_order())
        except CycleError as error:
            cycle: list[str] = error.args[1]
            self._report(cycle[::-1])
            self.expressions.broken |= set(uses)
            return ()

    def _uses(self, name: str) -> list[str]:
        """The lets that one names; none if its text has an error, which is reported later."""
        try:
            names = names_in(parse(self.definition.let[name].value))
        except ExprError:
            return []
        return sorted(names & self.definition.let.keys(), key=self._numbers.__getitem__)

    def _too_deep(self, name: str, is_first: bool) -> None:
        self.expressions.broken.add(name)
        if not is_first:
            return
        self.expressions.findings.report(
            "E0222",
            f"`{name}` depends on {DEEPEST_LET} lets, each through the next",
            self.where[name].key,
            help="compute their result in an operator",
        )

    def _report(self, cycle: list[str]) -> None:
        path = " -> ".join(f"`{name}`" for name in cycle)
        self.expressions.findings.report(
            "E0206",
            f"`{cycle[0]}` is defined by itself: {path}",
            self.where[cycle[0]].key,
            help="keep the value of the previous period in memory and refer to that",
        )
