"""Ids and classes of the parts of a picture in SVG.

Style sheets give colours by class: they have precedence over the attributes of pictures. What
stands for one arc (its pieces and a text beside it) has the id of the arc as a class.
"""

from __future__ import annotations

import re
from dataclasses import replace

from specc.reachable import grouped
from specc.tools.graph.diagram import Arc, Box, Cluster, Diagram
from specc.tools.graph.dot import Ground, Tag, Tags


class TaggedDiagram:
    """A diagram, and the ids of its parts by what they cover."""

    def __init__(self, diagram: Diagram, prefix: str, ground: Ground = "white") -> None:
        self.diagram = diagram
        self.nodes: dict[str, str] = {}
        self.arcs: dict[str, str] = {}
        self.groups: dict[str, str] = {}
        self._prefix = f"{_id_text(prefix)}-" if prefix else ""
        self._ids: set[str] = set()
        arcs = [(arc, self._arc(arc)) for arc in diagram.arcs]
        leaving = grouped((arc.tail, tag.id) for arc, tag in arcs)
        self._beside = {
            box.id: tuple(leaving.get(box.id, ()))
            for box in diagram.all_nodes
            if box.look == "value"
        }
        """A text beside arcs -> their ids; another arc leads to it."""
        self.tags = Tags(
            ground,
            Tag(self._unique("graph"), ("picture",)),
            {box.id: self._node(box) for box in diagram.all_nodes},
            {group.id: self._group(group) for group in diagram.all_groups},
            tuple(
                replace(tag, classes=(*tag.classes, *self._beside.get(arc.head, ())))
                for arc, tag in arcs
            ),
        )

    def _arc(self, arc: Arc) -> Tag:
        ends = (arc.head, arc.tail) if arc.points == "up" else (arc.tail, arc.head)
        if not arc.covers:
            return Tag(self._unique(f"x-{'-'.join(ends)}"), (arc.stroke,))
        kind = "row" if arc.covers[0].isdecimal() else "arc"
        name = f"r-{arc.covers[0]}" if kind == "row" else f"a-{'-'.join(ends)}"
        id = self._unique(name)
        self.arcs |= dict.fromkeys(arc.covers, id)
        return Tag(id, (kind, arc.stroke, id))

    def _node(self, box: Box) -> Tag:
        kind = "s" if box.look == "state" else "n" if box.covers else "x"
        id = self._unique(f"{kind}-{box.id}")
        self.nodes |= dict.fromkeys(box.covers, id)
        return Tag(id, (box.look, *self._beside.get(box.id, ())))

    def _group(self, group: Cluster) -> Tag:
        id = self._unique(f"{'m' if group.look == 'mode' else 'g'}-{group.id}")
        self.groups[group.id] = id
        return Tag(id, (group.look,))

    def _unique(self, name: str) -> str:
        """An id for a name; of names that differ in other characters only, later ones get more."""
        id = stem = f"{self._prefix}{_id_text(name)}"
        number = 1
        while id in self._ids:
            number += 1
            id = f"{stem}-{number}"
        self._ids.add(id)
        return id


def _id_text(name: str) -> str:
    """A name in characters of ids that stand for nothing else in DOT, XML or a style sheet."""
    return re.sub(r"[^A-Za-z0-9_.-]", "-", name)
