"""What a picture shows: nodes, groups of nodes and arcs, with their texts; no layout, no format."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from textwrap import wrap
from typing import Literal, TypeVar

from specc.model.fsm import Condition, Function
from specc.model.system import Agent, Device, Subsystem, System
from specc.reachable import grouped

# What a picture shows: nodes, groups of nodes and arcs, with their texts; no layout, no format.


Face = Literal["plain", "name", "italic", "note", "lower"]
"""`note` is grey, `lower` a subscript."""
Look = Literal[
    "subsystem", "device", "other", "missing", "state", "start", "frame", "table", "memory",
    "input", "output", "operator", "value", "history",
]  # fmt: skip
Points = Literal["down", "up", "both", "none"]
"""Where the heads of an arc are: at `head`, at `tail`, at both, nowhere."""
Stroke = Literal["solid", "dashed", "error", "none"]
"""`error` is dashed and has no say in the layout; `none` is not seen and has nothing but that."""


@dataclass(frozen=True, slots=True)
class TextRun:
    """A piece of a line in one face."""

    text: str
    style: Face = "plain"


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
    """An arrow between two nodes, of which `tail` stands above `head` where there is a choice.

    One that has a `tail_frame` or `head_frame` begins or ends at that frame around the node. One
    that `is_loose` has no say in where its ends stand.
    """

    tail: str
    head: str
    lines: tuple[TextLine, ...] = ()
    stroke: Stroke = "solid"
    points: Points = "down"
    covers: tuple[str, ...] = ()
    tail_frame: str = ""
    head_frame: str = ""
    is_loose: bool = False


@dataclass(frozen=True, slots=True)
class Cluster:
    """Nodes and other groups inside one frame."""

    id: str
    lines: tuple[TextLine, ...]
    nodes: tuple[Box, ...]
    groups: tuple[Cluster, ...] = ()
    look: Literal["agent", "mode"] = "agent"

    @property
    def all_nodes(self) -> Iterator[Box]:
        """All nodes, including those in groups inside."""
        yield from self.nodes
        for group in self.groups:
            yield from group.all_nodes

    @property
    def all_groups(self) -> Iterator[Cluster]:
        """This group and those inside."""
        yield self
        for group in self.groups:
            yield from group.all_groups


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
    def all_nodes(self) -> Iterator[Box]:
        """All nodes, including those in groups."""
        yield from self.nodes
        for group in self.groups:
            yield from group.all_nodes

    @property
    def all_groups(self) -> Iterator[Cluster]:
        """All groups, including those in others."""
        for group in self.groups:
            yield from group.all_groups


# Texts.


def line(text: str, face: Face = "plain") -> TextLine:
    """A line in one face."""
    return (TextRun(text, face),)


def wrap_lines(
    text: str, columns: int, face: Face = "plain", most: int = 6
) -> tuple[TextLine, ...]:
    """A text in lines of so many columns or little more; the end of a long one is cut."""
    lines = wrap(text[: columns * (most + 1)], columns, break_on_hyphens=False)
    if len(lines) > most or len(text) > columns * (most + 1):
        lines = [*lines[: most - 1], f"{lines[most - 1][: columns - 1]}…"] if lines else lines
    return tuple(line(each, face) for each in lines)


def comma_lines(words: Iterable[str], columns: int, face: Face = "plain") -> tuple[TextLine, ...]:
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


# What parts of a specification are called in pictures, and copies that are drawn as one.


_LETTERS = {
    "control": "c",
    "virtual_effector": "e",
    "virtual_receptor": "r",
    "real_effector": "E",
    "real_receptor": "R",
}
_Named = TypeVar("_Named", Agent, Subsystem, Device)


def symbol(part: Subsystem | Device, agent: str = "") -> TextLine:
    """The paper's symbol, with the agent and the name as its index."""
    index = (agent or part.agent, *(() if part.name == "c" else (part.name,)))
    return TextRun(_LETTERS[part.kind], "italic"), TextRun(",".join(index), "lower")


def is_named(part: Condition | Function) -> bool:
    """Whether a part has a name of its own; what stands in place is called after its place."""
    if isinstance(part, Function) and part.generic:
        return True
    return "." not in part.name and "[" not in part.name


def rate(hz: Fraction) -> str:
    """A rate in Hz."""
    return f"{float(hz):.6g} Hz"


def span(names: Sequence[str]) -> str:
    """A name, or the first and the last of several copies."""
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"


@dataclass(frozen=True, slots=True)
class AgentFamily:
    """Agents instantiated by one `for`, or a single agent."""

    agents: tuple[Agent, ...]

    @property
    def name(self) -> str:
        return span([agent.name for agent in self.agents])

    @property
    def is_single(self) -> bool:
        """Whether each agent is nothing but a control subsystem."""
        return all(len(agent.subsystems) == 1 and not agent.devices for agent in self.agents)

    def parts(self) -> list[list[Subsystem] | list[Device]]:
        """Subsystems and devices, each with its copies in all agents, in the order of the file."""
        subsystems = _copies([s for agent in self.agents for s in agent.subsystems])
        return [*subsystems, *_copies([d for agent in self.agents for d in agent.devices])]


def agent_families(system: System) -> list[AgentFamily]:
    return [AgentFamily(tuple(agents)) for agents in _copies(system.agents)]


def _copies(parts: Sequence[_Named]) -> list[list[_Named]]:
    """Parts that one place of a file describes, together; those of one agent differ by a `for`."""
    return list(grouped(((part.place.file, part.place.route), part) for part in parts).values())
