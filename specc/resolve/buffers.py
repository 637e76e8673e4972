"""Buffers, memory and lets of a subsystem: what its expressions may refer to."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from typing import Literal

from specc.diagnostics import nearest
from specc.lang import RESERVED, Declaration, ExprError, Scope, parse
from specc.lang.parse import names_in
from specc.model.system import Let, Memory, Port
from specc.resolve.context import YamlNode, trace_of, unknown_at
from specc.resolve.definitions import inlined
from specc.resolve.elements import all_elements
from specc.resolve.ends import WrittenBuffer
from specc.resolve.expressions import Expressions
from specc.resolve.library import constant_scope
from specc.schema.subsystem import BufferDef, SubsystemDef

DEEPEST_LET = 100
"""Longest chain of lets that depend on each other; nobody reads more, and passes recurse."""


def resolve_ports(
    definition: SubsystemDef, where: YamlNode, ends: Mapping[str, str], expressions: Expressions
) -> tuple[Port, ...]:
    """The ports of a subsystem; those that are `same` have no elements yet.

    `ends` has the name of the other end for each peer that is known.
    """
    ports = []
    sides: tuple[Literal["x", "y"], ...] = ("x", "y")
    for side in sides:
        buffers: Mapping[str, BufferDef] = getattr(definition, side)
        for peer, buffer in buffers.items():
            at = where[side][peer]
            if WrittenBuffer(buffer, at, expressions.definitions).is_same:
                ports.append(Port(peer, side, (), ends.get(peer, ""), at.key))
                continue
            found, shared = all_elements(buffer, at, side, expressions)
            is_unknown = buffer.interface is not None and not shared
            if is_unknown or (buffer.elements and not found):
                expressions.broken.add(peer)
            if is_unknown:
                expressions.unresolved.add(f"{side}.{peer}")
            if peer not in ends:
                expressions.unresolved |= {f"{side}.{end}" for end in nearest(peer, ends)}
            ports.append(Port(peer, side, found, ends.get(peer, ""), at.key, shared))
    return tuple(ports)


def resolve_memory(
    definition: SubsystemDef, where: YamlNode, ports: tuple[Port, ...], expressions: Expressions
) -> tuple[tuple[Memory, ...], tuple[Let, ...], Scope]:
    """Memory and lets of a subsystem, and the scope that they make with its ports."""
    inputs = {
        (port.peer, element.name): Declaration(element.type, element.place)
        for port in ports
        for element in (port.elements if port.direction == "x" else ())
    }
    outer, memory, lets = expressions.definitions, definition.memory.keys(), definition.let.keys()
    # What expressions mean by a name that stands for two things is not known.
    expressions.broken |= memory & lets
    expressions.broken |= {n for n in memory | lets if n in outer.constants or n in outer.files}
    constants = _without_broken(constant_scope(outer), expressions.broken)
    outside = replace(constants, inputs=inputs, uninitialized=expressions.uninitialized_names)
    resolved = _memory(definition, where, outside, expressions)
    known = _without_broken(outside, expressions.broken)
    clear = {
        m.name: Declaration(m.type, m.place)
        for m in resolved
        if _is_unambiguous(m.name, expressions)
    }
    modes = definition.modes.keys()
    inside = replace(known, memory=clear, uninitialized=(), allow_clock=True, modes=modes)
    found, scope = _lets(definition, where["let"], inside, expressions)
    return resolved, found, scope


def _is_unambiguous(name: str, expressions: Expressions) -> bool:
    """Whether a name refers to exactly one memory element or let."""
    return name not in expressions.broken and name not in RESERVED


def _without_broken(scope: Scope, broken: Collection[str]) -> Scope:
    """The scope without constants and files whose names are broken."""
    constants = {name: known for name, known in scope.constants.items() if name not in broken}
    files = {name: known for name, known in scope.files.items() if name not in broken}
    return replace(scope, constants=constants, files=files)


def _memory(
    definition: SubsystemDef, where: YamlNode, scope: Scope, expressions: Expressions
) -> tuple[Memory, ...]:
    found = []
    for name, item in definition.memory.items():
        at = where["memory"][name]
        type_ = expressions.type(at["type"], item.type)
        init = None
        if item.init is None:
            message = f"memory element `{name}` has no initial value"
            help_text = "add `init:`, the value in the first period"
            expressions.findings.report("O0202", message, at.key, help=help_text)
        elif type_ is not None:
            indices, inside = expressions.indexed(item.each, at, scope)
            init = expressions.value(at["init"], item.init, inside, type_, at.key)
            init = inlined(init, indices) if init else None
        if type_ is None:
            expressions.broken.add(name)
        else:
            init = init or unknown_at(at, type_)
            parts = item.title, trace_of(item), at.key, item.symbol or ""
            found.append(Memory(name, type_, init, *parts))
    return tuple(found)


def _lets(
    definition: SubsystemDef, where: YamlNode, scope: Scope, expressions: Expressions
) -> tuple[tuple[Let, ...], Scope]:
    """Resolve lets in order of dependence; returns also the scope with all of them.

    One that depends on itself is reported with its cycle. `scope` is what a let may name.
    """
    found: list[Let] = []
    depths: dict[str, int] = {}
    # One scope, which grows: in this order each let finds those that it may name.
    lets: dict[str, Declaration] = {}
    scope = replace(scope, lets=lets, all_lets=definition.let.keys())
    uses = {name: _used_lets(item.value, definition) for name, item in definition.let.items()}
    order: Iterable[str] = ()
    try:
        order = tuple(TopologicalSorter(uses).static_order())
    except CycleError as error:
        cycle: list[str] = error.args[1][::-1]
        message = f"`{cycle[0]}` is defined by itself: {' -> '.join(f'`{name}`' for name in cycle)}"
        help = "keep the value of the previous period in memory and refer to that"
        expressions.findings.report("E0206", message, where[cycle[0]].key, help=help)
        expressions.broken |= set(uses)
    for name in order:
        item, at = definition.let[name], where[name]
        depths[name] = 1 + max((depths.get(used, 0) for used in uses[name]), default=0)
        if depths[name] > DEEPEST_LET:
            expressions.broken.add(name)
            if depths[name] == DEEPEST_LET + 1:
                message = f"`{name}` depends on {DEEPEST_LET} lets, each through the next"
                help = "compute their result in an operator"
                expressions.findings.report("E0303", message, at.key, help=help)
            continue
        wanted = expressions.type(at["type"], item.type) if item.type else None
        indices, inside = expressions.indexed(item.each, at, scope)
        value = expressions.value(at["is"], item.value, replace(inside, defines=name), wanted)
        if value is None:
            expressions.broken.add(name)
            continue
        value = inlined(value, indices)
        found.append(Let(name, value, item.title, trace_of(item), at.key, item.symbol or ""))
        if _is_unambiguous(name, expressions):
            lets[name] = Declaration(value.type, at.key, value)
    return tuple(found), replace(scope, all_lets=())


def _used_lets(text: str, definition: SubsystemDef) -> list[str]:
    """The lets that a text names; empty if it has an error, which is reported later."""
    try:
        names = names_in(parse(text))
    except ExprError:
        return []
    return [name for name in definition.let if name in names]
