"""All periods are whole multiples of a base tick, and the timeline repeats within reason."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.rates import LONGEST
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0409, at the subsystem whose rate does not go with those of the others."""
    clash = facts.rates.clash
    if clash is None:
        return
    related = [Related(below(s.place, "rate"), _rated(s)) for s in clash.others]
    yield Diagnostic(
        "E0409",
        f"with {_rate(clash.odd)} the timeline repeats only after {_count(clash.ticks)} ticks",
        below(clash.odd.place, "rate"),
        _rated(clash.odd),
        tuple(related[:4]),
        f"choose rates that divide one another; at most {LONGEST} ticks are scheduled",
    )


def _rated(subsystem: Subsystem) -> str:
    return f"`{subsystem.qualified_name}`: {_rate(subsystem)}"


def _rate(subsystem: Subsystem) -> str:
    return f"{float(subsystem.rate_hz):g} Hz"


def _count(ticks: object) -> str:
    text = str(ticks)
    return text if len(text) <= 12 else f"10^{len(text) - 1}"
