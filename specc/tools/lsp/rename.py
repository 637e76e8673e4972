"""Renaming a symbol everywhere, to a name that is free."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator

from specc.lang import RESERVED, TYPE_WORDS
from specc.model.system import System
from specc.model.types import Enum, Type, nested_types
from specc.model.units import UNITS
from specc.reachable import grouped
from specc.resolve.uses import names_in
from specc.resources import is_library_part
from specc.schema.keys import RoleForm, SymbolKind
from specc.schema.places import role_of, split_at_part
from specc.tools.lsp.completion import PARAMETER_TYPES
from specc.tools.lsp.index import Index, Symbol
from specc.tools.lsp.project import FileEdit, Project

# Whether a symbol can be renamed: invalid names, names in use, names that Python relies on.


_NAME = re.compile(r"[^\W\d]\w*")
_YAML_WORDS = frozenset({"true", "false", "null"})
_PEER_WORDS = frozenset({"c", "E", "R", "control"})
_VALUES: frozenset[SymbolKind] = frozenset(
    {"memory", "let", "parameter", "constant", "file", "operator", "member", "variable"}
)
"""Kinds that expressions name plainly: one name of them all."""
_NODES: frozenset[SymbolKind] = frozenset({"state", "mode"})
"""Kinds that rows name."""
_PARTS: frozenset[SymbolKind] = frozenset({"agent", "subsystem", "device"})
"""Kinds that name buffers: peers."""


class RenameError(Exception):
    """Why a symbol is not renamed, in words for the person who asked."""


def check_renameable(index: Index, symbol: Symbol) -> None:
    """Raise `RenameError` if a symbol keeps its name."""
    node = index.node(symbol.place.file, symbol.place.route)
    reason = ""
    if symbol.kind == "subsystem" and symbol.place.route[-1] in ("control", "subsystem"):
        reason = "a control subsystem is called `c` everywhere"
    elif any(is_library_part(end.place.file) for end in symbol.declarations):
        reason = "it is declared in the library of specc"
    elif node is not None and "for" in node.values:
        reason = "it is the name of many, which others spell with their indices"
    elif symbol.kind == "field":
        type_ = index.node(symbol.place.file, symbol.place.route[:2])
        if type_ and "python" in type_.values:
            reason = "the field belongs to a Python class"
    elif symbol.kind == "member" and index.system is None:
        reason = "it is not known whether Python code uses it"
    elif symbol.kind == "member" and index.system is not None:
        enum = symbol.qualified.partition(".")[0]
        for part, code in _enums_in_python(index.system):
            if part.name == enum:
                reason = f"Python code knows it by this name: {code}"
                break
    if reason:
        raise RenameError(f"`{symbol.name}` is not renamed: {reason}")


def _enums_in_python(system: System) -> Iterator[tuple[Enum, str]]:
    """Enums that reach Python code, which knows their members by name, each with that code.

    They go to operators and to the functions of the plant, or come from them.
    """
    types: list[tuple[Type, str]] = []
    for operator in system.operators:
        passed = (operator.result, *(type_ for _, type_ in operator.parameters))
        types += [(type_, f"operator `{operator.name}`") for type_ in passed]
    bindings = system.plant.bindings if system.plant else ()
    operated = {binding.name for binding in bindings if binding.panel}
    for device in system.devices:
        for element in (*device.x, *device.y):
            name = f"{device.qualified_name}.{element.name}"
            if name not in operated:
                types.append((element.type, f"the plant, by `{name}`"))
    watched = system.task.watch if system.task else ()
    memory = (each for subsystem in system.subsystems for each in subsystem.memory)
    types += [(each.type, "the judge of the task") for each in memory if each.name in watched]
    for type_, code in types:
        yield from ((part, code) for part in nested_types([type_]) if isinstance(part, Enum))


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


def check_unclaimed(index: Index, symbol: Symbol, new: str) -> None:
    """Raise `RenameError` if a variable frame or a part of the system has the new name."""
    if symbol.kind == "frame" and new in _frame_variables(index, symbol):
        raise RenameError(f"`{new}` is taken: it stands for any frame in a type or a signature")
    for file in index.files.values() if symbol.kind in _PARTS else ():
        for other in file.by_route.values():
            is_near = "agent" in (symbol.kind, other.kind) or _agent_of(symbol) == _agent_of(other)
            if other.kind in _PARTS and other.name == new and is_near:
                raise _clash(index, other)


def _clash(index: Index, other: Symbol) -> RenameError:
    line = index.sources.span(other.place).line
    return RenameError(f"`{other.name}` is taken: {other.kind} `{other.name}`, line {line}")


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
    if symbol.kind in _NODES:
        return other.kind in _NODES
    if symbol.kind != other.kind:
        return False
    if symbol.kind in ("element", "field"):
        groups = {end.qualified.rpartition(".")[0] for end in symbol.declarations}
        return other.qualified.rpartition(".")[0] in groups
    return True


# The edits, in every system that has to do with a symbol.


_EXPRESSIONS: tuple[RoleForm, ...] = ("constant", "initial", "full", "formula")


def rename(project: Project, index: Index, symbol: Symbol, new: str) -> list[FileEdit]:
    """The edits that give a symbol another name in every system that has to do with it.

    Raises:
        RenameError: the name cannot be one, is taken, or specc would find other things afterwards.
    """
    check_renameable(index, symbol)
    check_name(symbol, new)
    edits: dict[FileEdit, None] = {}
    counterparts = _everywhere(project, index, symbol)
    _check_understood(counterparts)
    for around, counterpart in counterparts:
        for other in (counterpart, *counterpart.namesakes):
            check_renameable(around, other)
            check_unclaimed(around, other, new)
        edits |= dict.fromkeys(_edits(project, around, counterpart, new))
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
    searched: set[str] = set()
    for around, counterpart in found:
        ends = (*counterpart.declarations, *counterpart.namesakes)
        named = {path for path, _ in around.occurrences_of(ends)}
        if symbol.kind != "variable" and not named <= searched:
            for other in project.indexes(named - searched):
                there = next(filter(None, map(other.counterpart, ends)), None)
                if there is not None and all(other is not known for known, _ in found):
                    found.append((other, there))
        searched |= named
    return found


def _edits(project: Project, index: Index, symbol: Symbol, new: str) -> Iterator[FileEdit]:
    for path, occurrence in index.occurrences_of((*symbol.declarations, *symbol.namesakes)):
        text = index.text(path)
        if project.source(path).text != text:
            raise RenameError("correct the errors in the file first: it is not fully understood")
        for other in index.visible(path, split_at_part(occurrence.place.route)[0]):
            if other.name == new and _same_namespace(symbol, other):
                raise _clash(index, other)
        start, end = occurrence.start, occurrence.end
        if text[start:end] == occurrence.symbol.name:  # `E` names a device in its own way
            yield FileEdit(path, start, end, new)


def _check_understood(counterparts: list[tuple[Index, Symbol]]) -> None:
    """Refuse if a text that has errors, or was never read, may name the symbol."""
    read = {key for index, _ in counterparts for key, m in index.meanings.items() if m.expr}
    for index, symbol in counterparts:
        word = re.compile(rf"\b{re.escape(symbol.name)}\b")
        owners = {end.owner for end in symbol.declarations}
        for source in index.sources:
            for route, _, node in source.nodes:
                role, owner = role_of(route), split_at_part(route)[0]
                is_text = role and role.form in _EXPRESSIONS and (source.path, route) not in read
                is_near = not owner or () in owners or owner in owners
                if is_text and is_near and word.search(node.scalar or ""):
                    words = f"the expression that may refer to this `{symbol.name}`"
                    raise RenameError(f"first correct {words}")


def _check_effect(project: Project, edits: Iterable[FileEdit], new: str) -> None:
    """With the new name specc reports exactly what it reported before."""
    by_path = grouped((edit.path, edit) for edit in edits)
    texts = {path: apply(project.source(path).text, own) for path, own in by_path.items()}
    before, after = project.compare(texts)
    codes_before, codes_after = Counter(d.code for d in before), Counter(d.code for d in after)
    worse = codes_after - codes_before
    for diagnostic in after:
        if diagnostic.code in worse:
            raise RenameError(f"`{new}` would be an error: {diagnostic.message}")
    if codes_before - codes_after:
        raise RenameError(f"`{new}` would change what the specification means")
