"""Hovers and the outline of a file."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial

from specc.analysis.plant import widget_text
from specc.diagnostics.code import all_codes
from specc.diagnostics.phrases import join_some, truncate
from specc.lang import show
from specc.lang.kinds import kind
from specc.model.expr import Expr, Number
from specc.model.fsm import Cause, Condition, State, Trace
from specc.model.types import Type
from specc.resolve.context import Meaning
from specc.schema.keys import SymbolKind
from specc.schema.places import keys_at, split_at_part
from specc.source import Place, Route, TextNode
from specc.tools.lsp.index import Index, Symbol

# What a hover says of a symbol and of a part of an expression; the text is Markdown.


_LONGEST = 160


def describe_symbol(index: Index, symbol: Symbol, type_: Type | None = None) -> str:
    """Kind, name, type, title, equation and what the symbol stands for."""
    node = index.node(symbol.place.file, symbol.place.route)
    shown = type_ or symbol.type
    head = f"**{symbol.kind}** `{symbol.name}{_typed(symbol, node, shown)}`"
    title, trace = title_of(symbol, node), trace_of(node)
    sentence = f"{title} ({trace})" if title and trace else title or trace
    body = [f"`{_short(line)}`" for line in _definition(symbol, node)]
    panel = [f"on the operator's panel: {widget_text(symbol.panel)}"] if symbol.panel else []
    facts = [*_ends(symbol), *panel, *type_words(shown, _frames(index))]
    paragraphs = [head, sentence, "  \n".join(body), "  \n".join(facts)]
    return "\n\n".join(filter(None, paragraphs))


def describe_part(index: Index, meaning: Meaning, part: Expr) -> str:
    """Text, type, unit and frames of a part of an expression, and what it is part of."""
    text = " ".join(meaning.text[part.span[0] : part.span[1]].split())
    value = f" = {part.value:g}" if isinstance(part, Number) else ""
    head = f"`{_short(text)}`: `{part.type}`{value}"
    facts = "  \n".join(type_words(part.type, _frames(index)))
    return "\n\n".join(filter(None, [head, facts, _enclosing(index, meaning)]))


def title_of(symbol: Symbol, node: TextNode | None) -> str:
    """The words that the specification has for a symbol."""
    if node is None:
        return ""
    if symbol.kind == "frame":
        return node.scalar or ""
    title = node.values.get("title")
    return title.scalar or "" if title else ""


def trace_of(node: TextNode | None) -> str:
    """`eq. 5`, `Table 3`, as far as the specification says it."""

    def numbers(key: str) -> tuple[int, ...]:
        found = node.values.get(key) if node else None
        items = [found] if found and found.scalar else [*found.values.values()] if found else []
        return tuple(int(each.scalar) for each in items if each.scalar and each.scalar.isdecimal())

    return str(Trace(*map(numbers, ("eq", "table", "fig"))))


def type_words(type_: Type | None, frames: Mapping[str, str]) -> list[str]:
    """A type in words: unit, axes, which pose in which frame."""

    def named(frame: str) -> str:
        name = frame.lstrip("?")
        return f"{name} ({frames[name]})" if frames.get(name) else name

    return (
        kind(type_).descriptions(type_, named, partial(type_words, frames=frames)) if type_ else []
    )


def owner_name(owner: Route, file: str) -> str:
    """`irp.m` for the subsystem at a route; the name of the file if it is described there."""
    if len(owner) < 3:
        return os.path.basename(file)
    agent = str(owner[1]) if owner[0] == "agents" else os.path.basename(file)
    if owner[-1] == "control":
        return f"{agent}.c"
    letter = {"real_effectors": "E.", "real_receptors": "R."}.get(str(owner[-2]), "")
    return f"{agent}.{letter}{owner[-1]}"


def _typed(symbol: Symbol, node: TextNode | None, type_: Type | None) -> str:
    declared = node.values.get("type") if node else None
    text = declared.scalar if declared else ""
    if node is not None and node.scalar and symbol.kind in ("element", "field", "parameter"):
        text = node.scalar
    if text and type_ is not None and str(type_) != text:
        return f": {text} = {type_}"
    return f": {text or type_}" if text or type_ else ""


def _definition(symbol: Symbol, node: TextNode | None) -> Iterator[str]:
    """The lines of the definition that matter."""
    if node is None:
        return
    match symbol.kind:
        case "let" | "constant" | "type" | "file" | "operator":
            keys: tuple[str, ...] = ("is", "type", "signature", "python", "range", "live")
        case "memory" | "element":
            keys = ("init",)
        case "initial condition" | "terminal condition" | "error condition":
            keys = ("when",)
        case "behaviour":
            keys = ("signature", "functions", "terminal", "error")
        case "function" | "interface":
            keys = tuple(str(key) for key in node.values if key not in ("title", "eq", "fig"))
        case "mode":
            keys = ("states", "initial")
        case "state":
            keys = ("behaviour", "functions", "terminal", "error")
        case _:
            return
    if node.scalar is not None:
        yield node.scalar
    for key in keys:
        if key in node.values:
            label = "" if key in ("is", "when", "type", "signature") else f"{key}: "
            yield label + _written(node.values[key])


def _written(node: TextNode) -> str:
    if node.scalar is not None:
        return node.scalar
    inner = node.values.get("is") or node.values.get("type")
    return _written(inner) if inner else ", ".join(map(_written, node.values.values()))


def _ends(symbol: Symbol) -> list[str]:
    """Who sends an element to whom: subsystems and devices send what is in their y."""
    ends: dict[str, list[str]] = {"y": [], "x": []}
    elements = (end for end in symbol.ends if end.kind == "element")
    for end in (end for end in elements if end.owner):  # others stand in an interface
        ends[end.qualified[0]].append(owner_name(end.owner, end.place.file))
    if not (ends["x"] and ends["y"]):
        return []
    return [f"from {', '.join(ends['y'])} to {', '.join(ends['x'])}"]


def _enclosing(index: Index, meaning: Meaning) -> str:
    """The symbol whose definition an expression is part of."""
    route = meaning.where.route
    file = index.files.get(meaning.where.file)
    for size in range(len(route), 0, -1):
        symbol = file.by_route.get(route[:size]) if file else None
        if symbol is not None:
            node = index.node(meaning.where.file, route[:size])
            inner = index.node(meaning.where.file, route[: size + 1])
            trace = trace_of(inner) or trace_of(node)
            return f"in {symbol.kind} `{symbol.name}`" + (f", {trace}" if trace else "")
    return ""


def _frames(index: Index) -> dict[str, str]:
    return dict(index.system.frames) if index.system else {}


def _short(text: str) -> str:
    return truncate(" ".join(text.split()), _LONGEST)


# Hovers where no symbol stands: keys, causes in rows, codes in comments.


_CODE = re.compile(r"\b[EWO]\d{4}\b")


def code_at(text: str, offset: int) -> tuple[str, int, int] | None:
    """The title of the code at an offset outside of all values, and where it stands."""
    start = max(text.rfind("\n", 0, offset), text.rfind("\r", 0, offset)) + 1
    for found in _CODE.finditer(text, start, offset + 5):
        entry = all_codes().get(found.group())
        if entry is not None and found.start() <= offset <= found.end():
            words = f"**{entry.id}**: {entry.title}\n\n`specc explain {entry.id}` says more."
            return words, *found.span()
    return None


def describe_key(route: Route) -> str:
    """What the schema says of a key; empty if it says nothing."""
    words = keys_at(route[:-1]).get(str(route[-1]), "")
    return f"**{route[-1]}**: {words}" if words else ""


def describe_cause(index: Index, path: str, route: Route, node: TextNode) -> str:
    """The conditions that a cause of a row stands for; empty if the value is no cause."""
    _, rest = split_at_part(route)
    is_cause = len(rest) == 3 and rest[0] == "transitions" and rest[2] in (1, "cause")
    if not is_cause or index.system is None:
        return ""
    found: dict[str, dict[str, State]] = {}
    for subsystem in index.system.subsystems:
        for row in subsystem.transitions:
            if (row.place.file, row.place.route) == (path, route[:-1]):
                state = subsystem.state(row.source)
                ending = dict(state.behaviour.endings).get(row.cause)
                found.setdefault(_ending_words(row.cause, ending), {})[state.name] = state
    return "  \n".join(_ended(list(own.values()), words) for words, own in found.items())


_MOST_STATES = 4


def _ending_words(cause: Cause, ending: Condition | None) -> str:
    """A condition that ends a state, with what it says if that stands elsewhere."""
    if ending is None:
        return "error condition `never`"
    name = cause if cause not in ("terminal", "error") else ending.name
    says = "" if name in ("always", "never") else f": `{_short(show(ending.when))}`"
    return f"{ending.kind} condition `{name}`{says}"


def _ended(states: list[State], words: str) -> str:
    names = [f"`{state.name}`" for state in states]
    if len(names) > 1:
        return f"one of {join_some(names, _MOST_STATES)} has ended by its {words}"
    return f"behaviour `{states[0].behaviour.name}` of state {names[0]} has ended by its {words}"


# The outline of a file.


@dataclass(eq=False, slots=True)
class OutlineEntry:
    """A definition: the range of all of it and, `name_start` to `name_end`, of its name."""

    kind: SymbolKind
    name: str
    title: str
    start: int
    end: int
    name_start: int
    name_end: int
    children: list[OutlineEntry] = field(default_factory=list)


def outline_of(index: Index, path: str, moved: Callable[[int], int | None]) -> list[OutlineEntry]:
    """The definitions of a file, nested; `moved` gives offsets in the present text."""
    file = index.files.get(path)
    top: list[OutlineEntry] = []
    known: dict[Route, OutlineEntry] = {}
    for route, symbol in file.by_route.items() if file else ():
        node = index.node(path, route)
        if node is None:
            continue
        name = index.offsets(Place(path, route, "key"))
        offsets = [moved(at) for at in (name[0], max(name[1], node.end), *name)]
        if None in offsets:
            continue
        shown = "control" if route[-1] == "control" else symbol.qualified or symbol.name
        shown = symbol.name if symbol.kind == "field" else shown
        start, end, name_start, name_end = (at or 0 for at in offsets)
        title = title_of(symbol, node)
        entry = OutlineEntry(symbol.kind, shown, title, start, end, name_start, name_end)
        above = (route[:size] for size in range(len(route) - 1, 0, -1))
        outer = next((known[step] for step in above if step in known), None)
        (outer.children if outer else top).append(entry)
        known[route] = entry
    return top
