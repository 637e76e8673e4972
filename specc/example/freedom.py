"""What may be changed in a situation, and how inputs, memory and time are changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from specc.example.situation import Situation
from specc.example.values import Value
from specc.proof import InputName

LONGEST = 100_000
"""Most periods that a scenario waits."""


@dataclass(frozen=True, slots=True)
class Freedom:
    """What a search may change.

    Attributes:
        memory: memory elements with these names.
        time: how long the state has been running.
        unsent: inputs that change although nothing comes; otherwise only those of `devices` do.
        sure: inputs that are always there.
        never: inputs that must not come.
    """

    memory: frozenset[str]
    time: bool
    unsent: bool
    devices: frozenset[InputName]
    sure: frozenset[InputName]
    never: frozenset[InputName] = frozenset()

    def input(self, name: InputName, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value of an input."""
        inputs = {**at.inputs, name: value}
        if name in self.never:
            return
        if name in at.fresh or self.unsent or name in self.devices:
            yield replace(at, inputs=inputs, present=at.present | {name})
        if name not in at.fresh:
            came = at.fresh | {name}
            yield replace(at, inputs=inputs, present=at.present | {name}, fresh=came)

    def fresh(self, name: InputName, wanted: bool, at: Situation) -> Iterator[Situation]:
        """The situation where an input has come, or has not."""
        if not wanted:
            yield replace(at, fresh=at.fresh - {name})
        elif name not in self.never:
            yield replace(at, fresh=at.fresh | {name}, present=at.present | {name})

    def present(self, name: InputName, wanted: bool, at: Situation) -> Iterator[Situation]:
        """The situation where an input has a value, or none yet."""
        if wanted and name not in self.never:
            yield from self.fresh(name, True, at)
            if self.unsent:
                yield replace(at, present=at.present | {name})
        if not wanted and name not in self.sure and self.unsent:
            yield replace(at, present=at.present - {name}, fresh=at.fresh - {name})

    def remembered(self, name: str, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value in memory."""
        if name in self.memory:
            yield replace(at, memory={**at.memory, name: value})

    def after(self, periods: int, at: Situation) -> Iterator[Situation]:
        """The situation some periods after the state was entered."""
        if self.time and 1 <= periods <= LONGEST:
            yield replace(at, periods=periods)
