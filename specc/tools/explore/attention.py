"""Which of the inputs that come a step looks at, and to which members of their enums it reacts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from specc.model import expr as m
from specc.proof import InputName
from specc.tools.explore.cone import Cone
from specc.tools.explore.partial import AbstractValue


class Attention:
    """What the states of one machine look at."""

    def __init__(self, cone: Cone) -> None:
        self._state = cone.state
        self.events = {x.key for x in cone.inputs if x.is_event}
        self.conditions: dict[str, frozenset[InputName]] = {"": frozenset()}
        """The inputs that conditions ask about, by state."""
        for state in cone.states:
            self.conditions[state.name] = cone.rests.all(state.conditions).inputs
        self.functions = {state.name: state.reads for state in cone.states}
        """The inputs that functions read, by state."""

    def lost(
        self,
        new: Iterable[InputName],
        values: Mapping[InputName, AbstractValue],
        source: str,
        target: str,
    ) -> Iterator[tuple[InputName, str]]:
        """The new inputs that neither the conditions of one state nor the functions of the next
        look at; and events with a member to which these do not react, with that member.
        """
        looked = self.functions[target] | self.conditions[source]
        for key in new:
            if key in self._state[source or target].ignores:
                continue
            value = values.get(key) if key in self.events else None
            if key not in looked:
                yield key, ""
            elif isinstance(value, m.Member) and value.name not in self._members(
                key, source, target
            ):
                yield key, value.name

    def _members(self, key: InputName, source: str, target: str) -> frozenset[str]:
        """The members of an input to which a step from a state to another reacts."""
        asked = self._state[source].members_asked(key) if source else frozenset()
        return asked | self._state[target].members_read(key)
