"""Pictures of a specification: structure, inner structure, state machines, frames and data flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from specc.diagnostics.nearest import nearest
from specc.model.fsm import Function
from specc.model.system import Agent, Subsystem, System
from specc.refusal import Refused
from specc.tools.graph.diagram import Diagram, is_named
from specc.tools.graph.formats import FORMATS
from specc.tools.graph.machine import flow, states
from specc.tools.graph.structure import frames, inside, structure

__all__ = ["FORMATS", "Diagram", "NoPicture", "PictureKind", "picture"]

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
    at = _subject(system, place)
    usual: PictureKind = "flow" if at.name else "states" if at.subsystem else "structure"
    kind = kind or usual
    drawn = _draw(system, at, place, kind)
    if not any(drawn.all_nodes):
        raise NoPicture(f"nothing is known yet that --of {kind} could show")
    return kind, drawn


def _draw(system: System, at: _Subject, place: str, kind: PictureKind) -> Diagram:
    if kind == "structure":
        if at.subsystem is not None:
            raise NoPicture(f"`{place}` is no system and no agent; --of inside shows a subsystem")
        return structure(system, at.agent)
    subsystems = at.agent.subsystems if at.agent else system.subsystems
    subsystems = (at.subsystem,) if at.subsystem else subsystems
    if kind == "frames":
        if not system.frames:
            raise NoPicture("the specification has no frames")
        return frames(system, subsystems)
    if at.name and kind != "flow":
        raise NoPicture(f"`{place}` is part of a subsystem; --of {kind} shows a whole one")
    if len(subsystems) != 1:
        names = _list([each.qualified_name for each in subsystems]) or "there are none"
        raise NoPicture(f"--of {kind} shows one subsystem, so name it: {names}")
    (subsystem,) = subsystems
    if kind == "inside":
        return inside(system, subsystem)
    if kind == "states":
        return states(subsystem)
    if not at.name:
        names = _list([f"{subsystem.qualified_name}.{name}" for name in _functions(subsystem)])
        raise NoPicture(f"--of flow shows a function or behaviour: {names}")
    return flow(subsystem, at.name, at.functions)


def _subject(system: System, place: str) -> _Subject:
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
    known = _functions(subsystem)
    if name not in known:
        owner = f"{subsystem.qualified_name}."
        raise _unknown("function or behaviour", owner, name, list(known))
    return _Subject(agent, subsystem, name, known[name])


def _functions(subsystem: Subsystem) -> dict[str, tuple[Function, ...]]:
    """The functions of each behaviour, and each function without a behaviour of its name."""
    found = {b.name: b.functions for b in subsystem.behaviours}
    for generic in subsystem.generics:
        part = generic.part
        found[part.name] = (part,) if isinstance(part, Function) else part.functions
    return {**{f.name: (f,) for f in subsystem.functions if is_named(f)}, **found}


def _unknown(what: str, owner: str, name: str, known: list[str]) -> NoPicture:
    """The refusal of an unknown name; `owner` stands before it and the known ones."""
    close = " or ".join(f"{owner}{each}" for each in nearest(name, known))
    names = _list([f"{owner}{each}" for each in known]) or "none"
    hint = f"did you mean {close}?" if close else f"there are {names}"
    return NoPicture(f"there is no {what} `{owner}{name}`; {hint}")


_MOST = 12


def _list(names: list[str]) -> str:
    more = [f"and {len(names) - _MOST} more"] if len(names) > _MOST else []
    return ", ".join([*names[:_MOST], *more])
