"""Connected buffers have exactly the same structure at both ends (section 3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import listed
from specc.model.system import Device, Element, Port, Subsystem, System
from specc.source import Place

_MOST_SHOWN = 4


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0403, E0404 and E0405, for connections with subsystems and with devices."""
    for subsystem in facts.subsystems:
        for port in subsystem.ports:
            device = facts.connections.devices.get(port.other_end)
            if port.other_end in facts.broken | facts.connections.contested:
                continue
            if device is not None:
                elements = facts.connections.device_elements(port)
                there = _side(device, "y" if port.direction == "x" else "x")
                yield from _compare(port.place, port.elements, there, elements)
            else:
                yield from _between_subsystems(subsystem, port, facts)
    for device in system.devices:
        yield from _unconnected(device, facts)


def _side(device: Device, side: str) -> Place:
    """What a device accepts or reports, or the device where it says nothing of that."""
    return replace(device.place, route=(*device.place.route, side))


def _between_subsystems(subsystem: Subsystem, port: Port, facts: Facts) -> Iterator[Diagnostic]:
    other = facts.connections.subsystems.get(port.other_end)
    if other is None:
        return
    end = facts.connections.other_port(subsystem, port)
    if end is None:
        verb, key = ("sends to", "y") if port.direction == "x" else ("receives from", "x")
        name = subsystem.name if other.agent == subsystem.agent else subsystem.agent
        lacks = _buffer(other, key, name)
        yield Diagnostic(
            "O0403",
            f"`{other.qualified_name}` has no buffer that {verb} `{subsystem.qualified_name}`",
            port.place,
            "this end has no other",
            (
                Related(
                    replace(lacks, part="key"), f"`{other.qualified_name}` has its buffers here"
                ),
            ),
            f"add `{name}: {{...}}` under its `{key}:`, with the same elements",
            lacks=(lacks,),
        )
    elif port.direction == "x":
        yield from _compare(port.place, port.elements, end.place, end.elements)


def _buffer(subsystem: Subsystem, direction: str, peer: str) -> Place:
    """Where a buffer of a subsystem would be declared, beside its others if it has any."""
    here = subsystem.place
    others = [port.place for port in subsystem.ports]
    route = others[0].route[:-2] if others else here.route
    file = others[0].file if others else here.file
    return Place(file, (*route, direction, peer))


def _compare(
    here: Place, own: tuple[Element, ...], there: Place, others: tuple[Element, ...]
) -> Iterator[Diagnostic]:
    """Two ends of a connection; `here` and `there` are their places."""
    mine, theirs = {e.name: e for e in own}, {e.name: e for e in others}
    for name, one in mine.items():
        other = theirs.get(name)
        if other and one.type != other.type:
            yield Diagnostic(
                "E0405",
                f"`{name}` is `{one.type}` at one end and `{other.type}` at the other",
                one.place,
                f"`{one.type}`",
                (Related(other.place, f"connected to this one: `{other.type}`"),),
                "both ends of a connection have exactly the same type",
            )
    only_here = [e for e in own if e.name not in theirs]
    only_there = [e for e in others if e.name not in mine]
    if only_here and only_there:
        yield _two_lists(_Lack(here, only_there), _Lack(there, only_here))
    elif only_here or only_there:
        yield _missing(_Lack(here, only_there) if only_there else _Lack(there, only_here))


class _Lack(NamedTuple):
    """An end of a connection, and what only the other one has."""

    place: Place
    elements: list[Element]

    @property
    def names(self) -> str:
        return listed([f"`{element.name}`" for element in self.elements], "and")

    @property
    def others(self) -> tuple[Related, ...]:
        """Where the other end has it, of many the first."""
        return tuple(
            Related(element.place, f"`{element.type}`, without another end")
            for element in self.elements[:_MOST_SHOWN]
        )

    @property
    def places(self) -> tuple[Place, ...]:
        """Where it would be declared."""
        route = self.place.route
        return tuple(
            replace(self.place, route=(*route, element.name), part="value")
            for element in self.elements
        )


def _missing(lack: _Lack) -> Diagnostic:
    added = listed([f'`{element.name}: "{element.type}"`' for element in lack.elements], "and")
    it = "it" if len(lack.elements) == 1 else "them"
    return Diagnostic(
        "E0404",
        f"the buffer lacks {lack.names}, which the other end has",
        lack.place,
        f"lacks {it}",
        lack.others,
        f"add {added}, or delete {it} at the other end",
        lacks=lack.places,
    )


def _two_lists(here: _Lack, there: _Lack) -> Diagnostic:
    """Each end has what the other lacks: another name, or the list of another buffer."""
    return Diagnostic(
        "E0404",
        f"the buffer lacks {here.names}, and its other end lacks {there.names}",
        here.place,
        f"has {there.names} instead",
        (*here.others, Related(there.place, "the other end")),
        "give both ends the same elements; one may have those of another buffer",
        lacks=here.places + there.places,
    )


def _unconnected(device: Device, facts: Facts) -> Iterator[Diagnostic]:
    """A device of which only one side is connected; one without any is `devices_used`'s matter."""
    ends = facts.connections.ends_at(device.qualified_name)
    contested = device.qualified_name in facts.connections.contested
    if not ends or contested or any(s.qualified_name in facts.broken for s, _ in ends):
        return
    subsystem, port = ends[0]
    sides = (
        (device.x, "x", "y", f"nothing commands `{device.qualified_name}`"),
        (device.y, "y", "x", f"nothing reads what `{device.qualified_name}` reports"),
    )
    for elements, side, direction, message in sides:
        if elements and not any(p.direction == direction for _, p in ends):
            names = ", ".join(f"`{e.name}`" for e in elements)
            lacks = _buffer(subsystem, direction, port.peer)
            here = replace(lacks, part="key")
            yield Diagnostic(
                "O0403",
                message,
                _side(device, side),
                f"{names}: without another end",
                (Related(here, f"`{subsystem.qualified_name}` works with it"),),
                f"add `{port.peer}: {{...}}` under the `{direction}:` of `{subsystem.name}`",
                lacks=(lacks,),
            )
