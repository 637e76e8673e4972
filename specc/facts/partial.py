"""Machines with unknown conditions in them: the machines that they surely and possibly are.

What is said of such a machine has to hold whatever the unknown is. Two rows surely overlap where
the cause and both surely hold, and one is surely taken where it does; nothing applies where the
cause surely holds and no row possibly does; nothing ever applies where nothing possibly does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from specc.facts.bounds import Bound, possibly, surely
from specc.model.expr import has_unknown
from specc.model.fsm import Cause, Condition, State, Transition
from specc.model.system import Subsystem


@dataclass(frozen=True, slots=True)
class View:
    """A way to look at a machine with unknowns: what is taken to hold of them."""

    cause: Cause
    ends: Bound
    rows: Bound

    def of(self, subsystem: Subsystem) -> Subsystem:
        """The machine without unknowns; of its behaviours only the end by the cause counts."""
        states = tuple(self._state(state) for state in subsystem.states)
        rows = tuple(_row(row, self.rows) for row in subsystem.transitions)
        return replace(subsystem, states=states, transitions=rows)

    def _state(self, state: State) -> State:
        behaviour = state.behaviour
        # An error goes before an end: where it is not known, the end is not known either.
        opposite = possibly if self.ends is surely else surely
        error = self.ends if self.cause == "error" else opposite
        seen = replace(
            behaviour,
            terminal=_known(behaviour.terminal, self.ends),
            error=_known(behaviour.error, error),
        )
        return replace(state, behaviour=seen)


def sure(cause: Cause) -> View:
    """Where ends and rows surely hold."""
    return View(cause, surely, surely)


def unmet(cause: Cause) -> View:
    """Where ends surely hold, beside rows that possibly do."""
    return View(cause, surely, possibly)


def possible(cause: Cause) -> View:
    """Where ends and rows possibly hold."""
    return View(cause, possibly, possibly)


def is_vague(subsystem: Subsystem, state: State, cause: Cause) -> bool:
    """Whether something about the rows of a state and cause is unknown."""
    behaviour = state.behaviour
    conditions = [behaviour.error, *(row.condition for _, row in subsystem.rows(state.name, cause))]
    if cause == "terminal":
        conditions.append(behaviour.terminal)
    return any(has_unknown(condition.when) for condition in conditions)


def _row(row: Transition, bound: Bound) -> Transition:
    return replace(row, condition=_known(row.condition, bound))


def _known(condition: Condition, bound: Bound) -> Condition:
    return replace(condition, when=bound(condition.when))
