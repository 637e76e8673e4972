"""Pictures for a page that lights their parts: SVG in which states, rows and buffers have ids.

Ids begin with a prefix of the caller, so pictures with different ones fit into one page. What is
behind a picture shows through.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from specc.model.system import Subsystem, System
from specc.tools.graph.formats import draw_svg
from specc.tools.graph.machine import states
from specc.tools.graph.structure import structure
from specc.tools.graph.tags import TaggedDiagram


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
        return draw_svg(self.drawing)


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
        return draw_svg(self.drawing)


def machine_picture(subsystem: Subsystem, prefix: str) -> MachinePicture:
    """The state machine, without the notes on its conditions."""
    diagram = replace(states(subsystem), notes=())
    tagged = TaggedDiagram(diagram, prefix, ground="transparent")
    rows = tuple(tagged.arcs[str(number)] for number in range(len(subsystem.transitions)))
    return MachinePicture(tagged, tagged.nodes, rows, tagged.groups)


def structure_picture(system: System, prefix: str) -> StructurePicture:
    """Agents, what is in them, and what they send."""
    tagged = TaggedDiagram(structure(system), prefix, ground="transparent")
    ends = {name: tuple(name.split(" -> ")) for name in tagged.arcs}
    arcs = {(tail, head): tagged.arcs[name] for name, (tail, head) in ends.items()}
    return StructurePicture(tagged, tagged.nodes, arcs)
