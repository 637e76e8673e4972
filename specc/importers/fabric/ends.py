"""The buffers of a subsystem by the agents at their other ends, and stand-ins for those."""

from __future__ import annotations

from specc.importers.fabric.definition import Buffer, Definition
from specc.importers.fabric.library import Library
from specc.importers.fabric.wiring import End, Wiring
from specc.importers.names import Names
from specc.importers.yaml import Data


class Ends:
    """What the buffers of one subsystem are connected with."""

    def __init__(
        self, definition: Definition, agents: Names, library: Library, wiring: Wiring, rate: str
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
        return Names().of(others[0][1] if others and buffer.is_input else buffer.alias)

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
        return {"control": {key: value for key, value in control.items() if value}}

    def _types(self, buffers: list[Buffer]) -> dict[str, Data]:
        return {self.element(b): self._library.message(b.type) for b in buffers}

    def _last(self, buffer: Buffer) -> str:
        """A stand-in keeps what it receives; nothing else is known of what it does with it."""
        element = f"x.{self.own}.{self.element(buffer)}"
        return f"{element} if present({element}) else last_{buffer.alias}"
