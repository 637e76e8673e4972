"""What a picture shows: nodes, groups of nodes and arcs, with their texts; no layout, no format.

Each part names what of the specification it stands for, so that nothing is drawn twice or left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from textwrap import wrap
from typing import Literal

Face = Literal["plain", "name", "italic", "note", "lower"]
"""`note` is grey, `lower` a subscript."""
Look = Literal[
    "subsystem", "device", "other", "missing", "state", "start", "frame", "table", "memory",
    "input", "output", "operator", "value",
]  # fmt: skip
Points = Literal["down", "up", "both"]
"""Where the heads of an arc are: at `head`, at `tail`, at both."""
Stroke = Literal["solid", "dashed", "error", "none"]
"""`error` is dashed and has no say in the layout; `none` is not seen and has nothing but that."""


@dataclass(frozen=True, slots=True)
class TextRun:
    """A piece of a line in one face."""

    text: str
    face: Face = "plain"


TextLine = tuple[TextRun, ...]


@dataclass(frozen=True, slots=True)
class Cells:
    """Cells beside one another."""

    cells: tuple[TextLine, ...]
    covers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Box:
    """A box. `rows` stand below its lines."""

    id: str
    look: Look
    lines: tuple[TextLine, ...]
    rows: tuple[Cells, ...] = ()
    covers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Arc:
    """An arrow between two nodes, of which `tail` stands above `head` where there is a choice."""

    tail: str
    head: str
    lines: tuple[TextLine, ...] = ()
    stroke: Stroke = "solid"
    points: Points = "down"
    covers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Cluster:
    """Nodes inside one frame."""

    id: str
    lines: tuple[TextLine, ...]
    nodes: tuple[Box, ...]


@dataclass(frozen=True, slots=True)
class Diagram:
    """A picture; `levels` are nodes that stand beside one another, `notes` stand below it all."""

    title: str
    nodes: tuple[Box, ...]
    arcs: tuple[Arc, ...]
    groups: tuple[Cluster, ...] = ()
    levels: tuple[tuple[str, ...], ...] = ()
    notes: tuple[Cells, ...] = ()

    @property
    def every_node(self) -> Iterator[Box]:
        """Those of groups too."""
        yield from self.nodes
        for group in self.groups:
            yield from group.nodes


# Texts.


def line(text: str, face: Face = "plain") -> TextLine:
    """A line in one face."""
    return (TextRun(text, face),)


def broken(text: str, columns: int, face: Face = "plain", most: int = 6) -> tuple[TextLine, ...]:
    """A text in lines of so many columns or little more; the end of a long one is cut."""
    lines = wrap(text[: columns * (most + 1)], columns, break_on_hyphens=False)
    if len(lines) > most or len(text) > columns * (most + 1):
        lines = [*lines[: most - 1], f"{lines[most - 1][: columns - 1]}…"] if lines else lines
    return tuple(line(each, face) for each in lines)


def joined(words: Iterable[str], columns: int, face: Face = "plain") -> tuple[TextLine, ...]:
    """Words with commas between them, in lines; none is left out."""
    lines: list[str] = []
    for word in words:
        if lines and len(lines[-1]) + len(word) + 2 <= columns:
            lines[-1] += f", {word}"
        else:
            if lines:
                lines[-1] += ","
            lines.append(word)
    return tuple(line(each, face) for each in lines)


def equations(numbers: tuple[int, ...]) -> TextLine:
    """Numbers of equations as papers set them beside a formula: ` (4)`; or nothing."""
    return (TextRun(f" ({', '.join(map(str, numbers))})", "note"),) if numbers else ()
