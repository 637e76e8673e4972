"""Which subsystem or device is at the other end of every buffer (2.1)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from specc.model.system import SubsystemKind
from specc.resolve.context import Findings, Where
from specc.schema.files import AgentDef
from specc.schema.subsystem import SubsystemDef


def peers_of_virtual(
    agent: str, name: str, kind: SubsystemKind, definition: SubsystemDef, around: AgentDef
) -> dict[str, str]:
    """Peer -> other end for a virtual effector or receptor: its control subsystem and devices."""
    letter = "E" if kind == "virtual_effector" else "R"
    devices = around.real_effectors if letter == "E" else around.real_receptors
    used = definition.uses if definition.uses is not None else [name]
    own = [device for device in used if device in devices]
    peers = {"c": f"{agent}.c"} | {device: f"{agent}.{letter}.{device}" for device in own}
    if len(own) == 1:
        peers[letter] = f"{agent}.{letter}.{own[0]}"
    return peers


def peers_of_control(agent: str, around: AgentDef, agents: Collection[str]) -> dict[str, str]:
    """Peer -> other end for a control subsystem: own virtual ones, receptors, other agents."""
    peers = {other: f"{other}.c" for other in agents if other != agent}
    receptors = list(around.real_receptors)
    peers |= {name: f"{agent}.R.{name}" for name in receptors}
    if len(receptors) == 1:
        peers["R"] = f"{agent}.R.{receptors[0]}"
    for name in (*around.virtual_effectors, *around.virtual_receptors):
        peers[name] = f"{agent}.{name}"
    return peers


def report_strangers(
    definition: SubsystemDef,
    where: Where,
    kind: SubsystemKind,
    peers: Mapping[str, str],
    around: AgentDef,
    agents: Collection[str],
    findings: Findings,
) -> None:
    """Report buffers whose peer does not exist or may not be talked to."""
    for direction, buffers in (("x", definition.x), ("y", definition.y)):
        for peer in buffers:
            if peer in peers:
                continue
            place = where[direction][peer].key
            rule = _broken_rule(kind, peer, around, agents)
            if rule:
                findings.report("E0401", *rule[:1], place, help=rule[1])
            else:
                findings.unknown("E0218", "peer", peer, peers, place)


def _broken_rule(
    kind: SubsystemKind, peer: str, around: AgentDef, agents: Collection[str]
) -> tuple[str, str] | None:
    """The structure rule that a connection to `peer` would break, and the way out."""
    virtual = {*around.virtual_effectors, *around.virtual_receptors}
    if kind != "control" and peer in virtual:
        return (
            "virtual effectors and receptors never talk to each other",
            "pass the data through the control subsystem",
        )
    if kind != "control" and peer in agents:
        return (
            "agents talk only through their control subsystems",
            f"connect the control subsystem to `{peer}` and pass the data on",
        )
    devices = {*around.real_effectors, *around.real_receptors, "E"}
    if peer in devices and kind == "control" and peer not in around.real_receptors:
        return (
            "a control subsystem does not drive real effectors itself",
            f"let a virtual effector `{peer}` do it",
        )
    if peer in devices and kind != "control":
        return (
            f"`{peer}` is not a device that this subsystem works with",
            "a virtual effector uses real effectors and a virtual receptor real receptors; "
            "name them under `uses:`",
        )
    return None
