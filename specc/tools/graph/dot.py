"""Diagrams in DOT, the language of Graphviz.

Names and texts of specifications get into it in two ways only: as identifiers in quotes, and as
text of HTML-like labels. Both are escaped here, and characters that cannot be seen are written out
first. In labels of the other kind Graphviz would replace escapes such as `\\N`; there are none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html import escape
from typing import Literal

from specc.diagnostics.visible import visible
from specc.tools.graph.diagram import (
    Box,
    Cells,
    Cluster,
    Diagram,
    Face,
    Look,
    Points,
    Stroke,
    TextLine,
)

_FONT = 'fontname="Helvetica"'
NOTE_COLOR = "#666666"
_LOOKS: dict[Look, str] = {
    "subsystem": 'shape=box style="rounded,filled" fillcolor="#eef3fa"',
    "device": 'shape=box style=filled fillcolor="#eeeeee"',
    "other": 'shape=box style="rounded" color="#777777"',
    "missing": 'shape=box style="rounded,dashed" color="#777777"',
    "state": 'shape=box style="rounded,filled" fillcolor="#eef3fa"',
    "start": "shape=circle style=filled fillcolor=black width=0.12 height=0.12 fixedsize=true",
    "frame": 'shape=box style="rounded,filled" fillcolor="#eef3fa"',
    "table": "shape=plain",
    "memory": 'shape=box style=filled fillcolor="#fbf3dc"',
    "input": 'shape=box style=filled fillcolor="#e7f2e7"',
    "output": 'shape=box style=filled fillcolor="#f8e8e4"',
    "operator": 'shape=ellipse style=filled fillcolor=white margin="0.04,0.02"',
    "value": 'shape=plaintext margin="0.04,0.02"',
    "history": "shape=circle style=filled fillcolor=white width=0.24 fixedsize=true",
}
_FRAMES = {
    "agent": 'style=rounded color="#555555" labelloc=b labeljust=l margin=12',
    "mode": 'style="rounded,filled" color="#555555" fillcolor="#f8f8f8" '
    "labelloc=t labeljust=l margin=7",
}
_STROKES: dict[Stroke, str] = {
    "solid": "",
    "dashed": "style=dashed",
    "error": "style=dashed weight=0",
    "none": "style=invis",
}
_POINTS: dict[Points, str] = {"down": "", "up": "dir=back", "both": "dir=both", "none": "dir=none"}
_FACES: dict[Face, tuple[str, str]] = {
    "plain": ("", ""),
    "name": ("<B>", "</B>"),
    "italic": ("<I>", "</I>"),
    "note": (f'<FONT COLOR="{NOTE_COLOR}">', "</FONT>"),
    "lower": ("<SUB>", "</SUB>"),
}


_MANY = 120
"""Arcs that may be bent and placed with all care; of more, that takes nearly all the time."""
_PLAIN = 'BORDER="0" CELLBORDER="0" CELLSPACING="0"'


Ground = Literal["white", "transparent"]


@dataclass(frozen=True, slots=True)
class Tag:
    """The id and the classes of a part in SVG, in characters that need no escape anywhere."""

    id: str
    classes: tuple[str, ...]

    def __str__(self) -> str:
        return f'id="{self.id}" class="{" ".join(self.classes)}"'


@dataclass(frozen=True, slots=True)
class Tags:
    """The tags of all parts of a diagram: nodes and groups by their ids, arcs in their order."""

    ground: Ground
    graph: Tag
    nodes: Mapping[str, Tag]
    groups: Mapping[str, Tag]
    arcs: tuple[Tag, ...]


def as_dot(diagram: Diagram, tags: Tags | None = None) -> str:
    """The text of a diagram; that of equal diagrams is the same, byte for byte."""
    has_modes = any(group.look == "mode" for group in diagram.groups)
    framed = ["         compound=true ranksep=0.2"] if has_modes else []
    many = ["         splines=line nslimit=1 nslimit1=1"] if len(diagram.arcs) > _MANY else []
    notes = f"<{_rows(diagram.notes)}>" if diagram.notes else '""'
    lines = [
        f"digraph {_quoted(diagram.title)} {{",
        f"  graph [charset=utf8 rankdir=TB newrank=true {_FONT} fontsize=10",
        *([f"         {tags.graph} bgcolor={tags.ground}"] if tags else []),
        *many,
        "         nodesep=0.15 ranksep=0.3 labelloc=b labeljust=l",
        *framed,
        f"         label={notes}]",
        f'  node [{_FONT} fontsize=10 height=0.3 width=0.3 margin="0.08,0.05" penwidth=0.8]',
        f"  edge [{_FONT} fontsize=10 arrowsize=0.6 penwidth=0.8]",
    ]
    for group in diagram.groups:
        lines += [f"  {each}" for each in _group(group, tags)]
    lines += [f"  {_node(node, tags)}" for node in diagram.nodes]
    lines += [f"  {{rank=same; {'; '.join(map(_quoted, level))}}}" for level in diagram.levels]
    for number, arc in enumerate(diagram.arcs):
        label = f"label={_spaced(arc.lines, 2)}" if arc.lines else ""
        frames = ("ltail", arc.tail_frame), ("lhead", arc.head_frame)
        ends_at = (f"{key}={_quoted(_frame(name))}" for key, name in frames if name)
        loose = "constraint=false" if arc.is_loose else ""
        tag = str(tags.arcs[number]) if tags else ""
        parts = (_STROKES[arc.stroke], _POINTS[arc.points], label, *ends_at, loose, tag)
        attributes = " ".join(filter(None, parts))
        ends = f"{_quoted(arc.tail)} -> {_quoted(arc.head)}"
        lines.append(f"  {ends} [{attributes}]" if attributes else f"  {ends}")
    return "\n".join([*lines, "}"]) + "\n"


def _group(group: Cluster, tags: Tags | None) -> Iterator[str]:
    """The lines of a group, and of those inside it."""
    yield f"subgraph {_quoted(_frame(group.id))} {{"
    yield f"  graph [{_FRAMES[group.look]}"
    if tags:
        yield f"         {tags.groups[group.id]}"
    yield f"         label={_label(group.lines, 'LEFT')}]"
    yield from (f"  {_node(node, tags)}" for node in group.nodes)
    for inner in group.groups:
        yield from (f"  {each}" for each in _group(inner, tags))
    yield "}"


def _frame(group: str) -> str:
    """What Graphviz calls a group, by which it knows that it has a frame."""
    return f"cluster {group}"


def _node(node: Box, tags: Tags | None) -> str:
    has_subscripts = any(part.style == "lower" for each in node.lines for part in each)
    label = _table(node) if node.rows else (_spaced if has_subscripts else _label)(node.lines)
    tag = f" {tags.nodes[node.id]}" if tags else ""
    return f"{_quoted(node.id)} [{_LOOKS[node.look]} label={label}{tag}]"


def _label(lines: Iterable[TextLine], align: str = "") -> str:
    """Lines below one another."""
    texts = [text for each in lines if (text := _text(each))]
    if not texts:
        return '""'
    end = f'<BR ALIGN="{align}"/>' if align else "<BR/>"
    return f"<{end.join(texts)}{end if align else ''}>"


def _spaced(lines: Iterable[TextLine], padding: int = 0) -> str:
    """Lines that keep away from the subscripts of one another, or from what is around them."""
    rows = "".join(f"<TR><TD>{text}</TD></TR>" for each in lines if (text := _text(each)))
    return f'<<TABLE {_PLAIN} CELLPADDING="{padding}">{rows}</TABLE>>'


def _table(node: Box) -> str:
    """Lines as the head of a table with the rows."""
    heads = "".join(
        f'<TR><TD ALIGN="LEFT">{text}</TD></TR>' for each in node.lines if (text := _text(each))
    )
    rule = "<HR/>" if heads else ""
    body = f"{heads}{rule}<TR><TD>{_rows(node.rows)}</TD></TR>"
    outer = 'BORDER="1" CELLBORDER="0" CELLSPACING="0" CELLPADDING="2" STYLE="ROUNDED"'
    return f"<<TABLE {outer}>{body}</TABLE>>"


def _rows(rows: Iterable[Cells]) -> str:
    """A table whose columns are as wide as what is in them."""
    texts = ("".join(f'<TD ALIGN="LEFT">{_text(cell)}</TD>' for cell in row.cells) for row in rows)
    inner = "".join(f"<TR>{text}</TR>" for text in texts)
    return f'<TABLE ALIGN="LEFT" {_PLAIN} CELLPADDING="2">{inner}</TABLE>'


def _text(parts: TextLine) -> str:
    texts = []
    for part in parts:
        before, after = _FACES[part.style]
        texts.append(f"{before}{escape(visible(part.text))}{after}" if part.text else "")
    return "".join(texts)


def _quoted(name: str) -> str:
    """An identifier in quotes, in which a backslash and a quote mean themselves."""
    shown = visible(name).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{shown}"'
