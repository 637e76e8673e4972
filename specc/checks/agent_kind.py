"""The kind of an agent is that of its structure, and one of the seven useful ones (2.2)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.words import listed
from specc.model.system import Agent, System

_MEANING = {
    "C": "a control subsystem",
    "E": "effectors",
    "R": "receptors",
    "T": "connections with other agents",
}


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0407 and E0408; an agent with a broken subsystem may have more than is known.

    Whether one is useless is seen once its control subsystem has states.
    """
    for agent in system.agents:
        if _is_unsure(agent, facts):
            continue
        kind = _derived(agent, facts)
        if kind == "C" and not all(subsystem.begun for subsystem in agent.subsystems):
            continue
        if kind == "C":
            yield Diagnostic(
                "E0408",
                f"agent `{agent.name}` influences nothing, senses nothing and talks to nobody",
                agent.place,
                "an agent of kind C",
                help="give it effectors, receptors or connections with other agents, or delete it",
            )
        elif agent.kind and agent.kind != kind:
            has = listed((_MEANING[letter] for letter in kind), "and")
            yield Diagnostic(
                "E0407",
                f"agent `{agent.name}` is of kind {kind}, not {agent.kind}",
                below(agent.place, "kind"),
                f"it has {has}",
                help=f"write `kind: {kind}`, or change the structure",
            )


def _is_unsure(agent: Agent, facts: Facts) -> bool:
    """Whether parts are unknown that may add letters: whom it talks to, subsystems left out."""
    known = {subsystem.qualified_name for subsystem in agent.subsystems}
    control = f"{agent.name}.c"
    lost = {n for n in facts.broken if n.startswith(f"{agent.name}.") and n not in known}
    devices = {device.qualified_name for device in agent.devices}
    return control not in known or control in facts.broken or bool(lost - devices)


def _derived(agent: Agent, facts: Facts) -> str:
    """The letters of 2.2 in the order C, E, R, T."""
    kinds: set[str] = {subsystem.kind for subsystem in agent.subsystems}
    kinds |= {device.kind for device in agent.devices}
    ends = {kind.rpartition("_")[2] for kind in kinds}
    own = f"{agent.name}.c"
    ports = [(s, port) for s in agent.subsystems if s.qualified_name == own for port in s.ports]
    talks = any(
        subsystem.kind == "control" and _agent(port.other_end) != subsystem.agent
        for subsystem, port in (*ports, *facts.connections.ends_at(own))
    )
    return "C" + "E" * ("effector" in ends) + "R" * ("receptor" in ends) + "T" * talks


def _agent(qualified_name: str) -> str:
    return qualified_name.partition(".")[0]
