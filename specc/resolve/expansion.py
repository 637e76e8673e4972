"""What goes through a subsystem in every period: it has one state and nothing to decide.

It is expanded into a function, a behaviour and a state, and where it passes all on, into buffers
like those of its device; whatever comes after sees an ordinary subsystem.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from specc.lang import ExprError, Members, parse_syntax
from specc.lang.parse import nodes_of
from specc.model.system import SubsystemKind
from specc.resolve.context import Findings, SourceValue
from specc.resolve.definitions import Groups, Interface
from specc.resolve.ends import devices_of, used_by, word_of
from specc.schema.desugar import Desugared, desugar, route_below
from specc.schema.files import AgentDef, DeviceDef
from specc.schema.subsystem import (
    BufferDef,
    CommandDef,
    ElementDef,
    InputBufferDef,
    InputDef,
    SubsystemDef,
)


def groups_of(parts: Mapping[str, Any], where: SourceValue) -> Groups:
    """The groups among agents, or among virtual effectors and receptors, which stand at `where`."""
    found: Groups = {}
    routes = where.raw.routes if isinstance(where.raw, Desugared) else {}
    for name, route in routes.items():
        group, each = str(route[-1]), parts[name].each
        if each and group.isidentifier() and group not in parts:
            found.setdefault(group, {})[tuple(map(int, each.values()))] = name
    return found


def with_members(
    definition: SubsystemDef, where: SourceValue, groups: Groups
) -> tuple[SubsystemDef, SourceValue, Groups]:
    """A subsystem with a buffer for each member of the groups that it names, and those groups."""
    named = {n: g for n, g in groups.items() if n in definition.x or n in definition.y}
    if not named or not isinstance(where.raw, dict):
        return definition, where, {}
    raw, sides = where.mapping, {}
    for side in ("x", "y"):
        buffers, at = getattr(definition, side), where[side]
        if isinstance(at.raw, dict):
            pairs = list(_pairs(buffers, named))
            made = {name: at.raw[key] for key, name in pairs}
            routes = {name: route_below(at.raw, key, at.route) for key, name in pairs}
            raw[side] = Desugared(made, routes)
            sides[side] = {name: buffers[key] for key, name in pairs}
    return definition.model_copy(update=sides), where.with_content(raw), named


def _pairs(names: Mapping[str, object], groups: Groups) -> Iterator[tuple[str, str]]:
    """Each name with itself, or with each member of the group that it names."""
    for name in names:
        for member in groups[name].values() if name in groups else (name,):
            yield name, member


def targets_of(target: str, groups: Mapping[str, Members]) -> list[str]:
    """The targets that `y.group.element` stands for; any other target is itself."""
    match target.split(".") if groups else ():
        case ["y", group, element] if group in groups:
            return [f"y.{member}.{element}" for member in groups[group].values()]
    return [target]


NAME = "through"
"""Of the key, and of the function, the behaviour and the state that it stands for."""
_MACHINE_KEYS = ("conditions", "functions", "behaviours", "states", "initial_state", "transitions")
_HEAD = re.compile(r"\w+")


# Buffers like those of the device.


def with_buffers(
    definition: SubsystemDef,
    where: SourceValue,
    kind: SubsystemKind,
    name: str,
    around: AgentDef,
    agent: SourceValue,
    interfaces: Mapping[str, Interface],
    findings: Findings,
) -> tuple[SubsystemDef, SourceValue]:
    """A virtual effector or receptor with the buffers that it has because it passes all on.

    They have what its device accepts and reports, to both sides. `agent` is where the agent stands.
    """
    if definition.through is None or definition.through.rule is None or definition.use is not None:
        return definition, where
    word, used = word_of(kind), used_by(definition, name)
    devices = devices_of(around, word)
    if len(used) != 1 or used[0] not in devices:
        _report_device(used, definition, where, f"real {word}", findings)
        return definition, where
    device, at = devices[used[0]], agent[f"real_{word}s"][used[0]]
    reported = set(_names(device.y, interfaces))
    buffers = dict(_like(device, at, word[0].upper(), reported))
    return _completed(definition, where, buffers, used[0])


def _report_device(
    used: Collection[str],
    definition: SubsystemDef,
    where: SourceValue,
    word: str,
    findings: Findings,
) -> None:
    """Report that there is no device, or no single one, to take missing buffers from."""
    if definition.x or definition.y:
        return
    place = where[NAME].place
    if len(used) == 1:
        (name,) = used
        findings.report_missing(
            f"{word} `{name}`", place, "add it to the agent, or name it in `uses:`"
        )
        return
    message = f"`{NAME}: identity` takes its buffers from one {word}, and {len(used)} are used"
    help_text = "write `x` and `y`, or change `uses`"
    findings.report("E0104", message, place, help=help_text)


_Buffers = Mapping[tuple[str, str], tuple[BufferDef, SourceValue]]
"""Side and peer -> a buffer, and where its elements are declared."""


def _like(
    device: DeviceDef, at: SourceValue, letter: str, reported: Collection[str]
) -> Iterator[tuple[tuple[str, str], tuple[BufferDef, SourceValue]]]:
    ways = ((device.x, at["x"], "c", letter), (device.y, at["y"], letter, "c"))
    for buffer, here, source, target in ways:
        if buffer.elements or buffer.interface:
            yield ("x", source), (_received(buffer, reported), here)
            yield ("y", target), (_sent(buffer), here)


def _received(buffer: BufferDef, reported: Collection[str]) -> BufferDef:
    """A buffer of inputs: before the first command, the device is to get what is safe."""
    elements = {
        name: InputDef.model_construct(type=item.type, title=item.title, init=_safe(item, reported))
        for name, item in buffer.elements.items()
    }
    return InputBufferDef.model_construct(interface=buffer.interface, elements=elements)


def _safe(item: ElementDef, reported: Collection[str]) -> str | None:
    """What is safe whatever the device has `reported`."""
    if not isinstance(item, CommandDef) or item.safe is None:
        return None
    if item.safe.otherwise is not None:
        return item.safe.otherwise
    named = _named(item.safe.value)
    return None if named.intersection(reported) else item.safe.value


def _named(text: str) -> set[str]:
    """The names in an expression, without units; none, if it cannot be read."""
    try:
        nodes = nodes_of(parse_syntax(text))
    except ExprError:
        return set()
    quantities = (node for node in nodes if isinstance(node, ast.Subscript))
    units = (q.slice for q in quantities if isinstance(q.value, ast.Constant))
    known = {id(node) for unit in units for node in nodes_of(unit)}
    return {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in known}


def _sent(buffer: BufferDef) -> BufferDef:
    elements = {
        name: ElementDef.model_construct(type=item.type, title=item.title)
        for name, item in buffer.elements.items()
    }
    return BufferDef.model_construct(interface=buffer.interface, elements=elements)


def _completed(
    definition: SubsystemDef, where: SourceValue, buffers: _Buffers, device: str
) -> tuple[SubsystemDef, SourceValue]:
    """The subsystem with those of the buffers that it does not have."""
    raw, sides = where.mapping, {}
    for side in ("x", "y"):
        own, at = getattr(definition, side), where[side]
        new = {
            peer: buffers[side, peer]
            for direction, peer in buffers
            if direction == side and peer not in own and (peer == "c" or device not in own)
        }
        sides[side] = own | {peer: buffer for peer, (buffer, _) in new.items()}
        routes = {peer: route_below(at.raw, peer, at.route) for peer in own}
        routes |= {peer: here.route for peer, (_, here) in new.items()}
        parts = {peer: here.raw for peer, (_, here) in new.items()}
        raw[side] = Desugared(at.mapping | parts, routes)
    return definition.model_copy(update=sides), where.with_content(raw)


# One function, one behaviour, one state.


def with_machine(
    definition: SubsystemDef,
    where: SourceValue,
    interfaces: Mapping[str, Interface],
    findings: Findings,
) -> tuple[SubsystemDef, SourceValue]:
    """A subsystem with the machine that `through` stands for, if it has that."""
    through, here = definition.through, where[NAME]
    if through is None:
        return definition, where
    for key in _MACHINE_KEYS:
        if key in definition.given:
            message = f"`{key}` has no effect: `{NAME}` says all that the subsystem does"
            help_text = f"delete one of the two; `{NAME}` is for a subsystem with one state"
            findings.report("E0104", message, where[key].key, help=help_text)
    passed = dict(_passed_on(definition, interfaces)) if through.rule else {}
    parts: dict[str, Any] = {
        "functions": passed,
        "behaviours": {"functions": [NAME], "terminal": "never"},
        "states": NAME,
    }
    short = {key: Desugared({NAME: part}, {NAME: here.route}) for key, part in parts.items()}
    new, _ = desugar(short, where.file, SubsystemDef, where.route)
    new["functions"][NAME] |= {key: value for key, value in here.mapping.items() if key != "rule"}
    new["initial_state"] = NAME
    machine = SubsystemDef.model_validate(new)
    definition = definition.model_copy(update={key: getattr(machine, key) for key in new})
    rest = {key: value for key, value in where.mapping.items() if key not in _MACHINE_KEYS}
    return definition, where.with_content(rest | new)


def _passed_on(
    definition: SubsystemDef, interfaces: Mapping[str, Interface]
) -> Iterator[tuple[str, str]]:
    """Every output with the input of its name on the other side, if there is one buffer there."""
    for peer, buffer in definition.y.items():
        sources = [other for other in definition.x if (other == "c") != (peer == "c")]
        if len(sources) == 1:
            for name in _names(buffer, interfaces):
                yield f"y.{peer}.{name}", f"x.{sources[0]}.{name}"


def _names(buffer: BufferDef, interfaces: Mapping[str, Interface]) -> Iterator[str]:
    """The elements of a buffer, and of the interface that it names."""
    head = _HEAD.match(buffer.interface or "")
    if head and head[0] in interfaces:
        yield from interfaces[head[0]].definition.elements
    yield from buffer.elements
