"""Agents with their subsystems and devices; reused descriptions are instantiated here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

from specc.diagnostics import Diagnostic
from specc.model.fsm import Trace
from specc.model.system import (
    Agent,
    Device,
    DeviceKind,
    Port,
    Subsystem,
    SubsystemKind,
)
from specc.resolve.buffers import resolve_memory, resolve_ports
from specc.resolve.context import Findings, YamlNode, duration_in, trace_of
from specc.resolve.definitions import Definitions, Groups
from specc.resolve.elements import all_elements, with_safe
from specc.resolve.ends import (
    Neighbours,
    WrittenBuffer,
    WrittenBuffers,
    peers_of_control,
    peers_of_virtual,
    with_other_elements,
)
from specc.resolve.expansion import NAME, groups_of, with_device_buffers, with_machine, with_members
from specc.resolve.expressions import Expressions, rate_of
from specc.resolve.library import Library
from specc.resolve.machine import MachineResolver
from specc.resolve.modes import Target
from specc.resolve.reuse import Setting, agent_in, indexed, reuse
from specc.schema.files import AgentDef, ContractDef
from specc.schema.subsystem import SubsystemDef
from specc.source import Place

_Control = tuple[SubsystemDef, YamlNode, Setting]
"""A control subsystem, where it is described, and the names in force there."""


@dataclass(frozen=True, slots=True)
class OpenSubsystem:
    """A subsystem whose ports are known, but for the elements of those that are `same`.

    `levels` has it and the descriptions that it uses, the outermost first; `definition` is the
    last of them. `found` are the findings about it so far.
    """

    agent: str
    name: str
    kind: SubsystemKind
    levels: list[tuple[SubsystemDef, YamlNode]]
    inside: Setting
    definition: SubsystemDef
    where: YamlNode
    rate: Fraction | None
    budget_s: Fraction | None
    ports: tuple[Port, ...]
    expressions: Expressions
    found: tuple[Diagnostic, ...]
    has_suppressed: bool

    @property
    def qualified_name(self) -> str:
        return f"{self.agent}.{self.name}"

    def buffer(self, port: Port) -> WrittenBuffer:
        """What the file has for a port."""
        buffers = self.definition.x if port.direction == "x" else self.definition.y
        at = self.where[port.direction][port.peer]
        return WrittenBuffer(buffers[port.peer], at, self.inside.definitions)


@dataclass(frozen=True, slots=True)
class WrittenContract:
    """A contract of a device, which is read when all agents are known."""

    device: Device
    name: str
    definition: ContractDef
    where: YamlNode
    inside: Definitions


@dataclass(frozen=True, slots=True)
class OpenAgent:
    """An agent some of whose subsystems wait for the elements of other ends."""

    name: str
    kind: str
    title: str
    subsystems: tuple[Subsystem | OpenSubsystem, ...]
    devices: tuple[Device, ...]
    place: Place
    trace: Trace = Trace()  # noqa: RUF009  # frozen


@dataclass(eq=False, slots=True)
class AgentResolver:
    """Resolves the agents of a system, in two steps: an end that is `same` has the elements of its
    other end, so the buffers of all agents come first.

    `instances` collects the definitions of reused files, `written` all buffers.
    """

    library: Library
    findings: Findings
    names: tuple[str, ...]
    broken: set[str] = field(default_factory=set)
    faulty: set[str] = field(default_factory=set)
    instances: list[Definitions] = field(default_factory=list)
    written: WrittenBuffers = field(default_factory=dict)
    contracts: list[WrittenContract] = field(default_factory=list)

    def close(self, agent: OpenAgent) -> Agent:
        """The agent, after all agents have been opened."""
        subsystems = tuple(
            self._close(each) if isinstance(each, OpenSubsystem) else each
            for each in agent.subsystems
        )
        own = agent.name, agent.kind, agent.title, subsystems, agent.devices, agent.place
        return Agent(*own, agent.trace)

    def open(
        self,
        name: str,
        definition: AgentDef,
        where: YamlNode,
        at: Setting,
        instead: _Control | None = None,
    ) -> OpenAgent | None:
        """The agent, or None if the file that it uses cannot be used.

        `instead` takes the place of its control subsystem.
        """
        at = indexed(at, definition.each, where, self.findings)
        if definition.use is not None:
            return self._reused(name, definition, where, at, instead)
        subsystems = []
        control, here, inside = instead or (definition.control, where["control"], at)
        if control is None:
            message = f"agent `{name}` has no control subsystem"
            help_text = "every agent has exactly one (2.1): add `control:`"
            self.broken.add(f"{name}.c")
            self.findings.report("O0402", message, where.key, help=help_text)
        else:
            peers = peers_of_control(name, definition, self.names)
            virtual = groups_of(definition.virtual_effectors, where["virtual_effectors"])
            virtual |= groups_of(definition.virtual_receptors, where["virtual_receptors"])
            part = control, here, peers, replace(inside, groups=virtual)
            subsystems.append(self.open_subsystem(name, "c", "control", definition, *part))
        subsystems += self._virtual(name, definition, where, at)
        devices = tuple(self._devices(name, definition, where, at))
        found = tuple(s for s in subsystems if s is not None)
        parts = definition.kind or "", definition.title, found, devices, where.key
        return OpenAgent(name, *parts, trace_of(definition))

    def _reused(
        self,
        name: str,
        definition: AgentDef,
        where: YamlNode,
        at: Setting,
        control: _Control | None,
    ) -> OpenAgent | None:
        """The agent of a description or of another system, with its own control or another."""
        used = reuse(definition, where, at, self.library, name)
        inner, here = agent_in(used.file, name) if used else (None, where)
        if used is None or inner is None:
            self.broken.add(name)
            if used is not None:
                self._no_description("agent", where, used.file.spec.agents)
            return None
        self._refuse_parts(definition, where)
        self.instances.append(used.definitions)
        if control is None and definition.control is not None:
            control = definition.control, where["control"], at
        agent = self.open(name, inner, here, used, control)
        if agent is None:
            return None
        kind = definition.kind or ("" if control else agent.kind)
        return replace(agent, title=definition.title or agent.title, kind=kind, place=where.key)

    def _virtual(
        self, agent: str, around: AgentDef, where: YamlNode, at: Setting
    ) -> Iterator[Subsystem | OpenSubsystem | None]:
        kinds: tuple[SubsystemKind, ...] = ("virtual_effector", "virtual_receptor")
        known = at.definitions.interfaces
        for kind in kinds:
            for name, definition in getattr(around, f"{kind}s").items():
                peers = peers_of_virtual(agent, name, kind, definition, around)
                part = definition, where[f"{kind}s"][name]
                whole = with_device_buffers(*part, kind, name, around, where, known, self.findings)
                yield self.open_subsystem(agent, name, kind, around, *whole, peers, at)

    def open_subsystem(
        self,
        agent: str,
        name: str,
        kind: SubsystemKind,
        agent_def: AgentDef,
        definition: SubsystemDef,
        where: YamlNode,
        peers: Mapping[str, str],
        at: Setting,
    ) -> Subsystem | OpenSubsystem | None:
        """Resolve one subsystem, as far as that is possible without the others.

        It is marked as `broken` or `faulty` if it has errors, and None if a file that it uses
        cannot be used.
        """
        findings = self.findings
        before = self._count()
        at = indexed(at, definition.each, where, self.findings)
        levels, inside = self._use_chain(f"{agent}.{name}", definition, where, at)
        if inside is None:
            self.broken.add(f"{agent}.{name}")
            return None
        described, here, groups = with_members(
            *levels[-1], self._groups(kind, agent, at.groups, inside.definitions)
        )
        device_user, at_uses = _first_with(levels, "uses")
        if definition.uses is None and device_user.uses is not None and kind != "control":
            peers = peers_of_virtual(agent, name, kind, device_user, agent_def)
        agent_parameters = inside.definitions.agents
        if kind == "control":
            peers = {**peers, **{local: f"{other}.c" for local, other in agent_parameters.items()}}
        neighbours = Neighbours(
            name, kind, agent_def, (*self.names, *agent_parameters), self.findings, where
        )
        devices = neighbours.missing_devices(device_user, at_uses)
        missing = neighbours.missing_peers(described, here, peers, devices)
        # An end that is not there yet may be anything, as one with errors may.
        absent = {peer: f"{agent}.{peer}" for peer in missing}
        self.broken |= set(absent.values())
        peers = {**peers, **absent}
        timed, at_rate = _first_with(levels, "rate")
        rate = None
        if timed.rate is None:
            message = "the subsystem has no rate yet"
            findings.report("O0601", message, where.key, help="add e.g. `rate: 100 Hz`")
        else:
            rate = rate_of(timed.rate, at_rate["rate"], findings)
        budget_s = duration_in(*_first_with(levels, "budget"), "budget", findings)
        expressions = Expressions(findings, inside.definitions, home=here, groups=groups)
        ports = resolve_ports(described, here, peers, expressions)
        opened = OpenSubsystem(
            agent, name, kind, levels, inside, described, here, rate, budget_s, ports, expressions,
            *self._since(before),
        )  # fmt: skip
        waits = False
        for port in ports:
            buffer = opened.buffer(port)
            waits |= buffer.is_same
            if port.other_end:
                key = opened.qualified_name, port.direction, port.other_end
                self.written.setdefault(key, buffer)
        return opened if waits else self._close(opened)

    def _count(self) -> tuple[int, int, int]:
        """How much has been found until now."""
        found = self.findings
        return len(found.diagnostics), len(found.repeated), found.suppressed

    def _since(self, before: tuple[int, int, int]) -> tuple[tuple[Diagnostic, ...], bool]:
        """The findings since then, and whether others only follow from some."""
        found, (first, repeated, suppressed) = self.findings, before
        new = *found.diagnostics[first:], *found.repeated[repeated:]
        return new, found.suppressed > suppressed

    def _close(self, part: OpenSubsystem) -> Subsystem:
        """Resolve the rest of a subsystem, with the elements of its buffers."""
        before, name, expressions = self._count(), part.qualified_name, part.expressions
        ports = tuple(
            with_other_elements(port, name, buffer, self.written, expressions)
            if (buffer := part.buffer(port)).is_same
            else port
            for port in part.ports
        )
        others = {p.peer: [e.name for e in p.elements] for p in ports if p.direction == "y"}
        interfaces = part.inside.definitions.interfaces
        described, here = with_machine(
            part.definition, part.where, interfaces, others, self.findings
        )
        expressions.home = here
        memory, lets, scope = resolve_memory(described, here, ports, expressions)
        machine = MachineResolver(
            described, here, scope, ports, memory, lets, part.rate or Fraction(1), expressions
        )
        machine_parts = machine.resolve()
        resolved = Subsystem(
            agent=part.agent,
            name=part.name,
            kind=part.kind,
            title=next((level.title for level, _ in part.levels if level.title), ""),
            rate_hz=part.rate or Fraction(1),
            ports=tuple(port for port in ports if port.other_end),
            constants=part.inside.parameters,
            **machine_parts,
            initial_state=self._initial_state(machine, here),
            trace=trace_of(described),
            place=part.levels[0][1].key,
            outside=part.inside.definitions.outside(),
            has_rate=part.rate is not None,
            has_initial_state=bool(machine.initial_state),
            budget_s=part.budget_s,
        )
        late, has_suppressed = self._since(before)
        found = [each for each in (*part.found, *late) if each.severity != "warning"]
        if found:
            inner = all(_leaves_interface_known(finding, here) for finding in found)
            (self.faulty if inner else self.broken).add(resolved.qualified_name)
        elif part.has_suppressed or has_suppressed:
            self.faulty.add(resolved.qualified_name)
        return resolved

    def _use_chain(
        self, name: str, definition: SubsystemDef, where: YamlNode, at: Setting
    ) -> tuple[list[tuple[SubsystemDef, YamlNode]], Setting | None]:
        """The subsystem and the descriptions that it uses, outermost first, and the last setting.

        The setting is None after reporting that a description cannot be used.
        """
        levels, inside = [(definition, where)], at
        while levels[-1][0].use is not None:
            described, here = levels[-1]
            self._refuse_parts(described, here)
            used = reuse(described, here, inside, self.library, name)
            if used is None or used.file.spec.subsystem is None:
                if used is not None:
                    self._no_description("subsystem", here)
                return levels, None
            self.instances.append(used.definitions)
            levels.append((used.file.spec.subsystem, used.file.top["subsystem"]))
            inside = used
        return levels, inside

    def _groups(
        self, kind: SubsystemKind, agent: str, virtual: Groups, given: Definitions
    ) -> Groups:
        """The groups that a control subsystem may name; an agent is no peer of itself."""
        if kind != "control":
            return {}
        others = {
            name: {at: m for at, m in members.items() if given.agents.get(m, m) != agent}
            for name, members in (self.library.groups | given.groups).items()
        }
        return {name: members for name, members in (others | virtual).items() if members}

    def _initial_state(self, machine: MachineResolver, where: YamlNode) -> str:
        definition, findings = machine.definition, self.findings
        name, states = definition.initial_state, definition.states
        if name is not None and states:
            target = Target(name, is_resumed=False)
            return machine.tree.entered_state(target, where["initial_state"]) or next(iter(states))
        if states:
            message = "the subsystem has no initial state yet"
            help = "add `initial_state:` with the state of the first period"
            findings.report("O0602", message, where.key, help=help)
        elif definition.behaviours:
            message, help = (
                "the subsystem has no states yet",
                "add `states:`, each with a behaviour",
            )
            findings.report("O0604", message, where.key, help=help)
        else:
            help = "add `behaviours:`, then `states:` that execute them"
            message = "the subsystem has no behaviours yet"
            findings.report("O0603", message, where.key, help=help)
        return next(iter(states), "")

    def _devices(
        self, agent: str, around: AgentDef, where: YamlNode, at: Setting
    ) -> Iterator[Device]:
        kinds: tuple[DeviceKind, ...] = ("real_effector", "real_receptor")
        for kind in kinds:
            for name, item in getattr(around, f"{kind}s").items():
                here = where[f"{kind}s"][name]
                inside = indexed(at, item.each, here, self.findings)
                expressions = Expressions(self.findings, inside.definitions)
                x, commands = all_elements(item.x, here["x"], "x", expressions)
                y, reports = all_elements(item.y, here["y"], "y", expressions)
                x = with_safe(x, item, here["x"], y, expressions)
                trace, silence = trace_of(item), duration_in(item, here, "silence", self.findings)
                parts = item.title, x, y, trace, here.key, inside.parameters, silence
                device = Device(agent, name, kind, *parts)
                key, known = device.qualified_name, inside.definitions
                self.written[key, "x", ""] = WrittenBuffer(item.x, here["x"], known)
                self.written[key, "y", ""] = WrittenBuffer(item.y, here["y"], known)
                for found, buffer, shared in ((x, item.x, commands), (y, item.y, reports)):
                    if len(found) < len(buffer.elements) or (buffer.interface and not shared):
                        self.broken.add(device.qualified_name)
                for contract, of in item.contracts.items():
                    place = here["contracts"][contract]
                    self.contracts.append(WrittenContract(device, contract, of, place, known))
                yield device

    def _refuse_parts(self, definition: AgentDef | SubsystemDef, where: YamlNode) -> None:
        """Report parts beside `use`, which would be described twice."""
        what, parts = "subsystem", definition.given_keys - _BESIDE_USE
        help = "only title, `rate`, `budget` and `uses` may be others; say the rest in that file"
        if isinstance(definition, AgentDef):
            what, parts = "agent", frozenset(k for k in _DESCRIBED if getattr(definition, k))
            help = "only its `control` may be another; describe other parts in that file"
        for key in (key for key in definition.keys if key in parts):
            message = f"`{key}` has no effect: another file describes the {what}"
            self.findings.report("E0104", message, where[key].key, help=help)

    def _no_description(self, what: str, where: YamlNode, agents: Iterable[str] = ()) -> None:
        """Report a file without such a part; `agents` are those of a system."""
        message = f"the file describes no {what}"
        help = f"the file needs `{what}:` at its top level"
        if known := ", ".join(f"`{agent}`" for agent in agents):
            message = "the system has no agent of this name, and more than one of others"
            help = f"give the agent the name of one of them: {known}"
        self.findings.report("E0219", message, where["use"].place, help=help)


_BESIDE_USE = {"for", "use", "title", "rate", "budget", "with", "uses", "eq", "table", "fig"}
_DESCRIBED = ("virtual_effectors", "virtual_receptors", "real_effectors", "real_receptors")


_INNER = frozenset(
    ("memory", "let", "conditions", "functions", "behaviours", "states", "initial_state")
) | {NAME, "rate", "budget"}
_NOT_THERE = frozenset(("O0601", "O0602", "O0603", "O0604"))


def _first_with(
    levels: list[tuple[SubsystemDef, YamlNode]], key: str
) -> tuple[SubsystemDef, YamlNode]:
    """The first level that gives `key`, or the last; a user comes before what it uses."""
    return next((level for level in levels if getattr(level[0], key) is not None), levels[-1])


def _leaves_interface_known(finding: Diagnostic, subsystem: YamlNode) -> bool:
    """Whether an error leaves the buffers and the graph of states of the subsystem known.

    A row with an unknown condition is known to exist; one with an unknown state is not.
    """
    if finding.code in _NOT_THERE:
        return True
    place, depth = finding.primary, len(subsystem.route)
    if place.file != subsystem.file or place.route[:depth] != subsystem.route:
        return False
    inner = place.route[depth:]
    part = inner[0] if inner else ""
    is_peer = len(inner) == 2 and part in ("x", "y") and place.part == "key"
    if finding.code == "O0205" and (part == "uses" or is_peer):
        return True
    return part in _INNER or (part == "transitions" and place.route[-1] in (2, "when"))
