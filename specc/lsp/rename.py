"""Renaming a symbol everywhere, or saying why that cannot be done safely."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.lsp.index import Index, Occurrence
from specc.lsp.names import (
    RenameError,
    check_free,
    check_name,
    check_renameable,
    check_unclaimed,
)
from specc.lsp.project import Project
from specc.lsp.symbols import Symbol

__all__ = ["Edit", "RenameError", "apply", "check_renameable", "rename"]

_SPELLED_APART = frozenset(("member", "field", "agent", "subsystem", "device"))
"""Kinds that a text which could not be typed may name without anybody knowing."""


@dataclass(frozen=True, slots=True)
class Edit:
    """A stretch of a file, in offsets, that gets another name."""

    path: str
    start: int
    end: int


def rename(project: Project, index: Index, symbol: Symbol, new: str) -> list[Edit]:
    """The edits that give a symbol another name in every system that has to do with it.

    Raises:
        RenameError: the name cannot be one, is taken, or specc would find other things afterwards.
    """
    check_renameable(index, symbol)
    check_name(symbol, new)
    edits: dict[Edit, None] = {}
    for around, twin in _everywhere(project, index, symbol):
        for other in (twin, *twin.tied):
            check_renameable(around, other)
            check_unclaimed(around, other, new)
        edits |= dict.fromkeys(_edits(project, around, twin, new))
    _check_effect(project, edits, new)
    return list(edits)


def apply(text: str, edits: Iterable[Edit], new: str) -> str:
    """A text with its stretches replaced."""
    for edit in sorted(edits, key=lambda e: e.start, reverse=True):
        text = text[: edit.start] + new + text[edit.end :]
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
                ends = (other.twin(end) for end in (*twin.declarations, *twin.tied))
                counterpart = next((end for end in ends if end is not None), None)
                if counterpart is not None and all(other is not known for known, _ in found):
                    found.append((other, counterpart))
        seen |= named
    return found


def _edits(project: Project, index: Index, symbol: Symbol, new: str) -> Iterator[Edit]:
    symbols = (*symbol.declarations, *symbol.tied)
    _check_typed(index, symbol)
    for path, occurrence in index.naming(symbols):
        if project.source(path).text != index.text(path):
            raise RenameError("mend the errors in the file first: it is not fully understood")
        if occurrence.reference.guess:
            raise RenameError(_mend_first(symbol))
        check_free(index, symbol, path, occurrence, new)
        if _spells(index, path, occurrence):
            yield Edit(path, occurrence.start, occurrence.end)


def _check_typed(index: Index, symbol: Symbol) -> None:
    """Texts with errors may name what only their meaning tells."""
    if symbol.kind not in _SPELLED_APART:
        return
    word = re.compile(rf"\b{re.escape(symbol.name)}\b")
    for meaning in index.meanings.values():
        if meaning.expr is None and word.search(meaning.text):
            raise RenameError(_mend_first(symbol))


def _mend_first(symbol: Symbol) -> str:
    return f"mend the expression first that may mean this `{symbol.name}`"


def _spells(index: Index, path: str, occurrence: Occurrence) -> bool:
    """Whether the stretch is the name itself: `E` names a device in its own way."""
    text = index.text(path)
    return text[occurrence.start : occurrence.end] == occurrence.symbol.name


def _check_effect(project: Project, edits: Iterable[Edit], new: str) -> None:
    """With the new name specc finds what it found before, no more and no less."""
    texts = {
        path: apply(project.source(path).text, [e for e in edits if e.path == path], new)
        for path in {edit.path for edit in edits}
    }
    before, after = project.compare(texts)
    worse = Counter(d.code for d in after) - Counter(d.code for d in before)
    for diagnostic in after:
        if diagnostic.code in worse:
            raise RenameError(f"`{new}` would be an error: {diagnostic.message}")
    if Counter(d.code for d in before) - Counter(d.code for d in after):
        raise RenameError(f"`{new}` would change what the specification means")
