"""Which buffers of several subsystem definitions are connected.

The files do not say it: the deployer of FABRIC connects them. Two buffers meet if their message
type is the same, one is an output and the other an input, and one is on the bottom side and the
other on the top side of another subsystem. They are taken to be connected if they have one name,
or else meet no other buffer that is left.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from specc.importers.carried import Notes
from specc.importers.fabric.definition import Definition

End = tuple[str, str]
"""Name of a subsystem and alias of one of its buffers."""


@dataclass(slots=True)
class Wiring:
    """Connections by their ends; a buffer that is in neither ends outside the files."""

    readers: dict[End, list[End]] = field(default_factory=dict)
    """Output buffer -> input buffers, of different subsystems."""
    sender: dict[End, End] = field(default_factory=dict)
    """Input buffer -> output buffer."""

    def add(self, output: End, input_: End) -> None:
        """Connect two buffers."""
        self.readers.setdefault(output, []).append(input_)
        self.sender[input_] = output

    def has(self, end: End) -> bool:
        """Whether a buffer is connected."""
        return end in self.readers or end in self.sender


def connect(
    definitions: Sequence[Definition], asked: Iterable[tuple[End, End]], notes: Notes
) -> Wiring:
    """The connections that were asked for, then those that are evident."""
    wiring = Wiring()
    by_name = {d.name: d for d in definitions}
    for first, second in asked:
        _asked(by_name, first, second, wiring, notes)
    while made := [*_evident(definitions, wiring)]:
        for output, input_ in made:
            wiring.add(output, input_)
    for end, others in _meeting(definitions, wiring).items():
        if others:
            listed = ", ".join(f"`{name}.{alias}`" for name, alias in others)
            buffer = by_name[end[0]].buffer(end[1])
            assert buffer is not None  # ends are made of buffers
            notes.changed(
                f"`{end[0]}.{end[1]}` could be connected with {listed}; it ends outside instead",
                buffer.element.place,
                f"choose with `--connect {end[0]}.{end[1]}={others[0][0]}.{others[0][1]}`",
            )
    return wiring


def _evident(definitions: Sequence[Definition], wiring: Wiring) -> Iterator[tuple[End, End]]:
    """Outputs and inputs that meet under one name, or without these those that meet no other.

    Several subsystems may read an output under its name.
    """
    meeting = _meeting(definitions, wiring)
    named = {e: [o for o in others if o[1] == e[1]] for e, others in meeting.items()}
    outputs = [(d.name, b.alias) for d in definitions for b in d.buffers if not b.is_input]
    for choice in (named, meeting):
        found = [
            (output, input_)
            for output in outputs
            if (inputs := choice.get(output, []))
            and (choice is named or len(inputs) == 1)
            and all(choice[input_] == [output] for input_ in inputs)
            for input_ in inputs
        ]
        if found:
            yield from found
            return


def _meeting(definitions: Sequence[Definition], wiring: Wiring) -> dict[End, list[End]]:
    """The buffers that are not connected, each with those that it meets."""
    left = [
        ((d.name, b.alias), b)
        for d in definitions
        for b in d.buffers
        if not wiring.has((d.name, b.alias))
    ]
    alike: dict[tuple[str, bool, str], list[End]] = {}
    for end, buffer in left:
        alike.setdefault((buffer.type, buffer.is_input, buffer.side), []).append(end)
    opposite = {"top": "bottom", "bottom": "top"}
    return {
        end: [
            other
            for other in alike.get((b.type, not b.is_input, opposite[b.side]), ())
            if other[0] != end[0]
        ]
        for end, b in left
    }


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
    known = {name for name, _ in wiring.readers.get(output, ())}
    if input_ in wiring.sender or input_[0] in known:
        message = f"`{first[0]}.{a.alias}` or `{second[0]}.{b.alias}` is connected twice"
        notes.error("E0806", message, b.element.place, "correct the `--connect`")
        return
    wiring.add(output, input_)
