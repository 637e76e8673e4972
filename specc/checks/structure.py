"""Agents, their subsystems and devices (2.1, 2.2), and both ends of connections (section 3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from specc.analysis import Facts
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.model.system import Agent, Device, Element, InterfaceRef, Port, Subsystem
from specc.model.types import Enum, Opaque, Record, Type
from specc.model.wires import Wire
from specc.source import Place

# The subsystems of an agent have different names; `c` is the control subsystem.


def subsystems_distinct(facts: Facts) -> Iterator[Diagnostic]:
    """E0411, for two subsystems of an agent with one name."""
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
    """E0406, where a subsystem becomes the second owner."""
    for device in facts.system.devices:
        owners = [(wire.subsystem, wire.port) for wire in facts.wires.owners(device)]
        for subsystem, port in owners[1:]:
            first, its_port = owners[0]
            is_own = subsystem.kind == "control" or subsystem.name == device.name
            claim = port.place if is_own else subsystem.place.below("uses")
            yield Diagnostic(
                "E0406",
                f"`{device.qualified_name}` belongs to `{first.qualified_name}` already",
                claim,
                f"`{subsystem.qualified_name}` uses it too",
                (Related(its_port.place, "used here"), Related(device.place, "the device")),
                "let one subsystem work with it and pass the data on",
            )


# Every real effector and receptor is used by a subsystem.


def devices_used(facts: Facts) -> Iterator[Diagnostic]:
    """O0404; not of an agent with a broken subsystem, or one that claims another's device."""
    unsure = {name.split(".")[0] for name in facts.broken | facts.wires.shared_devices}
    for device in facts.system.devices:
        if not facts.wires.wires_to(device.qualified_name) and device.agent not in unsure:
            kind = "effector" if device.kind == "real_effector" else "receptor"
            help = f"add a virtual {kind} `{device.name}`, or delete the device"
            if f"{device.agent}.{device.name}" in facts.wires.subsystems:
                # Its own virtual effector or receptor lacks the buffers.
                key = kind[0].upper()
                help = f"add `{key}: {{...}}` under the `x:` and `y:` of `{device.name}`"
            yield Diagnostic(
                "O0404",
                f"no subsystem uses the real {kind} `{device.name}`",
                device.place,
                help=help,
            )


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
        known = {subsystem.qualified_name for subsystem in agent.subsystems}
        control = f"{agent.name}.c"
        lost = {n for n in facts.broken if n.startswith(f"{agent.name}.") and n not in known}
        devices = {device.qualified_name for device in agent.devices}
        if control not in known or control in facts.broken or bool(lost - devices):
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
            has = join_words((_MEANING[letter] for letter in kind), "and")
            yield Diagnostic(
                "E0407",
                f"agent `{agent.name}` is of kind {kind}, not {agent.kind}",
                agent.place.below("kind"),
                f"it has {has}",
                help=f"write `kind: {kind}`, or change the structure",
            )


def _derived(agent: Agent, facts: Facts) -> str:
    """The letters of 2.2 in the order C, E, R, T."""
    kinds: set[str] = {subsystem.kind for subsystem in agent.subsystems}
    kinds |= {device.kind for device in agent.devices}
    ends = {kind.rpartition("_")[2] for kind in kinds}
    own = f"{agent.name}.c"
    wires = [wire for s in agent.subsystems if s.name == "c" for wire in facts.wires.wires_of(s)]
    talks = any(
        wire.subsystem.kind == "control"
        and wire.peer_name.partition(".")[0] != wire.subsystem.agent
        for wire in (*wires, *facts.wires.wires_to(own))
    )
    return "C" + "E" * ("effector" in ends) + "R" * ("receptor" in ends) + "T" * talks


# Connected buffers have exactly the same structure at both ends.


_MOST_SHOWN = 4


def buffers_match(facts: Facts) -> Iterator[Diagnostic]:
    """O0403, E0404 and E0405, for connections with subsystems and with devices."""
    for subsystem in facts.subsystems:
        for wire in facts.wires.wires_of(subsystem):
            if wire.peer_name in facts.broken | facts.wires.shared_devices:
                continue
            if wire.peer_device is not None:
                side = _side_place(wire.peer_device, "y" if wire.port.direction == "x" else "x")
                yield from _end_differences(_end(wire.port), _End(side, wire.elements))
            elif wire.peer_subsystem is not None:
                yield from _between_subsystems(wire, wire.peer_subsystem, facts)
    for device in facts.system.devices:
        yield from _unconnected(device, facts)


def _side_place(device: Device, side: str) -> Place:
    """The place where a device declares a side, or the device if it declares nothing."""
    return replace(device.place, route=(*device.place.route, side))


def _between_subsystems(wire: Wire, other: Subsystem, facts: Facts) -> Iterator[Diagnostic]:
    subsystem, port, end = wire.subsystem, wire.port, wire.peer_port
    if other is subsystem:
        yield Diagnostic(
            "E0401",
            f"`{port.peer}` is `{subsystem.agent}` itself, and an agent does not talk to itself",
            port.place,
            related=_user_place(subsystem, port, facts),
            help="give the parameter another agent; what a subsystem keeps for itself is memory",
        )
        return
    if end is None:
        verb, key = ("sends to", "y") if port.direction == "x" else ("receives from", "x")
        name = subsystem.name if other.agent == subsystem.agent else subsystem.agent
        lacks, here = (
            _buffer_place(other, key, name),
            f"`{other.qualified_name}` has its buffers here",
        )
        given = ", or make it one of the agents that it is given"
        yield Diagnostic(
            "O0403",
            f"`{other.qualified_name}` has no buffer that {verb} `{subsystem.qualified_name}`",
            port.place,
            "nothing is connected to this end",
            (Related(replace(lacks, part="key"), here), *_user_place(subsystem, port, facts)),
            f"add `{name}: {{...}}` under its `{key}:`, with the same elements"
            + (given if lacks.file != other.place.file else ""),
            lacks=(lacks,),
        )
    elif port.direction == "x":
        yield from _end_differences(_end(port), _end(end))


def _user_place(subsystem: Subsystem, port: Port, facts: Facts) -> tuple[Related, ...]:
    """The place of a subsystem, or of its agent, that another file describes."""
    agents = (agent.place for agent in facts.system.agents if agent.name == subsystem.agent)
    users = (place for place in (subsystem.place, *agents) if place.file != port.place.file)
    return tuple(Related(place, f"this is `{subsystem.qualified_name}`") for place in users)[:1]


# What one subsystem sends to another goes through one buffer.


def one_buffer_each(facts: Facts) -> Iterator[Diagnostic]:
    """E0413; two parameters of a description may stand for one agent."""
    for subsystem in facts.subsystems:
        first: dict[tuple[str, str], Port] = {}
        for wire in facts.wires.wires_of(subsystem):
            port = wire.port
            earlier = first.setdefault((port.direction, wire.peer_name), port)
            if earlier is not port and wire.peer_subsystem:
                other = Related(earlier.place, "the other one")
                yield Diagnostic(
                    "E0413",
                    f"`{port.peer}` and `{earlier.peer}` are both `{wire.peer_name}`",
                    port.place,
                    related=(other, *_user_place(subsystem, port, facts)),
                    help="one buffer leads from one subsystem to another: give the parameters "
                    "different agents, or put all elements into one buffer",
                )


def _buffer_place(subsystem: Subsystem, direction: str, peer: str) -> Place:
    """The place where a buffer of a subsystem would be declared, beside its others."""
    own = (port.place for port in subsystem.ports if port.place.route[-2] in ("x", "y"))
    if place := next(own, None):
        return Place(place.file, (*place.route[:-2], direction, peer))
    return Place(subsystem.place.file, (*subsystem.place.route, direction, peer))


@dataclass(frozen=True, slots=True)
class _End:
    """An end of a connection, at its place, and the interface that it names."""

    place: Place
    elements: tuple[Element, ...]
    port: Port | None = None

    @property
    def interface(self) -> InterfaceRef | None:
        return self.port.interface if self.port else None

    def place_of(self, element: Element) -> Place:
        return self.port.place_of(element) if self.port else element.place

    def declared(self, element: Element) -> tuple[Related, ...]:
        """Where an element of its interface is declared."""
        if self.interface is None or self.place_of(element) == element.place:
            return ()
        return (Related(element.place, f"in `{self.interface.text}`"),)

    def places_of(self, elements: Sequence[Element]) -> tuple[Place, ...]:
        """Where elements would be declared; an interface has other users, too."""
        if self.interface:
            return ()
        place = self.place
        return tuple(
            replace(place, route=(*place.route, element.name), part="value") for element in elements
        )


def _end(port: Port) -> _End:
    return _End(port.place, port.elements, port)


def _end_differences(here: _End, there: _End) -> Iterator[Diagnostic]:
    """Yield E0404 and E0405 for the differences between two ends of a connection."""
    mine, theirs = ({e.name: e for e in end.elements} for end in (here, there))
    for name, one in mine.items():
        other = theirs.get(name)
        if other and one.type != other.type:
            mine_is, theirs_is = _distinct_texts(one.type, other.type)
            connected = Related(there.place_of(other), f"connected to this one: `{theirs_is}`")
            declared = here.declared(one) or there.declared(other)
            yield Diagnostic(
                "E0405",
                f"`{name}` is `{mine_is}` at one end and `{theirs_is}` at the other",
                here.place_of(one),
                f"`{mine_is}`",
                (connected, *declared),
                "both ends of a connection must have exactly the same type",
            )
    lacking_there = [e for e in here.elements if e.name not in theirs]
    lacking_here = [e for e in there.elements if e.name not in mine]
    if lacking_here and lacking_there:
        # A different name, or the elements of another buffer.
        names = _names(lacking_there)
        yield Diagnostic(
            "E0404",
            f"the buffer lacks {_names(lacking_here)}, and its other end lacks {names}",
            here.place,
            f"has {names} instead",
            (*_missing_at_other_end(lacking_here), Related(there.place, "the other end")),
            "give both ends the same elements; perhaps one end has those of another buffer",
            lacks=here.places_of(lacking_here) + there.places_of(lacking_there),
        )
    elif lacking_here:
        yield _missing_elements(here, lacking_here, there)
    elif lacking_there:
        yield _missing_elements(there, lacking_there, here)


def _distinct_texts(one: Type, other: Type) -> tuple[str, str]:
    """Texts of two types that differ; of one name in two files, with what differs in them."""
    texts = str(one), str(other)
    if texts[0] != texts[1]:
        return texts
    inside = _type_details(one), _type_details(other)
    for (name, mine), (_, theirs) in zip(_parts(one), _parts(other), strict=False):
        if inside[0] == inside[1] and mine != theirs:
            one_text, other_text = _distinct_texts(mine, theirs)
            return f"{texts[0]} with {name}{one_text}", f"{texts[1]} with {name}{other_text}"
    return f"{texts[0]}{inside[0]}", f"{texts[1]}{inside[1]}"


def _parts(type_: Type) -> list[tuple[str, Type]]:
    if isinstance(type_, Record):
        return [(f"{name}: ", inner) for name, inner in type_.fields]
    return [("", inner) for inner in type_.parts]


def _type_details(type_: Type) -> str:
    """The details of a type beyond its name and the types of its parts."""
    match type_:
        case Enum(members=members):
            return f" = enum[{', '.join(members)}]"
        case Record(fields=fields, python=python):
            return f" {{{', '.join(name for name, _ in fields)}}}{python and f' of {python}'}"
        case Opaque(python=python, codec=codec):
            return f" of {', '.join(filter(None, (python, *codec))) or 'no class'}"
    return ""


def _names(elements: Sequence[Element]) -> str:
    return join_words([f"`{element.name}`" for element in elements], "and")


def _missing_at_other_end(elements: Sequence[Element]) -> Iterator[Related]:
    """The places of elements at the other end; of many the first."""
    for element in elements[:_MOST_SHOWN]:
        yield Related(element.place, f"`{element.type}`, missing at the other end")


def _missing_elements(end: _End, elements: Sequence[Element], other: _End) -> Diagnostic:
    added = join_words([f'`{element.name}: "{element.type}"`' for element in elements], "and")
    it, interface = "it" if len(elements) == 1 else "them", end.interface
    to = f" to interface `{interface.text}`" if interface else ""
    if interface and other.interface and interface.text != other.interface.text:
        to += f", name `{other.interface.text}` at both ends"
    related = (Related(interface.place, "has the elements of this end"),) if interface else ()
    return Diagnostic(
        "E0404",
        f"the buffer lacks {_names(elements)}, which the other end has",
        end.place,
        f"lacks {it}",
        (*_missing_at_other_end(elements), *related),
        f"add {added}{to}, or delete {it} at the other end",
        lacks=end.places_of(elements),
    )


def _unconnected(device: Device, facts: Facts) -> Iterator[Diagnostic]:
    """A device of which only one side is connected; one without any is `devices_used`'s matter."""
    wires = facts.wires.wires_to(device.qualified_name)
    contested = device.qualified_name in facts.wires.shared_devices
    if not wires or contested or any(w.subsystem.qualified_name in facts.broken for w in wires):
        return
    subsystem, port = wires[0].subsystem, wires[0].port
    sides = (
        (device.x, "x", "y", f"nothing commands `{device.qualified_name}`"),
        (device.y, "y", "x", f"nothing reads what `{device.qualified_name}` reports"),
    )
    for elements, side, direction, message in sides:
        if elements and not any(wire.port.direction == direction for wire in wires):
            names = ", ".join(f"`{e.name}`" for e in elements)
            lacks = _buffer_place(subsystem, direction, port.peer)
            here = replace(lacks, part="key")
            yield Diagnostic(
                "O0403",
                message,
                _side_place(device, side),
                f"{names}: missing at the other end",
                (Related(here, f"`{subsystem.qualified_name}` works with it"),),
                f"add `{port.peer}: {{...}}` under the `{direction}:` of `{subsystem.name}`",
                lacks=(lacks,),
            )
