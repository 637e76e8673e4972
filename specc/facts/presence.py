"""Definite presence: which inputs surely have a value in a state, on every way into it.

As a Java compiler follows definite assignment: a set per state, intersected over the rows that
lead there. A value that has arrived stays, so the sets only grow along a way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from specc.facts.connections import Arrivals
from specc.facts.steps import Step
from specc.model.system import Subsystem
from specc.proof import InputName


@dataclass(frozen=True, slots=True)
class Presence:
    """Inputs of a subsystem that surely have a value, by state."""

    initial_state: str
    arrivals: Arrivals
    steps: tuple[Step, ...]
    in_functions: dict[str, frozenset[InputName]]
    """In the functions of a state, from its first period on."""

    @property
    def in_first_period(self) -> frozenset[InputName]:
        """In the first period of all."""
        return self.arrivals.close(self.arrivals.always)

    @property
    def in_later_periods(self) -> frozenset[InputName]:
        """In every period but the first, in whatever state: those in which conditions are asked."""
        return self.arrivals.close(self.arrivals.always | self.arrivals.later)

    def in_conditions(self, state: str) -> frozenset[InputName]:
        """In the conditions that end a state; they are first asked one period after it began."""
        return self.arrivals.close(self.in_functions[state] | self.arrivals.later)

    def after(self, step: Step) -> frozenset[InputName]:
        """Once a row was taken."""
        return self.arrivals.close(self.in_conditions(step.row.source) | step.ensures)

    def way_without(self, state: str, element: InputName) -> list[str]:
        """States on a shortest way to `state` on which the element may be missing."""
        steps = self._without(element)
        before: dict[str, str] = {self.initial_state: ""}
        open_ = deque((self.initial_state,))
        while open_ and state not in before:
            here = open_.popleft()
            for step in steps:
                if step.row.source == here and step.row.target not in before:
                    before[step.row.target] = here
                    open_.append(step.row.target)
        way = [state]
        while before.get(way[-1]):
            way.append(before[way[-1]])
        return way[::-1]

    def _without(self, element: InputName) -> list[Step]:
        return [step for step in self.steps if element not in self.after(step)]


def find_presence(subsystem: Subsystem, steps: Sequence[Step], arrivals: Arrivals) -> Presence:
    """The greatest solution of the flow equations; a state never entered has everything.

    So has every state if it is not known where the machine begins.
    """
    everything = frozenset(
        (port.peer, element.name)
        for port in subsystem.ports
        if port.direction == "x"
        for element in port.elements
    )
    sets = {state.name: everything for state in subsystem.states}
    presence = Presence(subsystem.initial_state, arrivals, tuple(steps), sets)
    if not subsystem.begun:
        return presence
    sets[subsystem.initial_state] = presence.in_first_period
    if presence.in_first_period == everything:
        return presence
    leaving: dict[str, list[Step]] = {}
    for step in steps:
        leaving.setdefault(step.row.source, []).append(step)
    open_ = deque((subsystem.initial_state,))
    met = {subsystem.initial_state}
    while open_:
        for step in leaving.get(open_.popleft(), ()):
            target = step.row.target
            present = sets[target] & presence.after(step)
            if present != sets[target] or target not in met:
                sets[target] = present
                met.add(target)
                open_.append(target)
    return presence
