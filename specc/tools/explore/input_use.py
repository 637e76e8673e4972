"""Which inputs a step reads, and to which members of their enums it reacts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from specc.model import expr as m
from specc.proof import InputName
from specc.tools.explore.cone import Cone
from specc.tools.explore.partial import AbstractValue


class InputUse:
    """The inputs that the states of one machine read."""

    def __init__(self, cone: Cone) -> None:
        self._state = cone.state
        self.events = {x.key for x in cone.inputs if x.is_event}
        self.read_by_conditions: dict[str, frozenset[InputName]] = {"": frozenset()}
        """The inputs that conditions read, by state."""
        for state in cone.states:
            self.read_by_conditions[state.name] = cone.dependences.all(state.conditions).inputs
        self.read_by_functions = {state.name: state.reads for state in cone.states}
        """The inputs that functions read, by state."""

    def lost_inputs(
        self,
        new: Iterable[InputName],
        values: Mapping[InputName, AbstractValue],
        source: str,
        target: str,
    ) -> Iterator[tuple[InputName, str]]:
        """The new inputs that neither the conditions of one state nor the functions of the next
        read; and events with a member to which these do not react, with that member.
        """
        read = self.read_by_functions[target] | self.read_by_conditions[source]
        for key in new:
            if key in self._state[source or target].ignores:
                continue
            value = values.get(key) if key in self.events else None
            if key not in read:
                yield key, ""
            elif isinstance(value, m.Member) and value.name not in self._members_read(
                key, source, target
            ):
                yield key, value.name

    def _members_read(self, key: InputName, source: str, target: str) -> frozenset[str]:
        """The members of an input to which a step from a state to another reacts."""
        in_conditions = self._state[source].members_in_conditions(key) if source else frozenset()
        return in_conditions | self._state[target].members_in_functions(key)
