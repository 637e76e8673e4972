"""Groups: the parts that one `for` stands for, when a buffer or a target names all of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from specc.lang import Members
from specc.resolve.context import Cursor
from specc.schema import SubsystemDef
from specc.schema.desugar import Desugared, route_below

Groups = dict[str, dict[tuple[int, ...], str]]
"""Name of a group -> indices of each member and its name."""


def groups_of(parts: Mapping[str, Any], where: Cursor) -> Groups:
    """The groups among agents, or among virtual effectors and receptors, which stand at `where`."""
    found: Groups = {}
    routes = where.raw.routes if isinstance(where.raw, Desugared) else {}
    for name, route in routes.items():
        group, each = str(route[-1]), parts[name].each
        if each and group.isidentifier() and group not in parts:
            found.setdefault(group, {})[tuple(map(int, each.values()))] = name
    return found


def with_members(
    definition: SubsystemDef, where: Cursor, groups: Groups
) -> tuple[SubsystemDef, Cursor, Groups]:
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
