"""What stands where in a specification file: which keys define symbols, what the values are.

Everything here goes by routes alone, so it holds for files with errors too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeVar

from specc.source import Route

Kind = Literal[
    "frame", "type", "field", "member", "constant", "file", "operator", "parameter", "agent",
    "subsystem", "device", "element", "memory", "let", "initial condition", "terminal condition",
    "error condition", "function", "behaviour", "state", "variable",
]  # fmt: skip
Form = Literal[
    "constant", "initial", "full", "type", "signature", "name", "task", "argument", "path"
]
"""Expressions (over constants, over inputs too, over everything), types, and sorts of names."""

TRACE_KEYS = ("title", "eq", "table", "fig")
_VIRTUAL = ("virtual_effectors", "virtual_receptors")
_REAL = ("real_effectors", "real_receptors")


@dataclass(frozen=True, slots=True)
class Role:
    """What a value is; a name is one of a symbol of `kind` in the subsystem around it."""

    form: Form
    kind: Kind | None = None


def split(route: Route) -> tuple[Route, Route]:
    """The subsystem or device that a route lies in, empty for none, and the rest of the route."""
    size = 0
    match route:
        case ("subsystem", *_):
            size = 1
        case ("agent", "control", *_):
            size = 2
        case ("agents", _, "control", *_) | (
            "agent",
            "virtual_effectors" | "virtual_receptors",
            _,
            *_,
        ):
            size = 3
        case ("agent", "real_effectors" | "real_receptors", _, *_):
            size = 3
        case ("agents", _, str(group), _, *_) if group in (*_VIRTUAL, *_REAL):
            size = 4
    return route[:size], route[size:]


def defined_by(route: Route) -> Kind | None:
    """The kind of symbol that the key at the end of a route defines."""
    owner, rest = split(route)
    if owner and not rest:
        return "device" if is_device(owner) else "subsystem"
    return _found(_DEFINED, _region(owner), rest)


def role_of(route: Route) -> Role | None:
    """What the value at a route is; rows of a table may be lists or mappings."""
    owner, rest = split(route)
    if not is_device(owner) and len(rest) > 2 and rest[0] == "functions" and rest[2] in TRACE_KEYS:
        return None
    return _found(_ROLES, _region(owner), rest)


def is_device(owner: Route) -> bool:
    """Whether the part at a route is a real effector or receptor."""
    return len(owner) > 1 and owner[-2] in _REAL


def _region(owner: Route) -> str:
    if not owner:
        return "file"
    return "device" if is_device(owner) else "subsystem"


_FIXED: dict[Kind, str] = {
    "frame": "file/frames/*",
    "type": "file/types/*",
    "field": "file/types/*/fields/*",
    "constant": "file/constants/*",
    "file": "file/files/*",
    "operator": "file/operators/*",
    "parameter": "file/parameters/*",
    "agent": "file/agents/*",
    "element": "subsystem/x/*/* subsystem/y/*/* device/x/* device/y/*",
    "memory": "subsystem/memory/*",
    "let": "subsystem/let/*",
    "initial condition": "subsystem/conditions/initial/*",
    "terminal condition": "subsystem/conditions/terminal/*",
    "error condition": "subsystem/conditions/error/*",
    "function": "subsystem/functions/*",
    "behaviour": "subsystem/behaviours/*",
    "state": "subsystem/states/*",
}
_VALUES: dict[Role, str] = {
    Role("type"): (
        "file/types/* file/types/*/type file/types/*/fields/* file/parameters/* "
        "device/x/* device/x/*/type device/y/* device/y/*/type subsystem/memory/*/type "
        "subsystem/x/*/* subsystem/x/*/*/type subsystem/y/*/* subsystem/y/*/*/type"
    ),
    Role("signature"): "file/operators/*/signature",
    Role("constant"): (
        "file/constants/* file/constants/*/is file/plant/bind/*/noise file/plant/bind/*/noise/* "
        "device/x/*/init device/y/*/init subsystem/x/*/*/init subsystem/y/*/*/init"
    ),
    Role("initial"): "subsystem/memory/*/init",
    Role("full"): (
        "subsystem/let/* subsystem/let/*/is subsystem/conditions/*/* subsystem/assume/*/that "
        "subsystem/conditions/*/*/when subsystem/functions/*/* subsystem/functions/*/*/is"
    ),
    Role("argument"): "file/agents/*/with/* file/agent/with/* subsystem/with/*",
    Role("path"): "file/use/* file/agents/*/use file/agent/use subsystem/use",
    Role("task", "subsystem"): "file/task/cycle/of",
    Role("task", "state"): "file/task/cycle/from file/task/cycle/to",
    Role("task", "memory"): "file/task/watch/*",
    Role("name", "device"): "subsystem/uses/*",
    Role("name", "function"): "subsystem/behaviours/*/functions/*",
    Role("name", "terminal condition"): "subsystem/behaviours/*/terminal",
    Role("name", "error condition"): "subsystem/behaviours/*/error",
    Role("name", "behaviour"): "subsystem/states/* subsystem/states/*/behaviour",
    Role("name", "state"): (
        "subsystem/initial_state subsystem/transitions/*/0 subsystem/transitions/*/from "
        "subsystem/transitions/*/3 subsystem/transitions/*/to"
    ),
    Role("name", "initial condition"): "subsystem/transitions/*/2 subsystem/transitions/*/when",
}

T = TypeVar("T")
_Table = dict[tuple[int, str], list[tuple[tuple[str, ...], T]]]


def _table(patterns: dict[T, str]) -> _Table[T]:
    """Patterns by their length and first two steps."""
    table: _Table[T] = {}
    for meaning, spelled in patterns.items():
        for pattern in spelled.split():
            steps = tuple(pattern.split("/"))
            table.setdefault((len(steps), "/".join(steps[:2])), []).append((steps[2:], meaning))
    return table


def _found(table: _Table[T], region: str, rest: Route) -> T | None:
    if not rest:
        return None
    for pattern, meaning in table.get((len(rest) + 1, f"{region}/{rest[0]}"), ()):
        if all(want in ("*", str(step)) for want, step in zip(pattern, rest[1:], strict=True)):
            return meaning
    return None


_DEFINED = _table(_FIXED)
_ROLES = _table(_VALUES)
