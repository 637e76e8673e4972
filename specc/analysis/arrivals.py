"""When the elements of input buffers have values, and new ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from specc.model.system import Subsystem
from specc.model.wires import Wire, Wires
from specc.proof import InputName


@dataclass(frozen=True, slots=True)
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


def always_present(subsystem: Subsystem, wires: Wires) -> frozenset[InputName]:
    """Inputs that have a value from the first period on."""
    return frozenset(
        (wire.port.peer, element.name)
        for wire in wires.wires_of(subsystem)
        if wire.port.direction == "x"
        for element in wire.port.elements
        if element.init is not None or wire.peer_device
    )


def arrivals_of(
    subsystem: Subsystem, wires: Wires, broken: Collection[str], *, timed: bool = True
) -> Arrivals:
    """When the inputs of a subsystem have values; a broken sender may send at any time.

    So may any other sender whose sending times are not known, and all senders if rates are not
    `timed` well.
    """
    declared = always_present(subsystem, wires)
    always, later, fresh = set(declared), set[InputName](), set[InputName]()
    together: dict[InputName, frozenset[InputName]] = {}
    for wire in wires.wires_of(subsystem):
        if wire.port.direction != "x" or wire.peer_device:
            continue
        sender, end, port = wire.peer_subsystem, wire.peer_port, wire.port
        if sender is None or end is None or wire.peer_name in broken:
            always |= {(port.peer, element.name) for element in port.elements}
            continue
        # What the sender's end lacks would be sent if that were mended.
        always |= {(port.peer, e.name) for e in port.elements if not end.element(e.name)}
        behaviours = {state.behaviour.name: state.behaviour for state in sender.states}.values()
        sent = [wire.inputs_sent_by(behaviour) for behaviour in behaviours if behaviour.is_complete]
        # A behaviour that is not known may well send nothing of this, or all of it.
        unsure = not behaviours or len(sent) < len(behaviours)
        rated = timed and sender.has_rate and subsystem.has_rate
        if not rated or sender.rate_hz >= subsystem.rate_hz:
            later |= _first_sent(sender, wire)
            if rated and not unsure:
                fresh |= frozenset.intersection(*sent) & subsystem.inputs.keys()
        together |= _sent_together(wire, sent, unsure)
    return Arrivals(frozenset(always), frozenset(later), together, declared, frozenset(fresh))


def _everything(wire: Wire) -> frozenset[InputName]:
    return frozenset((wire.port.peer, element.name) for element in wire.elements)


def _first_sent(sender: Subsystem, wire: Wire) -> frozenset[InputName]:
    """What the first period of a sender sends, and all that it may if that is not known."""
    first = sender.state(sender.initial_state).behaviour if sender.has_initial_state else None
    return (
        _everything(wire) if first is None or not first.is_complete else wire.inputs_sent_by(first)
    )


def _sent_together(
    wire: Wire, sent: Sequence[frozenset[InputName]], unsure: bool
) -> dict[InputName, frozenset[InputName]]:
    """Element -> what is sent whenever it is, by what each behaviour sends."""
    found = {}
    for element in wire.port.elements:
        name = wire.port.peer, element.name
        with_it = [names for names in sent if name in names]
        # What has an initial value is present also before anything was sent.
        if element.init is None and (with_it or unsure):
            others = _everything(wire).intersection(*with_it) - {name}
            if others:
                found[name] = others
    return found
