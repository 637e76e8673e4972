"""Short ways to write subsystems that depend on others: peers of a group, and `through`.

A buffer or target for a group of peers becomes one for each member. `through` becomes a function, a
behaviour and a state, and where it passes all on, buffers like those of its device. What comes
after sees an ordinary subsystem.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterable, Mapping
from itertools import combinations
from typing import Any

from specc.lang import ExprError, Members, parse_syntax
from specc.lang.parse import nodes_of
from specc.model.system import SubsystemKind
from specc.resolve.context import Findings, YamlNode
from specc.resolve.definitions import Groups, Interface
from specc.resolve.ends import devices_of, used_by, word_of
from specc.schema.desugar import Desugared, desugar
from specc.schema.files import AgentDef
from specc.schema.subsystem import (
    BufferDef,
    CommandDef,
    ElementDef,
    InputBufferDef,
    InputDef,
    SubsystemDef,
)
from specc.source import Route

NAME = "through"
"""Of the key, and of the function, the behaviour and the state that it stands for."""
_MACHINE_KEYS = (
    "conditions", "functions", "behaviours", "states", "modes", "initial_state", "transitions",
)  # fmt: skip
_HEAD = re.compile(r"\w+")


def groups_of(parts: Mapping[str, Any], where: YamlNode) -> Groups:
    """The groups among agents, or among virtual effectors and receptors, which stand at `where`."""
    found: Groups = {}
    routes = where.raw.routes if isinstance(where.raw, Desugared) else {}
    for name, route in routes.items():
        group, each = str(route[-1]), parts[name].each
        if each and group.isidentifier() and group not in parts:
            found.setdefault(group, {})[tuple(map(int, each.values()))] = name
    return found


def targets_of(target: str, groups: Mapping[str, Members]) -> list[str]:
    """The targets that `y.group.element` stands for; any other target stands for itself."""
    match target.split(".") if groups else ():
        case ["y", group, element] if group in groups:
            return [f"y.{member}.{element}" for member in groups[group].values()]
    return [target]


_SourcedBuffer = tuple[BufferDef, Any, Route]
"""A buffer with its data and where they stand."""


def _with_buffers(
    definition: SubsystemDef, where: YamlNode, sides: Mapping[str, Mapping[str, _SourcedBuffer]]
) -> tuple[SubsystemDef, YamlNode]:
    """Replace the buffers of a subsystem."""
    raw = where.mapping
    for side, buffers in sides.items():
        routes = {peer: route for peer, (_, _, route) in buffers.items()}
        raw[side] = Desugared({peer: data for peer, (_, data, _) in buffers.items()}, routes)
    defined = {
        side: {peer: buffer for peer, (buffer, _, _) in buffers.items()}
        for side, buffers in sides.items()
    }
    return definition.model_copy(update=defined), where.with_content(raw)


def _buffers(definition: SubsystemDef, where: YamlNode, side: str) -> dict[str, _SourcedBuffer]:
    """The buffers that a subsystem declares on a side."""
    at = where[side]
    return {p: (b, at[p].raw, at[p].route) for p, b in getattr(definition, side).items()}


def with_members(
    definition: SubsystemDef, where: YamlNode, groups: Groups
) -> tuple[SubsystemDef, YamlNode, Groups]:
    """Expand groups: the subsystem with a buffer for each member, and the groups that it names."""
    named = {n: g for n, g in groups.items() if n in definition.x or n in definition.y}
    if not named:
        return definition, where, {}
    sides = {
        side: {
            member: buffer
            for peer, buffer in _buffers(definition, where, side).items()
            for member in (named[peer].values() if peer in named else (peer,))
        }
        for side in ("x", "y")
    }
    return *_with_buffers(definition, where, sides), named


def with_device_buffers(
    definition: SubsystemDef,
    where: YamlNode,
    kind: SubsystemKind,
    name: str,
    around: AgentDef,
    agent: YamlNode,
    interfaces: Mapping[str, Interface],
    findings: Findings,
) -> tuple[SubsystemDef, YamlNode]:
    """Add the buffers that a virtual effector or receptor has because it passes everything on.

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
    reported, letter = set(_elements(device.y, interfaces)), word[0].upper()
    sides = {side: _buffers(definition, where, side) for side in ("x", "y")}
    own = {side: set(buffers) for side, buffers in sides.items()}
    for buffer, here, source, target in (
        (device.x, at["x"], "c", letter),
        (device.y, at["y"], letter, "c"),
    ):
        if not buffer.elements and not buffer.interface:
            continue
        for side, peer in (("x", source), ("y", target)):
            if peer in own[side] or (peer != "c" and used[0] in own[side]):
                continue
            copy = _mirrored_buffer(buffer, reported if side == "x" else None)
            sides[side][peer] = copy, here.raw, here.route
    return _with_buffers(definition, where, sides)


def _report_device(
    used: Collection[str], definition: SubsystemDef, where: YamlNode, word: str, findings: Findings
) -> None:
    """Report that there is no device, or no single one, to take missing buffers from."""
    if definition.x or definition.y:
        return
    place = where[NAME].place
    if len(used) == 1:
        help_text = "add it to the agent, or name it in `uses:`"
        findings.report_missing(f"{word} `{next(iter(used))}`", place, help_text)
        return
    message = f"`{NAME}: identity` takes its buffers from one {word}, and {len(used)} are used"
    findings.report("E0104", message, place, help="write `x` and `y`, or change `uses`")


def _mirrored_buffer(buffer: BufferDef, reported: Collection[str] | None) -> BufferDef:
    """A copy of a device's buffer for the subsystem that passes it on.

    With `reported`, the names that the device reports, it is an input with safe initial values;
    with None, it is an output, whose initial values are for an other end that is `same`.
    """
    is_input = reported is not None
    kind = InputDef if is_input else ElementDef
    elements = {
        name: kind.model_construct(
            type=item.type,
            title=item.title,
            init=_safe(item, reported or ()) if is_input else item.init,
        )
        for name, item in buffer.elements.items()
    }
    model = InputBufferDef if is_input else BufferDef
    return model.model_construct(interface=buffer.interface, elements=elements)


def _safe(item: ElementDef, reported: Collection[str]) -> str | None:
    """What is safe whatever the device has `reported`."""
    if not isinstance(item, CommandDef) or item.safe is None:
        return None
    if item.safe.otherwise is not None:
        return item.safe.otherwise
    named = _named(item.safe.value)
    return None if named.intersection(reported) else item.safe.value


def _named(text: str) -> set[str]:
    """The names in an expression, without units; empty if it cannot be parsed."""
    try:
        nodes = nodes_of(parse_syntax(text))
    except ExprError:
        return set()
    quantities = (node for node in nodes if isinstance(node, ast.Subscript))
    units = (q.slice for q in quantities if isinstance(q.value, ast.Constant))
    known = {id(node) for unit in units for node in nodes_of(unit)}
    return {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in known}


def with_machine(
    definition: SubsystemDef,
    where: YamlNode,
    interfaces: Mapping[str, Interface],
    others: Mapping[str, Iterable[str]],
    findings: Findings,
) -> tuple[SubsystemDef, YamlNode]:
    """Expand `through` to the machine that it stands for.

    `others` has the elements of outputs that are written at their other ends.
    """
    through, here = definition.through, where[NAME]
    if through is None:
        return definition, where
    for key in _MACHINE_KEYS:
        if key in definition.given_keys:
            message = f"`{key}` has no effect: `{NAME}` says all that the subsystem does"
            help_text = f"delete one of the two; `{NAME}` is for a subsystem with one state"
            findings.report("E0104", message, where[key].key, help=help_text)
    passed: dict[str, str] = {}
    for peer, buffer in definition.y.items() if through.rule else ():
        sources = [other for other in definition.x if (other == "c") != (peer == "c")]
        if len(sources) == 1:
            names = others.get(peer) or _elements(buffer, interfaces)
            passed |= {f"y.{peer}.{name}": f"x.{sources[0]}.{name}" for name in names}
    events = _events(definition, interfaces, passed.values())
    if len(events) > _MOST_EVENTS:
        message = f"`{NAME}: identity` passes on {len(events)} events, and {_MOST_EVENTS} at most"
        help_text = "write the machine in full, or divide the device"
        findings.report("E0104", message, here.place, help=help_text)
        events = {}
    new, _ = desugar(
        {
            key: Desugared(parts, dict.fromkeys(parts, here.route))
            if isinstance(parts, dict)
            else parts
            for key, parts in _machine(passed, events).items()
        },
        where.file,
        SubsystemDef,
        where.route,
    )
    new["functions"][NAME] |= {key: value for key, value in here.mapping.items() if key != "rule"}
    new["initial_state"] = NAME
    machine = SubsystemDef.model_validate(new)
    definition = definition.model_copy(update={key: getattr(machine, key) for key in new})
    rest = {key: value for key, value in where.mapping.items() if key not in _MACHINE_KEYS}
    return definition, where.with_content(rest | new)


_MOST_EVENTS = 3
"""There is a state for each set of events, and a row from each to each."""


def _events(
    definition: SubsystemDef, interfaces: Mapping[str, Interface], passed: Collection[str]
) -> dict[str, str]:
    """The inputs among those `passed` on that must not be missed, and what they are called."""
    found = {}
    for peer, buffer in definition.x.items():
        for name, element in _elements(buffer, interfaces).items():
            if getattr(element, "event", False) and f"x.{peer}.{name}" in passed:
                found[f"x.{peer}.{name}"] = f"{peer}_{name}"
    return found


def _machine(passed: Mapping[str, str], events: Mapping[str, str]) -> dict[str, Any]:
    """The machine that writes `passed` in each period, but events only when they come.

    It has a state for each set of events that come at once.
    """
    functions: dict[str, dict[str, str]] = {
        NAME: {target: source for target, source in passed.items() if source not in events}
    }
    for event, name in events.items():
        functions[f"{NAME}_{name}"] = {t: source for t, source in passed.items() if source == event}
    sets = [
        chosen for size in range(len(events) + 1) for chosen in combinations(events.values(), size)
    ]
    states = ["_".join((NAME, "_and_".join(chosen))).rstrip("_") for chosen in sets]
    if not events:
        behaviour = {"functions": [NAME], "terminal": "never"}
        return {"functions": functions, "behaviours": {NAME: behaviour}, "states": {NAME: NAME}}
    come = {
        "_and_".join(chosen) + "_come": " and ".join(
            f"fresh({event})" if name in chosen else f"not fresh({event})"
            for event, name in events.items()
        )
        for chosen in sets[1:]
    }
    return {
        "functions": functions,
        "behaviours": {
            state: {
                "functions": [NAME, *(f"{NAME}_{n}" for n in chosen)],
                "terminal": "always" if chosen else "event_comes",
            }
            for state, chosen in zip(states, sets, strict=True)
        },
        "states": {state: state for state in states},
        "conditions": {
            "initial": come,
            "terminal": {"event_comes": " or ".join(f"fresh({event})" for event in events)},
        },
        "transitions": [
            [state, "terminal", condition, target]
            for state in states
            for condition, target in zip(("otherwise", *come), states, strict=True)
            if state != NAME or condition != "otherwise"
        ],
    }


def _elements(buffer: BufferDef, interfaces: Mapping[str, Interface]) -> dict[str, ElementDef]:
    """The elements of a buffer, and of the interface that it names."""
    head = _HEAD.match(buffer.interface or "")
    named = interfaces[head[0]].definition.elements if head and head[0] in interfaces else {}
    return {**named, **buffer.elements}
