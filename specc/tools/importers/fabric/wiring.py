"""Connections of FABRIC, the ends they become, and the types and operators of these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from specc.reachable import grouped
from specc.tools.importers.fabric.reader import Buffer, FabricSubsystem
from specc.tools.importers.import_notes import Notes
from specc.tools.importers.writing import Data, SpecNames, without_empty

# Types and operators that imported subsystems need, and the Python modules behind them.


PARTS = "_parts"
"""The module with the predicates and components of subsystem `a` is `a_parts`."""


@dataclass(eq=False, slots=True)
class SharedDefinitions:
    """Types and operators of all subsystems, as data of the YAML."""

    types: dict[str, Data] = field(default_factory=dict)
    operators: dict[str, Data] = field(default_factory=dict)
    modules: dict[str, None] = field(default_factory=dict)
    """Python modules that the user provides, in order of appearance."""
    names: SpecNames = field(default_factory=SpecNames)

    def message(self, type: str) -> str:
        """The name of a message type of ROS, which is opaque."""
        name = self.names.of(type)
        if name not in self.types:
            self.types[name] = {"opaque": True, "python": self._python(type), "title": type}
        return name

    def empty(self, type: str) -> str:
        """The expression of an empty message, which stands before the first one."""
        name = self.names.of(f"empty {self.names.of(type)}")
        self.operators[name] = {
            "signature": f"() -> {self.message(type)}",
            "python": self._python(type),
            "title": "an empty message",
        }
        return f"{name}()"

    def _python(self, type: str) -> str:
        package, _, message = type.partition("::")
        self.modules[f"{package}.msg"] = None
        return f"{package}.msg:{message}"

    def opaque(self, name: str, module: str, title: str) -> str:
        """A type that only operators look into; its name."""
        own = self.names.of(f"{module.removesuffix(PARTS)} {name}")
        self.modules[module] = None
        self.types[own] = {"opaque": True, "python": f"{module}:{name}", "title": title}
        return own

    def operator(self, name: str, module: str, signature: str, title: str) -> str:
        """An operator; its name."""
        own = self.names.of(f"{module.removesuffix(PARTS)} {name}")
        python = f"{module}:{name}"
        self.operators[own] = {"signature": signature, "python": python, "title": title}
        return own


# Which buffers of several subsystem definitions are connected.
#
# The files do not say it: the deployer of FABRIC connects them. Two buffers meet if their message
# type is the same, one is an output and the other an input, and one is on the bottom side and the
# other on the top side of another subsystem. They are taken to be connected if they have one name,
# or else meet no other buffer that is left.


End = tuple[str, str]
"""Name of a subsystem and alias of one of its buffers."""


@dataclass(eq=False, slots=True)
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
    definitions: Sequence[FabricSubsystem], asked: Iterable[tuple[End, End]], notes: Notes
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


def _evident(definitions: Sequence[FabricSubsystem], wiring: Wiring) -> Iterator[tuple[End, End]]:
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


def _meeting(definitions: Sequence[FabricSubsystem], wiring: Wiring) -> dict[End, list[End]]:
    """The buffers that are not connected, each with those that it meets."""
    left = [
        ((d.name, b.alias), b)
        for d in definitions
        for b in d.buffers
        if not wiring.has((d.name, b.alias))
    ]
    alike = grouped(((b.type, b.is_input, b.side), end) for end, b in left)
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
    by_name: dict[str, FabricSubsystem], first: End, second: End, wiring: Wiring, notes: Notes
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


# The buffers of a subsystem by the agents at their other ends, and stand-ins for those.


class Ends:
    """What the buffers of one subsystem are connected with."""

    def __init__(
        self,
        definition: FabricSubsystem,
        agents: SpecNames,
        library: SharedDefinitions,
        wiring: Wiring,
        rate: str,
    ) -> None:
        self._definition, self._agents, self._library = definition, agents, library
        self._wiring, self._rate = wiring, rate
        self.own = agents.of(definition.name)

    def buffers(self, *, inputs: bool) -> dict[str, Data]:
        """The `x` or the `y` of the subsystem."""
        found: dict[str, dict[str, Data]] = {}
        for buffer in self._definition.buffers:
            if buffer.is_input == inputs:
                element: dict[str, Data] = {"type": self._library.message(buffer.type)}
                if inputs:
                    element["init"] = self._library.empty(buffer.type)
                name = self.element(buffer)
                if name != buffer.alias:
                    element["title"] = buffer.alias
                for peer in self.peers(buffer):
                    found.setdefault(peer, {})[name] = element
        return {**found}

    def input(self, buffer: Buffer) -> str:
        """The expression that reads an input buffer."""
        return f"x.{self.peers(buffer)[0]}.{self.element(buffer)}"

    def outputs(self, buffer: Buffer) -> list[str]:
        """What is written to send an output buffer to all that read it."""
        return [f"y.{peer}.{self.element(buffer)}" for peer in self.peers(buffer)]

    def peers(self, buffer: Buffer) -> list[str]:
        """The agents at the other ends: of an input one, of an output one or more."""
        outside = f"{self._definition.name} {buffer.side}"
        return [self._agents.of(name) for name, _ in self._other_ends(buffer) or [(outside, "")]]

    def element(self, buffer: Buffer) -> str:
        """Both ends of a connection have the name that the sender gives the buffer."""
        others = self._other_ends(buffer)
        return SpecNames().of(others[0][1] if others and buffer.is_input else buffer.alias)

    def _other_ends(self, buffer: Buffer) -> list[End]:
        own = self._definition.name, buffer.alias
        if not buffer.is_input:
            return self._wiring.readers.get(own, [])
        return [self._wiring.sender[own]] if own in self._wiring.sender else []

    def stand_ins(self) -> dict[str, Data]:
        """An agent for each side on which something is not connected."""
        found: dict[str, Data] = {}
        for side in ("top", "bottom"):
            buffers = [b for b in self._definition.buffers if b.side == side]
            outside = [b for b in buffers if not self._other_ends(b)]
            if outside:
                found[self.peers(outside[0])[0]] = self._stand_in(outside, side)
        return found

    def _stand_in(self, buffers: list[Buffer], side: str) -> dict[str, Data]:
        """An agent that sends empty messages, until somebody describes what is really there."""
        sent = [b for b in buffers if b.is_input]
        received = [b for b in buffers if not b.is_input]
        functions: dict[str, Data] = {}
        if sent:
            functions["send"] = {
                f"y.{self.own}.{self.element(b)}": self._library.empty(b.type) for b in sent
            }
        if received:
            functions["receive"] = {f"last_{b.alias}": self._last(b) for b in received}
        control: dict[str, Data] = {
            "title": f"stands for what is connected on the {side} side of {self._definition.name}",
            "rate": self._rate,
            "x": {self.own: self._types(received)} if received else {},
            "y": {self.own: self._types(sent)} if sent else {},
            "memory": {
                f"last_{b.alias}": {
                    "type": self._library.message(b.type),
                    "init": self._library.empty(b.type),
                }
                for b in received
            },
            "functions": functions,
            "behaviours": {"stand_in": {"functions": [*functions], "terminal": "never"}},
            "states": {"S0": "stand_in"},
            "initial_state": "S0",
        }
        return {"control": without_empty(control)}

    def _types(self, buffers: list[Buffer]) -> dict[str, Data]:
        return {self.element(b): self._library.message(b.type) for b in buffers}

    def _last(self, buffer: Buffer) -> str:
        """A stand-in keeps what it receives; nothing else is known of what it does with it."""
        element = f"x.{self.own}.{self.element(buffer)}"
        return f"{element} if present({element}) else last_{buffer.alias}"
