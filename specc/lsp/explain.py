"""What a hover says where no symbol stands: causes in rows, codes in comments."""

from __future__ import annotations

import re

from specc.diagnostics.code import all_codes
from specc.lsp.index import Index
from specc.lsp.structure import split
from specc.lsp.symbols import values
from specc.source import Node, Route

_CODE = re.compile(r"\b[EWO]\d{4}\b")


def code_at(text: str, offset: int) -> tuple[str, int, int] | None:
    """The title of the code at an offset of a text that is no value, and where it stands."""
    start = max(text.rfind("\n", 0, offset), text.rfind("\r", 0, offset)) + 1
    for found in _CODE.finditer(text, start, offset + 5):
        entry = all_codes().get(found.group())
        if entry is not None and found.start() <= offset <= found.end():
            words = f"**{entry.id}**: {entry.title}\n\n`specc explain {entry.id}` says more."
            return words, *found.span()
    return None


def cause_at(index: Index, path: str, offset: int) -> tuple[str, int, int] | None:
    """What ends the behaviour of the state of a row by the cause at an offset."""
    source = index.sources.get(path)
    top = source.spans if source else None
    for route, _, node in values(top) if top else ():
        if node.start <= offset <= node.end and node.scalar in ("terminal", "error"):
            words = _ending(top, route, node.scalar)
            if words:
                return words, node.start, node.end
    return None


def _ending(top: Node | None, route: Route, cause: str) -> str:
    owner, rest = split(route)
    if len(rest) != 3 or rest[0] != "transitions" or rest[2] not in (1, "cause") or top is None:
        return ""
    subsystem = top
    for step in owner:
        subsystem = subsystem.values[step]
    row = subsystem.values["transitions"].values[rest[1]]
    state = row.values.get("from") or row.values.get(0)
    states, behaviours = subsystem.values.get("states"), subsystem.values.get("behaviours")
    chosen = states.values.get(state.scalar or "") if states and state else None
    name = (chosen.scalar or _scalar(chosen, "behaviour")) if chosen else ""
    behaviour = behaviours.values.get(name) if behaviours else None
    if behaviour is None or state is None:
        return ""
    condition = _scalar(behaviour, cause) or "never"
    return (
        f"behaviour `{name}` of state `{state.scalar}` has ended by its {cause} condition "
        f"`{condition}`"
    )


def _scalar(node: Node, key: str) -> str:
    below = node.values.get(key)
    return (below.scalar or "") if below else ""
