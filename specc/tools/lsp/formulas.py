"""The names that requirements have for values of all agents, and what each of them stands for.

A path leads to a part of the system: `("rover", "c", "n")`, `("rover", "E", "wheel", "s")`,
`("plant", "at")`; `("rover", "c", "state", "S0")` is a state.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from specc.lang import ExprError
from specc.lang.parse import span
from specc.lang.temporal import USAGE, parse_formula
from specc.model.binding import PLANT
from specc.model.system import Device, Subsystem, System
from specc.source import Place
from specc.tools.lsp.symbols import Key

Path = tuple[str, ...]
STATE = "state"


@dataclass(slots=True)
class Paths:
    """Where each part is defined, and one of the members of what one `for` makes."""

    keys: dict[Path, Key] = field(default_factory=dict)
    members: dict[Path, Path] = field(default_factory=dict)

    def add(self, path: Path, place: Place) -> None:
        """A part; one that has another name than its text is one of many of that name."""
        key = self.keys[path] = place.file, place.route
        name = str(place.route[-1]) if place.route else path[-1]
        if path[-1] != name and len(path) < 3:
            self.keys.setdefault((*path[:-1], name), key)
            self.members.setdefault((*path[:-1], name), path)

    def below(self, path: Path) -> list[str]:
        """The names that may follow a path."""
        size = len(path)
        longer = (known for known in self.keys if len(known) > size and known[:size] == path)
        return list(dict.fromkeys(known[size] for known in longer if known[size] != STATE))


def paths_of(system: System, named: Mapping[Key, Key]) -> Paths:
    """The paths to all parts; `named` has what has the name of the peer of a buffer."""
    paths = Paths()
    for agent in system.agents:
        paths.add((agent.name,), agent.place)
        for subsystem in agent.subsystems:
            _of_subsystem(paths, subsystem, named)
        for device in agent.devices:
            _of_device(paths, device)
    for item in system.plant.observed if system.plant else ():
        paths.add((PLANT, item.name), item.place)
    return paths


def _of_subsystem(paths: Paths, subsystem: Subsystem, named: Mapping[Key, Key]) -> None:
    path = subsystem.agent, subsystem.name
    paths.keys[path] = subsystem.place.file, subsystem.place.route
    for memory in subsystem.memory:
        paths.add((*path, memory.name), memory.place)
    for state in subsystem.states:
        paths.add((*path, STATE, state.name), state.place)
    for port in subsystem.ports:
        peer = named.get((port.place.file, port.place.route))
        if peer is not None:
            paths.keys[(*path, port.direction, port.peer)] = peer
        for element in port.elements:
            paths.add((*path, port.direction, port.peer, element.name), element.place)


def _of_device(paths: Paths, device: Device) -> None:
    path = tuple(device.qualified_name.split("."))
    paths.add(path, device.place)
    for element in (*device.x, *device.y):
        paths.add((*path, element.name), element.place)


@dataclass
class _Naming:
    """Finds paths in a syntax tree; `many` has what the variables of quantifiers stand for."""

    members: Mapping[Path, Path]
    found: list[tuple[Path, int, int]] = field(default_factory=list)

    def visit(self, node: ast.AST, many: Mapping[str, Path]) -> None:
        match node:
            case ast.GeneratorExp(generators=[each]) if isinstance(each.target, ast.Name):
                group = self._path(each.iter, many)
                inside = {**many, each.target.id: self.members.get(group, ())}
                self.visit(each.iter, many)
                self.visit(node.elt, inside)
                return
            case ast.Compare():
                self._states([node.left, *node.comparators], many)
            case ast.Attribute() | ast.Name() | ast.Subscript():
                if self._path(node, many, note=True):
                    return
        for child in ast.iter_child_nodes(node):
            self.visit(child, many)

    def _states(self, sides: list[ast.expr], many: Mapping[str, Path]) -> None:
        """Names of states beside `state(agent.subsystem)`."""
        owners = [
            self._path(side.args[0], many)
            for side in sides
            if isinstance(side, ast.Call) and _called(side) == STATE and side.args
        ]
        for owner in owners[:1]:
            for side in sides:
                for name in side.elts if isinstance(side, ast.Set) else (side,):
                    if isinstance(name, ast.Name):
                        self.found.append(((*owner, STATE, name.id), *span(name)))

    def _path(self, node: ast.AST, many: Mapping[str, Path], *, note: bool = False) -> Path:
        """Where a value leads; empty for what is no path. What it passes is noted."""
        match node:
            case ast.Name(id=name) if name in many:
                return many[name]
            case ast.Name(id=name):
                path: Path = (name,)
                begin, end = span(node)
            case ast.Attribute(value=value, attr=name):
                above = self._path(value, many, note=note)
                if not above:
                    return ()
                path, end = (*above, name), span(node)[1]
                begin = end - len(name)
            case ast.Subscript(value=value):
                return self.members.get(self._path(value, many, note=note), ())
            case _:
                return ()
        if note:
            self.found.append((path, begin, end))
        return path


def _called(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else ""


def paths_in(text: str, paths: Paths) -> Iterator[tuple[Key, int, int]]:
    """What a formula names: where it is defined, and where the name stands in the text."""
    try:
        tree = parse_formula(text)
    except ExprError:
        return
    naming = _Naming(paths.members)
    naming.visit(tree, {})
    for path, begin, end in dict.fromkeys(naming.found):
        if key := paths.keys.get(path):
            yield key, begin, end


_OF_STATE = re.compile(r"\bstate\(\s*([\w.]+)\s*\)\s*(?:[=!]=\s*|in\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_DOTTED = re.compile(r"(?<![\w.])((?:[^\W\d]\w*\.)+)(\w*)$")
WORDS = (*USAGE, STATE, "present")


def following(before: str, paths: Paths) -> tuple[list[str], str] | None:
    """The names that can follow the beginning of a formula, and the part of one that is there.

    None where no path leads on.
    """
    if found := _OF_STATE.search(before):
        path = tuple(found[1].split("."))
        names = [known[-1] for known in paths.keys if known[:-1] == (*path, STATE)]
        return names, found[2]
    if found := _DOTTED.search(before):
        first, *more = found[1].rstrip(".").split(".")
        return paths.below((*paths.members.get((first,), (first,)), *more)), found[2]
    return None
