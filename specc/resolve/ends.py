"""Both ends of buffers, and what is mentioned but not there."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping

from specc.frozen import frozen
from specc.model.system import Definition, SubsystemKind
from specc.resolve.context import Findings, Where
from specc.resolve.library import Loaded
from specc.schema import SubsystemDef
from specc.schema.files import AgentDef, SpecFile, TypeDef
from specc.schema.subsystem import BufferDef, InterfaceDef
from specc.source import Place

# Which types and interfaces the definitions and agents of the main file name in their texts.
#
# Frames are left out: section 3 of the paper has them described before anything is given in them.


_WORD = re.compile(r"[A-Za-z_]\w*")


def definitions_of(file: Loaded) -> tuple[Definition, ...]:
    """The definitions in a file, in its order, with the types that each one names."""
    spec, top = file.spec, file.top
    groups: tuple[tuple[str, dict[str, Iterable[str]]], ...] = (
        ("type", {name: _of_type(item) for name, item in spec.types.items()}),
        ("interface", {name: _of_interface(item) for name, item in spec.interfaces.items()}),
        ("file", dict.fromkeys(spec.files, ())),
        ("constant", dict.fromkeys(spec.constants, ())),
        ("operator", {n: _words(o.signature) for n, o in spec.operators.items()}),
    )
    return tuple(
        Definition(kind, name, top[f"{kind}s"][name].key, _labels(words, spec))
        for kind, members in groups
        for name, words in members.items()
    )


def named_in_agents(spec: SpecFile) -> frozenset[str]:
    """The types and interfaces that buffers, memory and requirements name, e.g. `type Mode`.

    And the constants of arguments: descriptions get their values, without their names.
    """
    texts = [text for agent in spec.agents.values() for text in _of_agent(agent)]
    texts += [item.type for item in spec.plant.observe.values()] if spec.plant else []
    arguments = (text for agent in spec.agents.values() for text in agent.arguments.values())
    given = {word for text in arguments for word in _words(text)}
    constants = {f"constant {name}" for name in spec.constants.keys() & given}
    return _labels((word for text in texts for word in _words(text)), spec) | constants


def _labels(words: Iterable[str], spec: SpecFile) -> frozenset[str]:
    found = set(words)
    known = {"type": spec.types.keys(), "interface": spec.interfaces.keys()}
    return frozenset(f"{kind} {n}" for kind, names in known.items() for n in names & found)


def _of_type(definition: TypeDef) -> set[str]:
    texts = [definition.type or "", *(definition.fields or {}).values()]
    return {word for text in texts for word in _words(text)}


def _of_interface(definition: InterfaceDef) -> set[str]:
    return {word for item in definition.elements.values() for word in _words(item.type)}


def _of_agent(agent: AgentDef) -> Iterator[str]:
    devices = (*agent.real_effectors.values(), *agent.real_receptors.values())
    for device in devices:
        yield from (text for side in (device.x, device.y) for text in _of_buffer(side))
    virtual = (*agent.virtual_effectors.values(), *agent.virtual_receptors.values())
    for subsystem in (agent.control, *virtual):
        if subsystem is not None:
            yield from _of_subsystem(subsystem)


def _of_subsystem(subsystem: SubsystemDef) -> Iterator[str]:
    yield from (item.type for item in subsystem.memory.values())
    for buffers in (subsystem.x, subsystem.y):
        yield from (text for buffer in buffers.values() for text in _of_buffer(buffer))


def _of_buffer(buffer: BufferDef) -> Iterator[str]:
    yield buffer.interface or ""
    yield from (item.type for item in buffer.elements.values())


def _words(text: str) -> list[str]:
    return _WORD.findall(text)


# Which subsystem or device is at the other end of every buffer (2.1).


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
    peers |= {name: f"{agent}.R.{name}" for name in receptors if _is_configured(name, around)}
    if len(receptors) == 1:
        peers["R"] = f"{agent}.R.{receptors[0]}"
    for name in (*around.virtual_effectors, *around.virtual_receptors):
        peers[name] = f"{agent}.{name}"
    return peers


@frozen
class Neighbours:
    """Who may be at the other ends of the buffers of a subsystem: `around` it is its agent."""

    name: str
    kind: SubsystemKind
    around: AgentDef
    agents: Collection[str]
    findings: Findings
    at: Where
    """The subsystem in its agent."""

    def missing_devices(self, definition: SubsystemDef, where: Where) -> list[str]:
        """Devices that a subsystem uses and that are not there or not for it, after reporting."""
        own, others = self.around.real_effectors, self.around.real_receptors
        word, other = "effector", "receptor"
        if self.kind == "virtual_receptor":
            own, others, word, other = others, own, other, word
        found: list[str] = []
        if self.kind == "control" and definition.uses is not None:
            message = "a control subsystem does not work with devices itself"
            hint = "name them under `uses:` of a virtual effector or receptor"
            self.findings.report("E0401", message, where["uses"].key, help=hint)
            return found
        for index, name in enumerate(definition.uses or ()):
            place = where["uses"][index].place
            if name in own:
                beside = "receptors" if word == "receptor" else "effectors"
                route = *self.at.route[:-2], f"real_{beside}", name
                self.findings.use(Place(self.at.file, route, "key"), where, "uses", index)
                continue
            if name in others:
                message = f"`{name}` is a real {other}, which a virtual {word} does not work with"
                hint = f"let a virtual {other} use it"
                self.findings.report("E0401", message, place, help=hint)
            else:
                self.findings.unknown("E0218", f"real {word}", name, own, place)
            found.append(name)
        return found

    def missing_peers(
        self,
        definition: SubsystemDef,
        where: Where,
        peers: Mapping[str, str],
        devices: Collection[str],
    ) -> Iterator[str]:
        """Peers that are not there yet, after reporting; of `devices` this is done already.

        Peers that may not be talked to are reported as well.
        """
        letter = self.kind.removeprefix("virtual_")[0].upper()
        reported = {*devices, *(letter for _ in devices)}
        for direction, buffers in (("x", definition.x), ("y", definition.y)):
            for peer, buffer in buffers.items():
                if peer not in peers and (
                    peer in reported
                    or self._may_come(peer, buffer.elements, where[direction], peers)
                ):
                    yield peer

    def _may_come(
        self, peer: str, elements: Collection[str], where: Where, peers: Mapping[str, str]
    ) -> bool:
        """Whether a peer that does not exist may be to come; reports it in any case."""
        place = where[peer].key
        if part := _absent(self.kind, self.name, peer, elements, self.around):
            self.findings.not_there(part, place, "add it to the agent")
            return True
        if rule := _broken_rule(self.kind, peer, self.around, self.agents):
            self.findings.report("E0401", *rule[:1], place, help=rule[1])
            return False
        return self.findings.unknown("E0218", "peer", peer, peers, place)


def _is_configured(name: str, around: AgentDef) -> bool:
    """Whether a buffer of that name in the control subsystem is one to the real receptor."""
    device, control = around.real_receptors[name], around.control
    ends = (control.x.get(name), control.y.get(name)) if control else ()
    own = {element for end in ends if end for element in end.elements}
    return not own or not own.isdisjoint({*device.x.elements, *device.y.elements})


def _absent(
    kind: SubsystemKind, name: str, peer: str, elements: Collection[str], around: AgentDef
) -> str:
    """The device, or the virtual effector of a device, that a buffer names but nobody declares."""
    word = kind.removeprefix("virtual_")
    devices = around.real_effectors if word == "effector" else around.real_receptors
    if kind != "control" and peer == word[0].upper() and name not in devices:
        return f"real {word} `{name}`"
    device = around.real_effectors.get(peer)
    if (
        kind == "control"
        and device
        and not {*device.x.elements, *device.y.elements}.intersection(elements)
    ):
        return f"virtual effector `{peer}`"
    if kind == "control" and peer in around.real_receptors:
        return f"virtual receptor `{peer}`"
    return ""


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
            "give the data to a virtual effector, which talks to the device",
        )
    if peer in devices and kind != "control":
        return (
            f"`{peer}` is not a device that this subsystem works with",
            "a virtual effector uses real effectors and a virtual receptor real receptors; "
            "name them under `uses:`",
        )
    return None
