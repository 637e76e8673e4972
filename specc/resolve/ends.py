"""Both ends of buffers: who may be there, and who is not."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from specc.diagnostics import Related
from specc.lang.types import SAME
from specc.model.system import InterfaceRef, Port, SubsystemKind
from specc.model.wires import Direction
from specc.resolve.context import Findings, YamlNode
from specc.resolve.definitions import Definitions
from specc.resolve.elements import all_elements, as_read, extended, resolve_elements
from specc.resolve.expressions import Expressions
from specc.schema import SubsystemDef
from specc.schema.files import AgentDef, DeviceDef
from specc.schema.subsystem import BufferDef
from specc.source import Place

# Which subsystem or device is at the other end of every buffer (2.1).


def peers_of_virtual(
    agent: str, name: str, kind: SubsystemKind, definition: SubsystemDef, around: AgentDef
) -> dict[str, str]:
    """Peer -> other end for a virtual effector or receptor: its control subsystem and devices."""
    word = word_of(kind)
    letter, devices = word[0].upper(), devices_of(around, word)
    own = [device for device in used_by(definition, name) if device in devices]
    peers = {"c": f"{agent}.c"} | {device: f"{agent}.{letter}.{device}" for device in own}
    if len(own) == 1:
        peers[letter] = f"{agent}.{letter}.{own[0]}"
    return peers


def word_of(kind: SubsystemKind) -> str:
    """The kind of devices, `effector` or `receptor`, that a virtual one works with."""
    return kind.removeprefix("virtual_")


def devices_of(around: AgentDef, word: str) -> Mapping[str, DeviceDef]:
    """The real effectors or receptors of an agent."""
    return around.real_effectors if word == "effector" else around.real_receptors


def used_by(definition: SubsystemDef, name: str) -> list[str]:
    """The devices that a virtual effector or receptor works with: that of its name, or others."""
    return definition.uses if definition.uses is not None else [name]


def peers_of_control(agent: str, around: AgentDef, agents: Collection[str]) -> dict[str, str]:
    """Peer -> other end for a control subsystem: own virtual ones, receptors, other agents."""
    peers = {other: f"{other}.c" for other in agents if other != agent}
    receptors = list(around.real_receptors)
    for name in receptors:
        # A buffer of that name may as well be one to a virtual receptor.
        device, control = around.real_receptors[name], around.control
        ends = (control.x.get(name), control.y.get(name)) if control else ()
        own = {element for end in ends if end for element in end.elements}
        if not own or not own.isdisjoint({*device.x.elements, *device.y.elements}):
            peers[name] = f"{agent}.R.{name}"
    if len(receptors) == 1:
        peers["R"] = f"{agent}.R.{receptors[0]}"
    for name in (*around.virtual_effectors, *around.virtual_receptors):
        peers[name] = f"{agent}.{name}"
    return peers


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Who may be at the other ends of the buffers of a subsystem: `around` it is its agent."""

    name: str
    kind: SubsystemKind
    around: AgentDef
    agents: Collection[str]
    findings: Findings
    at: YamlNode
    """The subsystem in its agent."""

    def missing_devices(self, definition: SubsystemDef, where: YamlNode) -> list[str]:
        """Report devices under `uses` that a subsystem cannot use; returns their names."""
        word = word_of(self.kind)
        other = "receptor" if word == "effector" else "effector"
        own, others = devices_of(self.around, word), devices_of(self.around, other)
        found: list[str] = []
        if self.kind == "control" and definition.uses is not None:
            message = "a control subsystem does not work with devices itself"
            hint = "name them under `uses:` of a virtual effector or receptor"
            self.findings.report("E0401", message, where["uses"].key, help=hint)
            return found
        for index, name in enumerate(definition.uses or ()):
            place = where["uses"][index].place
            if name in own:
                route = *self.at.route[:-2], f"real_{word}s", name
                self.findings.use(Place(self.at.file, route, "key"), where, "uses", index)
                continue
            if name in others:
                message = f"`{name}` is a real {other}, which a virtual {word} does not work with"
                hint = f"let a virtual {other} use it"
                self.findings.report("E0401", message, place, help=hint)
            else:
                self.findings.unknown("E0201", f"real {word}", name, own, place)
            found.append(name)
        return found

    def missing_peers(
        self,
        definition: SubsystemDef,
        where: YamlNode,
        peers: Mapping[str, str],
        devices: Collection[str],
    ) -> Iterator[str]:
        """Report peers that do not exist yet, except for `devices`; yields their names.

        Peers that may not be talked to are reported as well.
        """
        reported = {*devices, word_of(self.kind)[0].upper()} if devices else set()
        for direction, buffers in (("x", definition.x), ("y", definition.y)):
            for peer, buffer in buffers.items():
                place = where[direction][peer].key
                if peer in peers:
                    continue
                if peer in reported:
                    yield peer
                elif part := self._undeclared(peer, buffer.elements):
                    self.findings.report_missing(part, place, "add it to the agent")
                    yield peer
                elif rule := self._broken_rule(peer):
                    self.findings.report("E0401", rule[0], place, help=rule[1])
                elif self.findings.unknown("E0201", "peer", peer, peers, place):
                    yield peer

    def _undeclared(self, peer: str, elements: Collection[str]) -> str:
        """The device, or the virtual part of a device, that a buffer names but nobody declares."""
        word, around = word_of(self.kind), self.around
        if self.kind != "control":
            is_missing = peer == word[0].upper() and self.name not in devices_of(around, word)
            return f"real {word} `{self.name}`" if is_missing else ""
        device = around.real_effectors.get(peer)
        if device and {*device.x.elements, *device.y.elements}.isdisjoint(elements):
            return f"virtual effector `{peer}`"
        return f"virtual receptor `{peer}`" if peer in around.real_receptors else ""

    def _broken_rule(self, peer: str) -> tuple[str, str] | None:
        """The structure rule that a connection to `peer` would break, and the way out."""
        around, is_control = self.around, self.kind == "control"
        virtual = {*around.virtual_effectors, *around.virtual_receptors}
        if not is_control and peer in virtual:
            return (
                "virtual effectors and receptors never talk to each other",
                "pass the data through the control subsystem",
            )
        if not is_control and peer in self.agents:
            return (
                "agents talk only through their control subsystems",
                f"connect the control subsystem to `{peer}` and pass the data on",
            )
        devices = {*around.real_effectors, *around.real_receptors, "E"}
        if peer in devices and is_control and peer not in around.real_receptors:
            return (
                "a control subsystem does not drive real effectors itself",
                "give the data to a virtual effector, which talks to the device",
            )
        if peer in devices and not is_control:
            return (
                f"`{peer}` is not a device that this subsystem works with",
                "a virtual effector uses real effectors and a virtual receptor real receptors; "
                "name them under `uses:`",
            )
        return None


# Ends that are `same`: their elements are written at the other end.


@dataclass(frozen=True, slots=True)
class WrittenBuffer:
    """A buffer as a file has it, `at` its place, and the names in force there."""

    definition: BufferDef
    at: YamlNode
    definitions: Definitions

    @property
    def is_same(self) -> bool:
        """Whether its elements are those of its other end; an interface may have that name."""
        return self.definition.interface == SAME and SAME not in self.definitions.interfaces


WrittenBuffers = dict[tuple[str, Direction, str], WrittenBuffer]
"""By the qualified name of the owner, the direction and the name of the other end, which is empty
for devices: these have one buffer for all.
"""


def with_other_elements(
    port: Port,
    name: str,
    here: WrittenBuffer,
    written: Mapping[tuple[str, Direction, str], WrittenBuffer],
    expressions: Expressions,
) -> Port:
    """A port of the subsystem `name` that is `same`, with the elements of its other end."""
    side, end = port.direction, port.other_end
    far: Direction = "y" if side == "x" else "x"
    there = written.get((end, far, name)) or written.get((end, far, ""))
    own = resolve_elements(here.definition.own, here.at, expressions)
    if there is not None and not there.is_same:
        scratch = Findings()
        found, _ = all_elements(
            there.definition, there.at, side, Expressions(scratch, there.definitions)
        )
        if found and not scratch.diagnostics:
            given = as_read(found, side)
            elements = extended(given, own, here.definition, here.at, expressions)
            return replace(port, elements=elements, interface=InterfaceRef(SAME, there.at.key))
        if not scratch.diagnostics:
            message = f"the other end has no elements, so `{SAME}` gives none"
            help = "write them there, or delete both ends"
            _report_ends("E0404", message, port, there, help, expressions.findings)
    elif there is not None and side == "x" and (end, far, name) in written:
        message = f"both ends are `{SAME}`: each has the elements of the other"
        help = "write the elements at one of the two ends: `{name: type}`"
        _report_ends("E0206", message, port, there, help, expressions.findings)
    expressions.broken |= {port.peer, *here.definition.elements}
    expressions.unresolved.add(f"{side}.{port.peer}")
    return replace(port, elements=own)


def _report_ends(
    code: str, message: str, port: Port, there: WrittenBuffer, help: str, findings: Findings
) -> None:
    related = (Related(there.at.key, "the other end"),)
    findings.report(code, message, port.place, related=related, help=help)
