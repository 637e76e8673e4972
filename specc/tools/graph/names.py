"""What parts of a specification are called in pictures, and copies that are drawn as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

from specc.model.fsm import Condition, Function
from specc.model.system import Agent, Device, Subsystem, System
from specc.reachable import grouped
from specc.tools.graph.diagram import TextLine, TextRun

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
    return "." not in part.name and "[" not in part.name


def rate(hz: Fraction) -> str:
    """A rate in Hz."""
    return f"{float(hz):.6g} Hz"


def span(names: Sequence[str]) -> str:
    """A name, or the first and the last of several copies."""
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"


@dataclass(frozen=True, slots=True)
class AgentFamily:
    """Agents that one `for` makes of one description; of others, just the one."""

    agents: tuple[Agent, ...]

    @property
    def name(self) -> str:
        """That of the agent, or those of the first and the last one."""
        return span([agent.name for agent in self.agents])

    def subsystems(self) -> list[list[Subsystem]]:
        """Each with its copies in all agents, in the order of the file."""
        return _by_place([s for agent in self.agents for s in agent.subsystems])

    def devices(self) -> list[list[Device]]:
        """Likewise."""
        return _by_place([d for agent in self.agents for d in agent.devices])


def copies(system: System) -> list[AgentFamily]:
    """The agents of a system; those that one `for` makes are together."""
    return [AgentFamily(tuple(agents)) for agents in _by_place(system.agents)]


def _by_place(parts: Sequence[_Named]) -> list[list[_Named]]:
    """Parts together that one place of a file describes; those of one agent differ by a `for`."""
    return list(grouped(((part.place.file, part.place.route), part) for part in parts).values())
