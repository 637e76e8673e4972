"""The names that requirements have for values of all agents: what may be written next.

A path leads to a part of the system: `("rover", "c", "n")`, `("rover", "E", "wheel", "s")`,
`("plant", "at")`; `("rover", "c", "state", "S0")` is a state.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from specc.lang.syntax import USAGE
from specc.model.system import PLANT, Subsystem, System
from specc.source import Place

NamePath = tuple[str, ...]
STATE = "state"


@dataclass(eq=False, slots=True)
class Paths:
    """The paths that there are; `members` has one of those that a `for` makes, by their name."""

    known: dict[NamePath, None] = field(default_factory=dict)
    members: dict[NamePath, NamePath] = field(default_factory=dict)

    def add(self, path: NamePath, place: Place) -> None:
        """A part; one that has another name than its text is one of many of that name."""
        self.known[path] = None
        name = str(place.route[-1]) if place.route else path[-1]
        if path[-1] != name and len(path) < 3:
            self.known.setdefault((*path[:-1], name))
            self.members.setdefault((*path[:-1], name), path)

    def below(self, path: NamePath) -> list[str]:
        """The names that may follow a path."""
        size = len(path)
        longer = (known for known in self.known if len(known) > size and known[:size] == path)
        return list(dict.fromkeys(known[size] for known in longer if known[size] != STATE))


def paths_of(system: System) -> Paths:
    """The paths to all parts."""
    paths = Paths()
    for agent in system.agents:
        paths.add((agent.name,), agent.place)
        for subsystem in agent.subsystems:
            _of_subsystem(paths, subsystem)
        for device in agent.devices:
            path = tuple(device.qualified_name.split("."))
            paths.known |= {(*path, element.name): None for element in (*device.x, *device.y)}
    for item in system.plant.observed if system.plant else ():
        paths.add((PLANT, item.name), item.place)
    return paths


def _of_subsystem(paths: Paths, subsystem: Subsystem) -> None:
    path = subsystem.agent, subsystem.name
    paths.known[path] = None
    paths.known |= {(*path, memory.name): None for memory in subsystem.memory}
    paths.known |= {(*path, STATE, state.name): None for state in subsystem.states}
    for port in subsystem.ports:
        below = (*path, port.direction, port.peer)
        paths.known |= {(*below, element.name): None for element in port.elements}


_OF_STATE = re.compile(r"\bstate\(\s*([\w.]+)\s*\)\s*(?:[=!]=\s*|in\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_DOTTED = re.compile(r"(?<![\w.])((?:[^\W\d]\w*\.)+)(\w*)$")
WORDS = (*USAGE, STATE, "present")


def following(before: str, paths: Paths) -> list[str] | None:
    """The names that can follow the beginning of a formula; None where no path leads on."""
    if found := _OF_STATE.search(before):
        path = tuple(found[1].split("."))
        return [known[-1] for known in paths.known if known[:-1] == (*path, STATE)]
    if found := _DOTTED.search(before):
        first, *more = found[1].rstrip(".").split(".")
        return paths.below((*paths.members.get((first,), (first,)), *more))
    return None
