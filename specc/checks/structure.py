"""Agents with their subsystems and devices (2.1, 2.2)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import listed
from specc.model.system import Agent, Device, Port, Subsystem, System
from specc.source import Place

# The subsystems of an agent have different names; `c` is the control subsystem.


def subsystems_distinct(facts: Facts) -> Iterator[Diagnostic]:
    """E0411."""
    for agent in facts.system.agents:
        first: dict[str, Subsystem] = {}
        for subsystem in agent.subsystems:
            earlier = first.setdefault(subsystem.name, subsystem)
            if earlier is not subsystem:
                yield Diagnostic(
                    "E0411",
                    f"agent `{agent.name}` has two subsystems called `{subsystem.name}`",
                    subsystem.place,
                    related=(Related(earlier.place, "this one has the name already"),),
                    help="choose another name; a real device of that name is listed under `uses:`",
                )


# A real effector belongs to one virtual effector; nothing is commanded from two sides (2.1).


def devices_owned(facts: Facts) -> Iterator[Diagnostic]:
    """E0406, at what makes a subsystem the second owner."""
    for device in facts.system.devices:
        owners = [(wire.subsystem, wire.port) for wire in facts.wires.owners(device)]
        for subsystem, port in owners[1:]:
            first, its_port = owners[0]
            yield Diagnostic(
                "E0406",
                f"`{device.qualified_name}` belongs to `{first.qualified_name}` already",
                _claim(device, subsystem, port),
                f"`{subsystem.qualified_name}` uses it too",
                (Related(its_port.place, "used here"), Related(device.place, "the device")),
                "let one subsystem work with it and pass the data on",
            )


def _claim(device: Device, subsystem: Subsystem, port: Port) -> Place:
    """Where a subsystem says that it works with a device."""
    if subsystem.kind == "control" or subsystem.name == device.name:
        return port.place
    return subsystem.place.below("uses")


# Every real effector and receptor is used by a subsystem.


def devices_used(facts: Facts) -> Iterator[Diagnostic]:
    """O0404; not of an agent with a broken subsystem, or one that claims another's device."""
    unsure = {name.split(".")[0] for name in facts.broken | facts.wires.shared_devices}
    for device in facts.system.devices:
        if not facts.wires.wires_to(device.qualified_name) and device.agent not in unsure:
            kind = "effector" if device.kind == "real_effector" else "receptor"
            yield Diagnostic(
                "O0404",
                f"no subsystem uses the real {kind} `{device.name}`",
                device.place,
                help=_way_out(device, kind, facts.system),
            )


def _way_out(device: Device, kind: str, system: System) -> str:
    """Its own virtual effector or receptor, if there is one, lacks the buffers."""
    names = {subsystem.qualified_name for subsystem in system.subsystems}
    if f"{device.agent}.{device.name}" in names:
        letter = kind[0].upper()
        return f"add `{letter}: {{...}}` under the `x:` and `y:` of `{device.name}`"
    return f"add a virtual {kind} `{device.name}`, or delete the device"


# The kind of an agent is that of its structure, and one of the seven useful ones (2.2).


_MEANING = {
    "C": "a control subsystem",
    "E": "effectors",
    "R": "receptors",
    "T": "connections with other agents",
}


def agent_kind(facts: Facts) -> Iterator[Diagnostic]:
    """E0407 and E0408; an agent with a broken subsystem may have more than is known.

    Whether one is useless is seen once its control subsystem has states.
    """
    for agent in facts.system.agents:
        if _is_unsure(agent, facts):
            continue
        kind = _derived(agent, facts)
        if kind == "C" and not all(subsystem.has_initial_state for subsystem in agent.subsystems):
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
                agent.place.below("kind"),
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
    wires = [wire for s in agent.subsystems if s.name == "c" for wire in facts.wires.wires_of(s)]
    talks = any(
        wire.subsystem.kind == "control" and _agent(wire.peer_name) != wire.subsystem.agent
        for wire in (*wires, *facts.wires.wires_to(own))
    )
    return "C" + "E" * ("effector" in ends) + "R" * ("receptor" in ends) + "T" * talks


def _agent(qualified_name: str) -> str:
    return qualified_name.partition(".")[0]


CHECKS = (
    subsystems_distinct,
    devices_owned,
    devices_used,
    agent_kind,
)
