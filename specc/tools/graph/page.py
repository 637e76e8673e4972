"""Pictures for a page that lights their parts: SVG in which states, rows and buffers have ids.

Ids begin with a prefix of the caller, so pictures with different ones fit into one page. All parts
have classes, by which a style sheet gives colours: it has precedence over the attributes here. What
stands for one arc (its pieces and a text beside it) has the id of the arc as a class.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from specc.model.system import Subsystem, System
from specc.reachable import grouped
from specc.tools.graph.diagram import Arc, Box, Cluster, Diagram
from specc.tools.graph.dot import NOTE_COLOR, Tag, Tags
from specc.tools.graph.formats import draw
from specc.tools.graph.machine import states
from specc.tools.graph.structure import structure


@dataclass(frozen=True, slots=True)
class MachinePicture:
    """The states of a subsystem, and the ids in its SVG."""

    drawing: TaggedDiagram
    states: Mapping[str, str]
    rows: tuple[str, ...]
    """In the order of the transitions; those that one arc stands for have the same id."""
    modes: Mapping[str, str]

    @property
    def svg(self) -> str:
        """The SVG, drawn now. Raises Refused."""
        return self.drawing.draw()


@dataclass(frozen=True, slots=True)
class StructurePicture:
    """The structure of a system, and the ids in its SVG. Copies of a part have the same id."""

    drawing: TaggedDiagram
    parts: Mapping[str, str]
    """Of subsystems and devices, by qualified names."""
    arcs: Mapping[tuple[str, str], str]
    """Of what is sent, by the qualified names of sender and receiver."""

    @property
    def svg(self) -> str:
        """The SVG, drawn now. Raises Refused."""
        return self.drawing.draw()


def machine_picture(subsystem: Subsystem, prefix: str) -> MachinePicture:
    """The state machine, without the notes on its conditions."""
    diagram = replace(states(subsystem), notes=())
    tagged = TaggedDiagram(diagram, prefix)
    rows = tuple(tagged.arcs[str(number)] for number in range(len(subsystem.transitions)))
    return MachinePicture(tagged, tagged.nodes, rows, tagged.groups)


def structure_picture(system: System, prefix: str) -> StructurePicture:
    """Agents, what is in them, and what they send."""
    tagged = TaggedDiagram(structure(system), prefix)
    ends = {name: tuple(name.split(" -> ")) for name in tagged.arcs}
    arcs = {(tail, head): tagged.arcs[name] for name, (tail, head) in ends.items()}
    return StructurePicture(tagged, tagged.nodes, arcs)


class TaggedDiagram:
    """A diagram, and the ids of its parts by what they cover."""

    def __init__(self, diagram: Diagram, prefix: str) -> None:
        self.nodes: dict[str, str] = {}
        self.arcs: dict[str, str] = {}
        self.groups: dict[str, str] = {}
        self._diagram = diagram
        self._prefix = _id_text(prefix)
        self._ids: set[str] = set()
        arcs = [(arc, self._arc(arc)) for arc in diagram.arcs]
        leaving = grouped((arc.tail, tag.id) for arc, tag in arcs)
        self._beside = {
            box.id: tuple(leaving.get(box.id, ()))
            for box in diagram.all_nodes
            if box.look == "value"
        }
        """A text beside arcs -> their ids; another arc leads to it."""
        self._tags = Tags(
            Tag(self._unique("graph"), ("picture",)),
            {box.id: self._node(box) for box in diagram.all_nodes},
            {group.id: self._group(group) for group in diagram.all_groups},
            tuple(
                replace(tag, classes=(*tag.classes, *self._beside.get(arc.head, ())))
                for arc, tag in arcs
            ),
        )

    def draw(self) -> str:
        """The element `svg`, with nothing behind the picture.

        Graphviz would put names of nodes into comments and titles, where it escapes too little.
        """
        text = draw("svg", self._diagram, self._tags).decode()
        text = re.sub(r"<!--.*?-->\n|<title>.*?</title>\n", "", text[text.index("<svg") :])
        return re.sub(rf'<text ([^>]*) fill="{NOTE_COLOR}">', r'<text class="note" \1>', text)

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
        id = stem = f"{self._prefix}-{_id_text(name)}"
        number = 1
        while id in self._ids:
            number += 1
            id = f"{stem}-{number}"
        self._ids.add(id)
        return id


def _id_text(name: str) -> str:
    """A name in characters of ids that stand for nothing else in DOT, XML or a style sheet."""
    return re.sub(r"[^A-Za-z0-9_.-]", "-", name)
