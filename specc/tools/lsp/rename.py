"""Renaming a symbol everywhere, to a name that is free."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator

from specc.lang import RESERVED, TYPE_WORDS
from specc.model.system import System
from specc.model.types import Enum, Type, within
from specc.model.units import UNITS
from specc.resolve.uses import names_in
from specc.resources import is_library_part
from specc.schema.keys import RoleForm, SymbolKind
from specc.schema.places import role_of, split
from specc.tools.lsp.completion import PARAMETER_TYPES
from specc.tools.lsp.index import Index, Occurrence, Symbol
from specc.tools.lsp.project import FileEdit, Project

# Whether a symbol can be renamed: invalid names, names in use, names that Python relies on.


_NAME = re.compile(r"[^\W\d]\w*")
_YAML_WORDS = frozenset({"true", "false", "null"})
_PEER_WORDS = frozenset({"c", "E", "R", "control"})
_VALUES: frozenset[SymbolKind] = frozenset(
    {"memory", "let", "parameter", "constant", "file", "operator", "member", "variable"}
)
"""Kinds that expressions name plainly: one name of them all."""
_PARTS: frozenset[SymbolKind] = frozenset({"agent", "subsystem", "device"})
"""Kinds that name buffers: peers."""


class RenameError(Exception):
    """Why a symbol is not renamed, in words for the person who asked."""


def check_renameable(index: Index, symbol: Symbol) -> None:
    """Raise `RenameError` if a symbol keeps its name."""
    reason = _fixed(index, symbol)
    if reason:
        raise RenameError(f"`{symbol.name}` is not renamed: {reason}")


def _fixed(index: Index, symbol: Symbol) -> str:
    """Why nobody may rename a symbol; empty if somebody may."""
    if symbol.kind == "subsystem" and symbol.place.route[-1] in ("control", "subsystem"):
        return "a control subsystem is called `c` everywhere"
    if any(is_library_part(end.place.file) for end in symbol.declarations):
        return "it is declared in the library of specc"
    node = index.node(symbol.place.file, symbol.place.route)
    if node is not None and "for" in node.values:
        return "it is the name of many, which others spell with their indices"
    if symbol.kind == "field":
        type_ = index.node(symbol.place.file, symbol.place.route[:2])
        return "the field belongs to a Python class" if type_ and "python" in type_.values else ""
    if symbol.kind == "member":
        if index.system is None:
            return "it is not known whether Python code uses it"
        code = enums_in_python(index.system).get(symbol.qualified.partition(".")[0])
        return f"Python code knows it by this name: {code}" if code else ""
    return ""


def check_name(symbol: Symbol, new: str) -> None:
    """Raise `RenameError` if a name is not valid for a symbol of this kind."""
    if new == symbol.name:
        raise RenameError("it already has this name")
    if not _NAME.fullmatch(new) or not new.isidentifier():
        raise RenameError(f"`{new}` is not a valid name; use letters, digits and _")
    words = RESERVED | {"always", "never"} | (_PEER_WORDS if symbol.kind in _PARTS else set())
    if symbol.kind == "type":
        words |= TYPE_WORDS | PARAMETER_TYPES.keys()
    if new in words or new.lower() in _YAML_WORDS:
        raise RenameError(f"`{new}` is a word of the language")
    if symbol.kind == "type" and new in UNITS:
        raise RenameError(f"`{new}` is a unit")


def check_free(index: Index, symbol: Symbol, path: str, occurrence: Occurrence, new: str) -> None:
    """Raise `RenameError` if something that can be named at an occurrence has the new name."""
    owner, _ = split(occurrence.place.route)
    for other in index.visible(path, owner):
        if other.name == new and _same_namespace(symbol, other):
            raise RenameError(_taken(index, other))


def check_unclaimed(index: Index, symbol: Symbol, new: str) -> None:
    """Raise `RenameError` if a variable frame or a part of the system has the new name."""
    if symbol.kind == "frame" and new in _frame_variables(index, symbol):
        raise RenameError(f"`{new}` is taken: it stands for any frame in a type or a signature")
    for other in _parts(index) if symbol.kind in _PARTS else ():
        near = "agent" in (symbol.kind, other.kind) or _agent_of(symbol) == _agent_of(other)
        if other.name == new and near:
            raise RenameError(_taken(index, other))


def _taken(index: Index, other: Symbol) -> str:
    line = index.sources.span(other.place).line
    return f"`{other.name}` is taken: {other.kind} `{other.name}`, line {line}"


def _parts(index: Index) -> Iterator[Symbol]:
    for file in index.files.values():
        yield from (symbol for symbol in file.by_route.values() if symbol.kind in _PARTS)


def _agent_of(part: Symbol) -> tuple[object, ...]:
    return (part.place.file, *part.place.route[:-2])


def _frame_variables(index: Index, symbol: Symbol) -> Iterator[str]:
    """Names that stand for any frame: in signatures, and in types that mention a frame.

    A frame in a signature that is not declared is a variable; so are the parameters of a type.
    """
    for text in index.found.types:
        named = {mention.name for mention in names_in(text) if mention.kind == "frame"}
        if text.form == "signature":
            yield from named
        elif symbol.name in named:
            yield from (name for name, frame in text.names.frames.items() if frame[:1] == "?")


def _same_namespace(symbol: Symbol, other: Symbol) -> bool:
    if symbol.kind in _VALUES:
        return other.kind in _VALUES
    if symbol.kind != other.kind:
        return False
    if symbol.kind in ("element", "field"):
        groups = {end.qualified.rpartition(".")[0] for end in symbol.declarations}
        return other.qualified.rpartition(".")[0] in groups
    return True


def enums_in_python(system: System) -> dict[str, str]:
    """Enums that reach Python code, which knows their members by name, each with that code."""
    found: dict[str, str] = {}
    for type_, code in _crossing(system):
        for part in within([type_]):
            if isinstance(part, Enum):
                found.setdefault(part.name, code)
    return found


def _crossing(system: System) -> Iterator[tuple[Type, str]]:
    """Types of what goes to operators and to the functions of the plant, or comes from them."""
    for operator in system.operators:
        for type_ in (operator.result, *(type_ for _, type_ in operator.parameters)):
            yield type_, f"operator `{operator.name}`"
    for device in system.devices:
        for element in (*device.x, *device.y):
            yield element.type, f"the plant, by `{device.qualified_name}.{element.name}`"
    watched = system.task.watch if system.task else ()
    for subsystem in system.subsystems:
        for memory in subsystem.memory:
            if memory.name in watched:
                yield memory.type, "the judge of the task"


# Renaming a symbol everywhere, or saying why that cannot be done safely.


_EXPRESSIONS: tuple[RoleForm, ...] = ("constant", "initial", "full", "formula")


def rename(project: Project, index: Index, symbol: Symbol, new: str) -> list[FileEdit]:
    """The edits that give a symbol another name in every system that has to do with it.

    Raises:
        RenameError: the name cannot be one, is taken, or specc would find other things afterwards.
    """
    check_renameable(index, symbol)
    check_name(symbol, new)
    edits: dict[FileEdit, None] = {}
    known = _everywhere(project, index, symbol)
    _check_read(known)
    for around, twin in known:
        for other in (twin, *twin.tied):
            check_renameable(around, other)
            check_unclaimed(around, other, new)
        edits |= dict.fromkeys(_edits(project, around, twin, new))
    _check_effect(project, edits, new)
    return list(edits)


def apply(text: str, edits: Iterable[FileEdit]) -> str:
    """A text with the edits of its file made."""
    for edit in sorted(edits, key=lambda e: e.start, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def _everywhere(project: Project, index: Index, symbol: Symbol) -> list[tuple[Index, Symbol]]:
    """The symbol in each system that has to do with it.

    A system that reads a file with one of its ends may have another end in one of its own files.
    """
    found = [(index, symbol)]
    seen: set[str] = set()
    for around, twin in found:
        named = {path for path, _ in around.naming((*twin.declarations, *twin.tied))}
        if symbol.kind != "variable" and not named <= seen:
            for other in project.indexes(named - seen):
                ends = (other.counterpart(end) for end in (*twin.declarations, *twin.tied))
                counterpart = next((end for end in ends if end is not None), None)
                if counterpart is not None and all(other is not known for known, _ in found):
                    found.append((other, counterpart))
        seen |= named
    return found


def _edits(project: Project, index: Index, symbol: Symbol, new: str) -> Iterator[FileEdit]:
    symbols = (*symbol.declarations, *symbol.tied)
    for path, occurrence in index.naming(symbols):
        if project.source(path).text != index.text(path):
            raise RenameError("correct the errors in the file first: it is not fully understood")
        check_free(index, symbol, path, occurrence, new)
        if _spells(index, path, occurrence):
            yield FileEdit(path, occurrence.start, occurrence.end, new)


def _check_read(known: list[tuple[Index, Symbol]]) -> None:
    """Texts with errors, and those that no system has read, may name what only a meaning tells."""
    read = {key for index, _ in known for key, meaning in index.meanings.items() if meaning.expr}
    for index, symbol in known:
        word = re.compile(rf"\b{re.escape(symbol.name)}\b")
        owners = {end.owner for end in symbol.declarations}
        for source in index.sources:
            for route, _, node in source.nodes:
                role, owner = role_of(route), split(route)[0]
                is_text = role and role.form in _EXPRESSIONS and (source.path, route) not in read
                is_near = not owner or () in owners or owner in owners
                if is_text and is_near and word.search(node.scalar or ""):
                    words = f"the expression that may refer to this `{symbol.name}`"
                    raise RenameError(f"first correct {words}")


def _spells(index: Index, path: str, occurrence: Occurrence) -> bool:
    """Whether the stretch is the name itself: `E` names a device in its own way."""
    text = index.text(path)
    return text[occurrence.start : occurrence.end] == occurrence.symbol.name


def _check_effect(project: Project, edits: Iterable[FileEdit], new: str) -> None:
    """With the new name specc reports exactly what it reported before."""
    texts = {
        path: apply(project.source(path).text, [e for e in edits if e.path == path])
        for path in {edit.path for edit in edits}
    }
    before, after = project.compare(texts)
    worse = Counter(d.code for d in after) - Counter(d.code for d in before)
    for diagnostic in after:
        if diagnostic.code in worse:
            raise RenameError(f"`{new}` would be an error: {diagnostic.message}")
    if Counter(d.code for d in before) - Counter(d.code for d in after):
        raise RenameError(f"`{new}` would change what the specification means")
