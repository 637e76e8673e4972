"""The coordinate frames and the poses of one in another (Fig. 7)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.model.system import Subsystem, System
from specc.model.types import Pose, Record, Type
from specc.reachable import grouped
from specc.tools.graph.diagram import Arc, Box, Cells, Diagram, broken, joined, line

_COLUMNS = 26
_MOST = 8
"""Names of poses on an arc; of the others their number is told."""


def frames(system: System, subsystems: tuple[Subsystem, ...]) -> Diagram:
    """All frames; an arc from A to B is the pose of B in A, by whatever has this type.

    Constants are drawn solid. Dashed are poses that change, of these subsystems.
    """
    described = dict(system.frames)
    fixed = _together(_constants(system))
    varying = _together(pair for each in subsystems for pair in _changing(each))
    used = [name for pair in (*fixed, *varying) for name in pair]
    names = dict.fromkeys((*described, *used))
    nodes = tuple(
        Box(n, "frame", (line(n, "name"), *broken(described.get(n, ""), 16, "note")), covers=(n,))
        for n in names
    )
    arcs = [Arc(*pair, joined(found, _COLUMNS)) for pair, found in fixed.items()]
    arcs += [Arc(*pair, joined(found, _COLUMNS), "dashed") for pair, found in varying.items()]
    notes = (
        Cells((line("solid", "italic"), line("constant"))),
        Cells((line("dashed", "italic"), line("changes"))),
    )
    return Diagram(system.name, nodes, tuple(arcs), notes=notes if arcs else ())


_Found = tuple[tuple[str, str], str]


def _constants(system: System) -> Iterator[_Found]:
    own = [c for s in system.subsystems for c in s.constants]
    for constant in (*system.constants, *own):
        yield from _poses(constant.name, constant.value.type)


def _changing(subsystem: Subsystem) -> Iterator[_Found]:
    for port in subsystem.ports:
        for element in port.elements:
            yield from _poses(element.name, element.type)
    for kept in subsystem.memory:
        yield from _poses(kept.name, kept.type)
    for let in subsystem.lets:
        yield from _poses(let.name, let.value.type)


def _poses(name: str, kind: Type, depth: int = 3) -> Iterator[_Found]:
    """A pose by its name, one in a record by that of its field; lists stand for their items."""
    if isinstance(kind, Pose):
        yield (kind.parent, kind.child), name
    elif not isinstance(kind, Record):
        for part in kind.parts:
            yield from _poses(name, part, depth)
    elif depth:
        for field, inner in kind.fields:
            yield from _poses(f"{name}.{field}", inner, depth - 1)


def _together(found: Iterator[_Found]) -> dict[tuple[str, str], list[str]]:
    return {pair: _limited(list(dict.fromkeys(names))) for pair, names in grouped(found).items()}


def _limited(names: list[str]) -> list[str]:
    return names if len(names) <= _MOST else [*names[:_MOST], f"and {len(names) - _MOST} more"]
