"""What could stand at the cursor."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace

from specc.lang import ExprError, ExprErrors
from specc.lang.builtins import BUILTIN_NAMES
from specc.lang.errors import CLOCK_NAMES
from specc.lang.syntax import USAGE
from specc.lang.types import SAME, SYNTAX
from specc.lang.typing import expression
from specc.model.bindings import PLANT
from specc.model.fsm import Parameter
from specc.model.system import System
from specc.model.types import Enum, Record, Type
from specc.model.units import UNITS
from specc.resolve.definitions import may_be_size
from specc.resources import LIBRARY, library_parts
from specc.schema import ROW_KEYS
from specc.schema.keys import Role, RoleForm, SymbolKind
from specc.schema.places import (
    defined_by,
    keys_at,
    names_used_file,
    role_of,
    split_at_part,
    values_at,
)
from specc.source import Place, Route, beside
from specc.tools.lsp.cursor import TextCursor, cursors, outside_brackets
from specc.tools.lsp.describe import describe_symbol
from specc.tools.lsp.index import Index, Symbol

_UNIT = re.compile(r"\d\s*\[(?:[^\]]*[*/\s(])?(\w*)$")
_PEER = re.compile(r"(?<![\w.])x\s*\.\s*(\w*)$")
_ELEMENT = re.compile(r"(?<![\w.])x\s*\.\s*(\w+)\s*\.\s*(\w*)$")
_PART = re.compile(r"\.(\w*)$")
_AGE = re.compile(r"\b(?:fresh|present|age|late)\(\s*(\w*)$")
_COMPARED = re.compile(r"(?:[=!]=\s*|\bin\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_RESUMED = re.compile(r"\bresume\s*\(\s*\w*$")
_OF_MODE = re.compile(r"\b(?:elapsed|entered)\s*\(\s*\w*$")
_NAME = re.compile(r"[^\W\d]?\w*$")
_HEAD = re.compile(r"(\w+)\s*\[[^\[\]]*$")

_CONSTANTS: tuple[SymbolKind, ...] = ("parameter", "constant", "file", "operator", "member")
_VISIBLE: dict[RoleForm, tuple[SymbolKind, ...]] = {
    "constant": _CONSTANTS,
    "argument": _CONSTANTS,
    "initial": _CONSTANTS,
    "full": ("memory", "let", *_CONSTANTS),
}
PARAMETER_TYPES = {"frame": "", "agent": ""}
"""Types that only parameters have."""


@dataclass(frozen=True, slots=True)
class Completion:
    """A proposal, how many characters before the cursor it replaces, and what follows it."""

    label: str
    kind: str
    detail: str = ""
    words: str = ""
    replaces: int = 0
    suffix: str = ""


_BUFFERS = Completion("x", "inputs", "input buffers")
_PATH = re.compile(rf"(?:{LIBRARY})?[\w.]*$")
_FIXED = {
    "initial condition": ("always", "otherwise"),
    "terminal condition": ("always", "never"),
    "error condition": ("never",),
}
_WHOLE_PATHS: frozenset[RoleForm] = frozenset(("name", "interface", "task", "path"))
"""Forms in which a proposal replaces a path with dots, and not the name at its end alone."""


def complete(index: Index | None, path: str, text: str, offset: int) -> list[Completion]:
    """Everything that can be written at an offset of a text, however unfinished that is."""
    found: dict[tuple[str, str], Completion] = {}
    for cursor in cursors(text, offset):
        role = None if cursor.is_key else role_of(cursor.route)
        is_path = role is None or (role.form in _WHOLE_PATHS and not _is_argument(role, cursor))
        pattern = _PATH if is_path else _NAME
        word = pattern.search(cursor.before)
        size = len(word.group()) if word else 0
        suffix = ": " if cursor.is_key and not text[offset:].lstrip(" ").startswith(":") else ""
        proposed = _of_schema(cursor)
        if index is not None:
            known = _Proposals(index, path, split_at_part(cursor.route)[0])
            named = known.keys(cursor) if cursor.is_key else known.values(cursor, role)
            proposed = (*named, *proposed) if cursor.is_key else (*proposed, *named)
        for item in proposed:
            if item.label not in cursor.siblings:
                whole = replace(item, replaces=size, suffix=suffix)
                found.setdefault((item.label, item.kind), whole)
    return list(found.values())


def _is_argument(role: Role, cursor: TextCursor) -> bool:
    """Whether a cursor stands in the brackets of a call of a behaviour or function."""
    return role.kind in ("behaviour", "function") and "(" in cursor.before


def _of_schema(cursor: TextCursor) -> Iterable[Completion]:
    """Keys and choices of the structure, and parts of the library."""
    route = cursor.route
    if cursor.is_key:
        keys = keys_at(route).items()
        return [Completion(k, "key", "", w) for k, w in keys if defined_by((*route, k)) is None]
    parts = library_parts() if names_used_file(route) else ()
    values = [Completion(value, "value") for value in values_at(route)]
    return [*values, *(Completion(name, "file") for name in parts)]


@dataclass(frozen=True, slots=True)
class _Proposals:
    """What texts in a subsystem of a file may name."""

    index: Index
    path: str
    owner: Route

    def _visible(
        self, *kinds: SymbolKind | None, owner: Route | None = None, below: str = ""
    ) -> Iterator[Completion]:
        """The symbols of some kinds whose qualified names begin with `below`."""
        for symbol in self.index.visible(self.path, self.owner if owner is None else owner):
            if symbol.kind in kinds and symbol.qualified.startswith(below):
                yield self._item(symbol)

    def _item(self, symbol: Symbol) -> Completion:
        words = describe_symbol(self.index, symbol)
        return Completion(symbol.name, symbol.kind, str(symbol.type or ""), words)

    def keys(self, cursor: TextCursor) -> Iterator[Completion]:
        """Keys that are names: targets of functions, elements of the other end, parameters."""
        index, rest = self.index, split_at_part(cursor.route)[1]
        match rest:
            case ("functions", _) | ("through",):
                yield from self._visible("memory")
                for symbol in index.visible(self.path, self.owner):
                    if symbol.kind == "element" and symbol.qualified.startswith("y."):
                        yield replace(self._item(symbol), label=symbol.qualified)
            case ("x" | "y", str(peer)):
                wire = index.wires.get((self.path, (*self.owner, rest[0], peer)))
                for element in wire.elements if wire else ():
                    yield Completion(element.name, "element", str(element.type))
            case (*_, "with"):
                user = index.node(self.path, cursor.route[:-1])
                used = user.values.get("use") if user else None
                file = index.files.get(beside(self.path, (used.scalar if used else "") or ""))
                for symbol in file.top.values() if file else ():
                    if symbol.kind == "parameter":
                        yield self._item(symbol)
            case ("plant", "bind"):
                for device in index.system.devices if index.system else ():
                    for element in (*device.x, *device.y):
                        name = f"{device.qualified_name}.{element.name}"
                        yield Completion(name, "element", str(element.type), element.title)

    def values(self, cursor: TextCursor, role: Role | None) -> Iterator[Completion]:
        """Names that can stand at the cursor."""
        before, form = cursor.before, role.form if role else "path"
        match form:
            case "path":
                pass
            case "type" | "signature" | "parameters":
                yield from self._type(before)
            case "interface":
                arguments: tuple[SymbolKind, ...] = ("frame", "type")
                kinds = arguments if "[" in before else ("interface",)
                yield from self._visible(*kinds, owner=())
                if not before:
                    yield Completion(SAME, "value", "the elements of the other end")
            case "name" if role and _is_argument(role, cursor):
                yield from self._expression("full", before)
                yield from self._around(cursor)
                for parameter in self._parameters(before.partition("(")[0].strip()):
                    yield Completion(f"{parameter.name}: ", "parameter", str(parameter.type))
            case "name" if split_at_part(cursor.route)[1][:1] == ("transitions",):
                yield from self._of_row(role.kind if role else None, cursor)
            case "name":
                kind = role.kind if role else None
                yield from (Completion(word, "value") for word in _FIXED.get(kind or "", ()))
                yield from self._visible(kind, *(("mode",) if kind == "state" else ()))
            case "task":
                yield from self._task((role.kind if role else None) or "")
            case "formula":
                yield from self._formula(before)
            case _:
                yield from self._expression(form, before)
                yield from self._around(cursor)
                if form == "argument":
                    yield from self._visible("frame", "agent", owner=())

    def _of_row(self, kind: SymbolKind | None, cursor: TextCursor) -> Iterator[Completion]:
        """Names in a row of the transition table."""
        if kind == "error condition":
            yield from self._causes(cursor.sources)
        elif kind != "state":
            yield from (Completion(word, "value") for word in _FIXED.get(kind or "", ()))
            yield from self._visible(kind)
        elif _RESUMED.search(cursor.before):
            yield from self._visible("mode")
        else:
            yield from self._visible("state", "mode")
            if cursor.route[-1] in (ROW_KEYS.index("to"), "to"):
                for mode in self._visible("mode"):
                    label = f"resume({mode.label})"
                    yield Completion(label, "value", "", "back to where the mode was left")

    def _causes(self, sources: Collection[str]) -> Iterator[Completion]:
        """The error conditions of some states, and of those in some modes."""
        errors = {symbol.label: symbol for symbol in self._visible("error condition")}
        for subsystem in self.index.system.subsystems if self.index.system else ():
            if (subsystem.place.file, subsystem.place.route) == (self.path, self.owner):
                named = (s for s in subsystem.states if {s.name, *s.modes} & {*sources})
                names = (name for state in named for name, _ in subsystem.errors(state) if name)
                yield from (errors.get(n, Completion(n, "value")) for n in dict.fromkeys(names))

    def _around(self, cursor: TextCursor) -> Iterator[Completion]:
        """The parameters of the behaviour or function around a cursor."""
        match split_at_part(cursor.route)[1]:
            case ("behaviours" | "functions", str(name), *_):
                for parameter in self._parameters(name):
                    yield Completion(parameter.name, "parameter", str(parameter.type))

    def _parameters(self, name: str) -> tuple[Parameter, ...]:
        """The parameters of a behaviour or function of the subsystem."""
        system = self.index.system
        for generic in (g for s in (system.subsystems if system else ()) for g in s.generics):
            place = generic.part.place
            is_near = (place.file, split_at_part(place.route)[0]) == (self.path, self.owner)
            if is_near and generic.part.name == name:
                return generic.parameters
        return ()

    def _expression(self, form: RoleForm, before: str) -> Iterator[Completion]:
        """Names that can follow the beginning of an expression."""
        has_inputs = form in ("initial", "full")
        if _UNIT.search(before):
            yield from (Completion(unit, "unit") for unit in UNITS)
        elif found := _ELEMENT.search(before):
            if has_inputs:
                yield from self._visible("element", below=f"x.{found.group(1)}.")
        elif _PEER.search(before):
            symbols = self.index.visible(self.path, self.owner) if has_inputs else ()
            names = (s.qualified.split(".") for s in symbols if s.kind == "element")
            peers = dict.fromkeys(name[1] for name in names if name[0] == "x")
            yield from (Completion(peer, "subsystem") for peer in peers)
        elif found := _PART.search(before):
            type_ = self._type_at_end(before[: found.start()])
            if isinstance(type_, Record):
                yield from (Completion(name, "field", str(inner)) for name, inner in type_.fields)
            elif type_ is not None:
                yield from (Completion(name, "component") for name in type_.names)
        elif has_inputs and _AGE.search(before):
            yield _BUFFERS
        elif form == "full" and _OF_MODE.search(before):
            yield from self._visible("mode")
        else:
            if found := _COMPARED.search(before):
                # All members if the type is not known yet.
                type_ = self._type_at_end(before[: found.start()].rstrip())
                enum = f"{type_.name}." if isinstance(type_, Enum) else ""
                yield from self._visible("member", below=enum)
            yield from self._visible(*_VISIBLE[form])
            modes = [*self._visible("mode")] if form == "full" else []
            known = (name for name in BUILTIN_NAMES if modes or name not in CLOCK_NAMES)
            yield from (Completion(name, "builtin") for name in known)
            if form == "full":
                yield from (Completion(name, "clock") for name in CLOCK_NAMES)
            if has_inputs:
                yield _BUFFERS

    def _type_at_end(self, before: str) -> Type | None:
        """The type of the value at the end of a text: names, calls and brackets.

        It is typed in the widest scope of the subsystem.
        """
        ends = (
            at + 1 for at, char in outside_brackets(before) if not (char.isalnum() or char in "_.")
        )
        scopes = [
            meaning.scope
            for (file, route), meaning in self.index.meanings.items()
            if file == self.path and route[: len(self.owner)] == self.owner
        ]
        value = before[next(ends, 0) :]
        if not value or not scopes:
            return None
        widest = max(scopes, key=lambda scope: len(scope.lets) + len(scope.memory))
        try:
            return expression(value, widest).type
        except (ExprError, ExprErrors):
            return None

    def _type(self, before: str) -> Iterator[Completion]:
        """Names that can follow the beginning of a type or a signature."""
        head = _HEAD.search(before)
        around = head.group(1) if head else ""
        if around in ("real", "spatial", "vector"):
            yield from (Completion(unit, "unit") for unit in UNITS)
        if around in ("vector", "image"):
            for symbol in self.index.visible(self.path, ()):
                node = self.index.node(symbol.place.file, symbol.place.route)
                if symbol.kind == "parameter" and node and may_be_size(node.scalar or ""):
                    yield self._item(symbol)
        if around in ("", "vector", "list", "nonempty", "optional", "partial"):
            yield from self._visible("type", owner=())
            for label, usage in (SYNTAX | PARAMETER_TYPES).items():
                yield Completion(label, "type", usage)
        elif around not in ("real", "enum", "image"):
            yield from self._visible("frame", owner=())

    def _task(self, kind: str) -> Iterator[Completion]:
        """Subsystems; states and memory of the one whose cycles are counted."""
        system = self.index.system
        subsystems, task = (system.subsystems, system.task) if system else ((), None)
        counted = [s for s in subsystems if task and s.qualified_name == task.subsystem]
        names = {
            "subsystem": [s.qualified_name for s in subsystems],
            "state": [state.name for s in counted for state in s.states],
            "memory": [m.name for s in counted for m in s.memory if m.name.isidentifier()],
        }
        yield from (Completion(name, kind) for name in names[kind])

    def _formula(self, before: str) -> Iterator[Completion]:
        """Names that can follow in a requirement."""
        paths = paths_of(self.index.system)
        if (found := next_names(before, paths)) is not None:
            yield from (Completion(name, "value") for name in found)
            return
        yield from replace(self, owner=())._expression("constant", before)
        if not _UNIT.search(before):
            yield from self._visible("let", owner=())
            yield from (Completion(name, "agent") for name in paths.names_below(()))
            yield from (Completion(name, "operator") for name in WORDS)


# What can be written next in a requirement, which has names for values of all agents.
#
# A path leads to a part of the system: `("rover", "c", "n")`, `("rover", "E", "wheel", "s")`,
# `("plant", "at")`; `("rover", "c", "state", "S0")` is a state.


NamePath = tuple[str, ...]
STATE = "state"
WORDS = (*USAGE, STATE, "present")
_OF_STATE = re.compile(r"\bstate\(\s*([\w.]+)\s*\)\s*(?:[=!]=\s*|in\s*\{(?:[^{}]*[\s,])?)(\w*)$")
_DOTTED = re.compile(r"(?<![\w.])((?:[^\W\d]\w*\.)+)(\w*)$")


@dataclass(eq=False, slots=True)
class Paths:
    """All paths of a system; `copies` has, by the name that a `for` gives to many, one of them."""

    known: dict[NamePath, None] = field(default_factory=dict)
    copies: dict[str, str] = field(default_factory=dict)

    def add(self, path: NamePath, place: Place) -> None:
        """Add a path; copies that a `for` makes share one name as well."""
        self.known[path] = None
        name = str(place.route[-1]) if place.route else path[-1]
        if path[-1] != name:
            self.known.setdefault((*path[:-1], name))
            if len(path) == 1:
                self.copies.setdefault(name, path[0])

    def names_below(self, path: NamePath) -> list[str]:
        """The names that may follow a path."""
        size = len(path)
        longer = (known for known in self.known if len(known) > size and known[:size] == path)
        return list(dict.fromkeys(known[size] for known in longer if known[size] != STATE))


def paths_of(system: System | None) -> Paths:
    """The paths to all parts."""
    paths = Paths()
    for agent in system.agents if system else ():
        paths.add((agent.name,), agent.place)
        for subsystem in agent.subsystems:
            path: NamePath = (subsystem.agent, subsystem.name)
            memory = (item.name for item in subsystem.memory if item.name.isidentifier())
            names: list[NamePath] = [(name,) for name in memory]
            names += [(STATE, state.name) for state in subsystem.states]
            names += [(STATE, mode.name) for mode in subsystem.modes]
            for port in subsystem.ports:
                names += [(port.direction, port.peer, element.name) for element in port.elements]
            paths.known |= {path: None} | {(*path, *name): None for name in names}
        for device in agent.devices:
            path = tuple(device.qualified_name.split("."))
            paths.known |= {(*path, element.name): None for element in (*device.x, *device.y)}
    for item in system.plant.observed if system and system.plant else ():
        paths.add((PLANT, item.name), item.place)
    return paths


def next_names(before: str, paths: Paths) -> list[str] | None:
    """The names that can follow the beginning of a formula; None where no path leads on."""
    if found := _OF_STATE.search(before):
        path = tuple(found[1].split("."))
        return [known[-1] for known in paths.known if known[:-1] == (*path, STATE)]
    if found := _DOTTED.search(before):
        first, *more = found[1].rstrip(".").split(".")
        return paths.names_below((paths.copies.get(first, first), *more))
    return None
