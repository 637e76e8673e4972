"""The inputs of a subsystem: what is there at first, what comes later, what comes together."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from specc.example.search import Goal
from specc.example.situation import Meaning, Situation
from specc.example.values import Value, first_value
from specc.facts import Facts
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.scenario.machine import axioms_hold, value_of


class Inputs:
    """Situations as far as the inputs of one subsystem go."""

    def __init__(
        self, meaning: Meaning, facts: Facts, original: Subsystem, never: Collection[InputName]
    ) -> None:
        """`original` is the subsystem as the facts know it; what `never` names does not come."""
        self._meaning = meaning
        self._never = frozenset(never)
        self._arrivals = facts.presence(original).arrivals
        ports = [port for port in original.ports if port.direction == "x"]
        self._elements = {(p.peer, e.name): e for p in ports for e in p.elements}
        self.names = frozenset(self._elements)
        self.always = facts.connections.always_present(original)
        self.devices = frozenset(
            (port.peer, element.name)
            for port in ports
            if port.other_end in facts.connections.devices
            for element in port.elements
        )

    def nothing(self, number: float) -> Situation:
        """The first period when nothing has come, with `number` where numbers do not matter.

        Raises:
            StrayError: an initial value has no value.
        """
        inputs: dict[InputName, Value] = {
            name: first_value(element.type, number) for name, element in self._elements.items()
        }
        start = Situation(inputs, self.always)
        for name, element in self._elements.items():
            if element.init is not None:
                inputs[name] = value_of(self._meaning, element.init, start)
        return start

    def with_values(self, at: Situation, wanted: Situation) -> Situation:
        """A first period with the values of another situation, as far as the assumptions allow."""
        for name in sorted(wanted.present):
            known = name in self.always or name in self._arrivals.later
            if known and repr(at.inputs[name]) == repr(wanted.inputs[name]):
                continue
            came = at.fresh if name in self.devices else at.fresh | {name}
            inputs = {**at.inputs, name: wanted.inputs[name]}
            more = replace(at, inputs=inputs, present=at.present | {name}, fresh=came)
            if axioms_hold(self._meaning, more):
                at = more
        return replace(at, answers=wanted.answers)

    def without_own(self, at: Situation) -> Situation:
        """The situation without the inputs that have their initial value by themselves."""
        own = {
            name
            for name, element in self._elements.items()
            if element.init is not None and name not in at.fresh
        }
        return replace(at, present=at.present - own)

    def with_company(self, at: Situation, goals: Sequence[Goal]) -> Situation:
        """The situation with what is sent together with what has come."""
        present = self._arrivals.close(at.present) - self._never
        came = replace(at, present=present, fresh=at.fresh | (present - at.present))
        return came if self._meaning.meets(goals, came) else replace(at, present=present)

    def later(self, at: Situation) -> Situation:
        """The situation one period later, when what is sent in every period has come."""
        present = self._arrivals.close(at.present | self._arrivals.later) - self._never
        return replace(at, present=present)
