"""Renaming a symbol everywhere, or saying why that cannot be done safely."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from specc.expr import RESERVED
from specc.lsp.expression_completion import TYPE_WORDS
from specc.lsp.index import Index, Occurrence
from specc.lsp.project import Project
from specc.lsp.structure import Kind, split
from specc.lsp.symbols import Symbol, node_at
from specc.model.units import UNITS

_NAME = re.compile(r"[^\W\d]\w*")
_YAML_WORDS = frozenset({"true", "false", "null"})
_FIXED: dict[Kind, str] = {
    "agent": "agents are part of the names of subsystems; edit the file",
    "subsystem": "the name is that of a device or a peer too; edit the file",
    "device": "the name is that of a virtual effector or receptor too; edit the file",
    "member": "the Python code of operators knows members of enums by their names",
}
_VALUES: frozenset[Kind] = frozenset(
    {"memory", "let", "parameter", "constant", "file", "operator", "member", "variable"}
)
"""Kinds that expressions name plainly: one name of them all."""


class RenameError(Exception):
    """Why a symbol is not renamed, in words for the person who asked."""


@dataclass(frozen=True, slots=True)
class Edit:
    """A stretch of a file, in offsets, that gets another name."""

    path: str
    start: int
    end: int


def check_renameable(index: Index, symbol: Symbol) -> None:
    """Raise `RenameError` if symbols of this kind keep their names."""
    if symbol.kind in _FIXED:
        raise RenameError(f"`{symbol.name}` is not renamed: {_FIXED[symbol.kind]}")
    if symbol.kind == "field":
        type_ = node_at(index.sources.get(symbol.place.file), symbol.place.route[:2])
        if type_ is not None and "python" in type_.values:
            message = f"`{symbol.name}` is not renamed: a class of Python has the field"
            raise RenameError(message)


def rename(project: Project, index: Index, symbol: Symbol, new: str) -> list[Edit]:
    """The edits that give a symbol another name.

    Raises:
        RenameError: the name cannot be one, is taken, or specc would understand less afterwards.
    """
    check_renameable(index, symbol)
    _check_name(symbol, new)
    found = list(index.references(symbol))
    for path, occurrence in found:
        if project.source(path).text != index.text(path):
            raise RenameError("mend the errors in the file first: it is not fully understood")
        if occurrence.reference.guess:
            message = f"mend the expression first that may mean this `{symbol.name}`"
            raise RenameError(message)
        _check_free(index, symbol, path, occurrence, new)
    edits = [Edit(path, o.start, o.end) for path, o in found if _spells(index, path, o)]
    edits = list(dict.fromkeys(edits))
    _check_effect(project, symbol, edits, new)
    return edits


def apply(text: str, edits: Iterable[Edit], new: str) -> str:
    """A text with its stretches replaced."""
    for edit in sorted(edits, key=lambda e: e.start, reverse=True):
        text = text[: edit.start] + new + text[edit.end :]
    return text


def _check_name(symbol: Symbol, new: str) -> None:
    if new == symbol.name:
        raise RenameError("this is the name that it has")
    if not _NAME.fullmatch(new) or not new.isidentifier():
        raise RenameError(f"`{new}` is no name: letters, digits and _ make one")
    if new in RESERVED or new.lower() in _YAML_WORDS or new in ("always", "never"):
        raise RenameError(f"`{new}` is a word of the language")
    if symbol.kind == "type" and new in UNITS:
        raise RenameError(f"`{new}` is a unit")
    if symbol.kind == "type" and new in TYPE_WORDS:
        raise RenameError(f"`{new}` is a word of the language")


def _check_free(index: Index, symbol: Symbol, path: str, occurrence: Occurrence, new: str) -> None:
    """Nothing that can be named where the symbol is named has the new name already."""
    owner, _ = split(occurrence.reference.place.route)
    for other in index.visible(path, owner):
        if other.name == new and _same_namespace(symbol, other):
            line = index.sources.span(other.place).line
            raise RenameError(f"`{new}` is taken: {other.kind} `{new}`, line {line}")


def _same_namespace(symbol: Symbol, other: Symbol) -> bool:
    if symbol.kind in _VALUES:
        return other.kind in _VALUES
    if symbol.kind != other.kind:
        return False
    if symbol.kind in ("element", "field"):
        groups = {end.qualified.rpartition(".")[0] for end in symbol.declarations}
        return other.qualified.rpartition(".")[0] in groups
    return True


def _spells(index: Index, path: str, occurrence: Occurrence) -> bool:
    """Whether the stretch is the name itself: `E` names a device in its own way."""
    text = index.text(path)
    return text[occurrence.start : occurrence.end] == occurrence.symbol.name


def _check_effect(project: Project, symbol: Symbol, edits: list[Edit], new: str) -> None:
    """With the new name the specification means no less than before."""
    texts = {
        path: apply(project.source(path).text, [e for e in edits if e.path == path], new)
        for path in {edit.path for edit in edits}
    }
    before, after = project.compare(symbol.place.file, texts)
    worse = Counter(d.code for d in after) - Counter(d.code for d in before)
    for diagnostic in after:
        if diagnostic.code in worse:
            raise RenameError(f"`{new}` would be an error: {diagnostic.message}")
