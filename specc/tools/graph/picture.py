"""Which picture is meant by a place and a kind."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from specc.diagnostics.nearest import nearest
from specc.model.fsm import Function
from specc.model.system import Agent, Subsystem, System
from specc.refusal import Refused
from specc.tools.graph.diagram import Diagram
from specc.tools.graph.flow import flow
from specc.tools.graph.frames import frames
from specc.tools.graph.inside import inside
from specc.tools.graph.names import is_named
from specc.tools.graph.states import states
from specc.tools.graph.structure import structure

PictureKind = Literal["structure", "inside", "states", "frames", "flow"]


class NoPicture(Refused):
    """There is no such place, or no such picture of it; the message says what there is."""


@dataclass(frozen=True, slots=True)
class _Subject:
    """A part of a system; what is empty or None is not named."""

    agent: Agent | None = None
    subsystem: Subsystem | None = None
    name: str = ""
    functions: tuple[Function, ...] = ()


def picture(system: System, place: str, kind: PictureKind | None) -> tuple[PictureKind, Diagram]:
    """The picture of a place, of the kind that suits it if none is given. Raises NoPicture."""
    at = _found(system, place)
    kind = kind or _usual(at)
    drawn = _drawn(system, at, place, kind)
    if not any(drawn.every_node):
        raise NoPicture(f"nothing is known yet that --of {kind} could show")
    return kind, drawn


def _drawn(system: System, at: _Subject, place: str, kind: PictureKind) -> Diagram:
    if kind == "structure":
        if at.subsystem is not None:
            raise NoPicture(f"`{place}` is no system and no agent; --of inside shows a subsystem")
        return structure(system, at.agent)
    if kind == "frames":
        if not system.frames:
            raise NoPicture("the specification has no frames")
        return frames(system, _subsystems(system, at))
    if at.name and kind != "flow":
        raise NoPicture(f"`{place}` is part of a subsystem; --of {kind} shows a whole one")
    subsystem = _only(system, at, kind)
    if kind == "inside":
        return inside(system, subsystem)
    if kind == "states":
        return states(subsystem)
    if not at.name:
        have = [f"{subsystem.qualified_name}.{name}" for name in _computing(subsystem)]
        raise NoPicture(f"--of flow shows a function or behaviour: {_some(have)}")
    return flow(subsystem, at.name, at.functions)


def _usual(at: _Subject) -> PictureKind:
    if at.subsystem is None:
        return "structure"
    return "flow" if at.name else "states"


def _found(system: System, place: str) -> _Subject:
    if not place:
        return _Subject()
    first, dot, rest = place.partition(".")
    agent = next((a for a in system.agents if a.name == first), None)
    if agent is None:
        raise _unknown("agent", "", first, [a.name for a in system.agents])
    if not dot:
        return _Subject(agent)
    second, dot, name = rest.partition(".")
    subsystem = next((s for s in agent.subsystems if s.name == second), None)
    if subsystem is None:
        raise _unknown("subsystem", f"{first}.", second, [s.name for s in agent.subsystems])
    if not dot:
        return _Subject(agent, subsystem)
    known = _computing(subsystem)
    if name not in known:
        whose = f"{subsystem.qualified_name}."
        raise _unknown("function or behaviour", whose, name, list(known))
    return _Subject(agent, subsystem, name, known[name])


def _computing(subsystem: Subsystem) -> dict[str, tuple[Function, ...]]:
    """The functions of each behaviour, and each function that is not called like one."""
    found = {b.name: b.functions for b in subsystem.behaviours}
    return {**{f.name: (f,) for f in subsystem.functions if is_named(f)}, **found}


def _subsystems(system: System, at: _Subject) -> tuple[Subsystem, ...]:
    if at.subsystem is not None:
        return (at.subsystem,)
    return at.agent.subsystems if at.agent is not None else system.subsystems


def _only(system: System, at: _Subject, kind: PictureKind) -> Subsystem:
    inside = _subsystems(system, at)
    if len(inside) == 1:
        return inside[0]
    have = _some(each.qualified_name for each in inside) or "there are none"
    raise NoPicture(f"--of {kind} shows one subsystem, so name it: {have}")


def _unknown(what: str, whose: str, name: str, known: list[str]) -> NoPicture:
    """What is told of a name that is not known; `whose` stands before it and the known ones."""
    close = " or ".join(f"{whose}{each}" for each in nearest(name, known))
    there = _some(f"{whose}{each}" for each in known) or "none"
    hint = f"did you mean {close}?" if close else f"there are {there}"
    return NoPicture(f"there is no {what} `{whose}{name}`; {hint}")


_MOST = 12


def _some(names: Iterable[str]) -> str:
    every = list(names)
    more = [f"and {len(every) - _MOST} more"] if len(every) > _MOST else []
    return ", ".join([*every[:_MOST], *more])
