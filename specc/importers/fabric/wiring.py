"""Which buffers of several subsystem definitions are connected.

The files do not say it: the deployer of FABRIC connects them. Two buffers are taken to be connected
if their message type is the same, one is an output and the other an input, one is on the bottom
side and the other on the top side of another subsystem, and both fit nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from specc.importers.carried import Notes
from specc.importers.fabric.definition import Buffer, Definition

End = tuple[str, str]
"""Name of a subsystem and alias of one of its buffers."""


@dataclass(slots=True)
class Wiring:
    """Connections by their ends; a buffer that is in neither ends outside the files."""

    reader: dict[End, End] = field(default_factory=dict)
    """Output buffer -> input buffer."""
    sender: dict[End, End] = field(default_factory=dict)
    """Input buffer -> output buffer."""

    def add(self, output: End, input_: End) -> None:
        """Connect two buffers."""
        self.reader[output] = input_
        self.sender[input_] = output


def connect(
    definitions: Sequence[Definition], asked: Iterable[tuple[End, End]], notes: Notes
) -> Wiring:
    """The connections that were asked for, then those that are evident."""
    wiring = Wiring()
    by_name = {d.name: d for d in definitions}
    for first, second in asked:
        _asked(by_name, first, second, wiring, notes)
    candidates = {
        (d.name, b.alias): _fitting(d, b, definitions, wiring)
        for d in definitions
        for b in d.buffers
        if (d.name, b.alias) not in wiring.reader and (d.name, b.alias) not in wiring.sender
    }
    for end, others in candidates.items():
        buffer = by_name[end[0]].buffer(end[1])
        assert buffer is not None  # ends are made of buffers
        if len(others) == 1 and candidates[others[0]] == [end]:
            if not buffer.is_input:
                wiring.add(end, others[0])
        elif others:
            listed = ", ".join(f"`{name}.{alias}`" for name, alias in others)
            notes.changed(
                f"`{end[0]}.{end[1]}` could be connected with {listed}; it ends outside instead",
                buffer.element.place,
                f"choose with `--connect {end[0]}.{end[1]}={others[0][0]}.{others[0][1]}`",
            )
    return wiring


def _fitting(
    own: Definition, buffer: Buffer, definitions: Sequence[Definition], wiring: Wiring
) -> list[End]:
    return [
        (other.name, candidate.alias)
        for other in definitions
        if other is not own
        for candidate in other.buffers
        if _fit(buffer, candidate)
        and (other.name, candidate.alias) not in wiring.reader
        and (other.name, candidate.alias) not in wiring.sender
    ]


def _fit(a: Buffer, b: Buffer) -> bool:
    return a.type == b.type and a.is_input != b.is_input and a.side != b.side


def _asked(
    by_name: dict[str, Definition], first: End, second: End, wiring: Wiring, notes: Notes
) -> None:
    root = next(iter(by_name.values())).root
    found = []
    for name, alias in (first, second):
        definition = by_name.get(name)
        buffer = definition.buffer(alias) if definition else None
        if buffer is None:
            message, help = f"there is no buffer `{name}.{alias}`", "correct the `--connect`"
            notes.error("E0805", message, root.place, help)
            return
        found.append(buffer)
    a, b = found
    if a.type != b.type or a.is_input == b.is_input or first[0] == second[0]:
        message = f"`{first[0]}.{a.alias}` and `{second[0]}.{b.alias}` cannot be connected"
        help = "connect an input with an output of the same type in another subsystem"
        notes.error("E0805", message, b.element.place, help)
        return
    output, input_ = (second, first) if a.is_input else (first, second)
    if output in wiring.reader or input_ in wiring.sender:
        message = f"`{first[0]}.{a.alias}` or `{second[0]}.{b.alias}` is connected twice"
        notes.error("E0806", message, b.element.place, "correct the `--connect`")
        return
    wiring.add(output, input_)
