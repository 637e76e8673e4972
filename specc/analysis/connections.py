"""Who talks to whom, through which buffers, and when what is sent has arrived."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import field
from functools import cached_property

from specc.frozen import frozen
from specc.model.fsm import Behaviour
from specc.model.system import Device, Element, Port, Subsystem, System
from specc.proof import InputName
from specc.reachable import grouped


@frozen
class Arrivals:
    """When the elements of the input buffers of a subsystem have a value, and a new one.

    Attributes:
        always: in every period: those that are `declared` so, and those of which too little is
            known.
        later: in every period after the first: the sender's first period sends them in time.
        together: element -> elements of which the sender sends one whenever it sends that one.
        declared: measurements of devices, and elements with an initial value.
        fresh: new in every period after the first, whatever state the sender is in.
    """

    always: frozenset[InputName]
    later: frozenset[InputName]
    together: dict[InputName, frozenset[InputName]] = field(default_factory=dict)
    declared: frozenset[InputName] = frozenset()
    fresh: frozenset[InputName] = frozenset()

    def close(self, present: frozenset[InputName]) -> frozenset[InputName]:
        """`present` with everything that was sent together with it."""
        new = [others for name, others in self.together.items() if name in present]
        return present.union(*new) if new else present


class Connections:
    """Subsystems and devices by their qualified names."""

    def __init__(self, system: System) -> None:
        self._system = system

    @cached_property
    def subsystems(self) -> dict[str, Subsystem]:
        """Those of the system by their qualified names."""
        return {s.qualified_name: s for s in self._system.subsystems}

    @cached_property
    def devices(self) -> dict[str, Device]:
        """Those of the system by their qualified names."""
        return {d.qualified_name: d for d in self._system.devices}

    @cached_property
    def _ends(self) -> dict[str, list[tuple[Subsystem, Port]]]:
        """Other end -> the ports that lead to it."""
        subsystems = self.subsystems.values()
        return grouped((p.other_end, (s, p)) for s in subsystems for p in s.ports)

    def ends_at(self, name: str) -> list[tuple[Subsystem, Port]]:
        """The ports whose other end is the subsystem or device of a name."""
        return self._ends.get(name, [])

    def other_port(self, subsystem: Subsystem, port: Port) -> Port | None:
        """The port at the other end of a connection between subsystems."""
        direction = "y" if port.direction == "x" else "x"
        return self._ports.get((port.other_end, direction, subsystem.qualified_name))

    @cached_property
    def _ports(self) -> dict[tuple[str, str, str], Port]:
        """Owner, direction and other end -> port; the first of several."""
        found: dict[tuple[str, str, str], Port] = {}
        for name, subsystem in self.subsystems.items():
            for port in subsystem.ports:
                found.setdefault((name, port.direction, port.other_end), port)
        return found

    def device_elements(self, port: Port) -> tuple[Element, ...]:
        """The elements of the device at the other end of `port`; empty if that is not a device."""
        device: Device | None = self.devices.get(port.other_end)
        if device is None:
            return ()
        return device.y if port.direction == "x" else device.x

    def owners(self, device: Device) -> list[tuple[Subsystem, Port]]:
        """Who works with an effector or commands a receptor, the one of its name first."""
        name, found = device.qualified_name, dict[str, tuple[Subsystem, Port]]()
        for subsystem, port in self.ends_at(name):
            if device.kind == "real_effector" or port.direction == "y":
                found.setdefault(subsystem.qualified_name, (subsystem, port))
        return sorted(found.values(), key=lambda owner: owner[0].name != device.name)

    @cached_property
    def contested(self) -> frozenset[str]:
        """Devices with several owners; what these need of them is checked once there is one."""
        return frozenset(n for n, device in self.devices.items() if len(self.owners(device)) > 1)

    def always_present(self, subsystem: Subsystem) -> frozenset[InputName]:
        """Inputs that have a value from the first period on."""
        return frozenset(
            name
            for name, element in subsystem.inputs.items()
            if element.init is not None or subsystem.sender(name[0]) in self.devices
        )

    def arrivals(
        self, subsystem: Subsystem, broken: Collection[str], *, timed: bool = True
    ) -> Arrivals:
        """When the inputs of a subsystem have values; a broken sender may send at any time.

        So may any other sender whose sending times are not known, and all senders if rates are not
        `timed` well.
        """
        declared = self.always_present(subsystem)
        always, later, fresh = set(declared), set[InputName](), set[InputName]()
        together: dict[InputName, frozenset[InputName]] = {}
        for port in subsystem.ports:
            if port.direction != "x" or port.other_end in self.devices:
                continue
            sender, end = self.subsystems.get(port.other_end), self.other_port(subsystem, port)
            if sender is None or end is None or port.other_end in broken:
                always |= {(port.peer, element.name) for element in port.elements}
                continue
            # What the sender's end lacks would be sent if that were mended.
            always |= {(port.peer, e.name) for e in port.elements if not end.element(e.name)}
            rated = timed and sender.rated and subsystem.rated
            if not rated or sender.rate_hz >= subsystem.rate_hz:
                later |= {(port.peer, name) for name in _first_sent(sender, end)}
                new = _always_sent(sender, end) if rated else ()
                fresh |= {(port.peer, name) for name in new if port.element(name)}
            together |= _sent_together(sender, end, port)
        return Arrivals(frozenset(always), frozenset(later), together, declared, frozenset(fresh))


def _first_sent(sender: Subsystem, end: Port) -> frozenset[str]:
    """What the first period of a sender sends, and all that it may if that is not known."""
    first = sender.state(sender.initial_state).behaviour if sender.begun else None
    if first is None or not first.whole:
        return frozenset(element.name for element in end.elements)
    return _sent(first, end.peer)


def _always_sent(sender: Subsystem, end: Port) -> frozenset[str]:
    """What every behaviour of a sender sends, so that a value becomes visible in each period."""
    behaviours = {state.behaviour.name: state.behaviour for state in sender.states}.values()
    if not behaviours or not all(behaviour.whole for behaviour in behaviours):
        return frozenset()
    return frozenset.intersection(*(_sent(behaviour, end.peer) for behaviour in behaviours))


def _sent(behaviour: Behaviour, peer: str) -> frozenset[str]:
    return frozenset(a.name for a in behaviour.assignments if a.peer == peer)


def _sent_together(
    sender: Subsystem, end: Port, port: Port
) -> dict[InputName, frozenset[InputName]]:
    behaviours = {state.behaviour.name: state.behaviour for state in sender.states}
    # A behaviour that is not known may well send nothing of this, or all of it.
    known = [behaviour for behaviour in behaviours.values() if behaviour.whole]
    sent = [names for b in known if (names := _sent(b, end.peer))]
    everything = frozenset(element.name for element in end.elements)
    unsure = len(known) < len(behaviours) or not behaviours
    found = {}
    for element in port.elements:
        # What has an initial value is present also before anything was sent.
        if element.init is not None:
            continue
        with_it = [names for names in sent if element.name in names]
        if with_it or unsure:
            others = everything.intersection(*with_it) - {element.name}
            if others:
                found[port.peer, element.name] = frozenset((port.peer, n) for n in others)
    return found
