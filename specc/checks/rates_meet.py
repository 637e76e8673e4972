"""All periods are whole multiples of a base tick, and the timeline repeats within reason."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.timeline import base_tick, hyperperiod
from specc.model.system import Subsystem, System

LONGEST = 100_000
"""Base ticks after which the timeline has to repeat."""


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0409, at the first subsystem whose rate does not go with those before it."""
    before: list[Subsystem] = []
    for subsystem in facts.subsystems:
        periods = [1 / s.rate_hz for s in (*before, subsystem)]
        ticks = hyperperiod(periods) / base_tick(periods)
        if ticks > LONGEST:
            related = [
                Related(below(s.place, "rate"), f"`{s.qualified_name}`: {_rate(s)}") for s in before
            ]
            yield Diagnostic(
                "E0409",
                f"with {_rate(subsystem)} the timeline repeats only after {_count(ticks)} ticks",
                below(subsystem.place, "rate"),
                f"`{subsystem.qualified_name}`: {_rate(subsystem)}",
                tuple(related[:4]),
                f"choose rates that divide one another; at most {LONGEST} ticks are scheduled",
            )
            return
        before.append(subsystem)


def _rate(subsystem: Subsystem) -> str:
    return f"{float(subsystem.rate_hz):g} Hz"


def _count(ticks: object) -> str:
    text = str(ticks)
    return text if len(text) <= 12 else f"10^{len(text) - 1}"
