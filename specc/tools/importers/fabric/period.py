"""The one period of a subsystem; in FABRIC each state has its own."""

from __future__ import annotations

from fractions import Fraction

from specc.tools.importers.carried import Notes
from specc.tools.importers.fabric.reader import Definition

DEFAULT_PERIOD_S = Fraction(1, 1000)


def period_of(definition: Definition, given: Fraction | None, notes: Notes) -> Fraction:
    """The period of a subsystem: the given one, or the shortest that its file has."""
    if given is not None:
        return given
    periods = [s.period_s for s in definition.states if s.period_s]
    periods += [definition.period_s] if definition.period_s else []
    if not periods:
        text = f"{float(DEFAULT_PERIOD_S * 1000):g} ms"
        message = f"`{definition.name}` has no period; {text} is assumed"
        notes.changed(message, definition.root.place, "give one with `--period`")
        return DEFAULT_PERIOD_S
    shortest = min(periods)
    waiting = [s for s in definition.states if not s.period_s and not definition.period_s]
    slower = [s for s in definition.states if s.period_s and s.period_s != shortest]
    for state in slower or waiting:
        message = f"the period is {float(shortest * 1000):g} ms in all states"
        notes.changed(f"{message}; state `{state.name}` has another one", state.element.place)
    return shortest
