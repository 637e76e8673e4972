"""Where a value may be so and so old, a measurement is behind it."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.sources import bounded
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0415."""
    for node, element in bounded(facts):
        if facts.ages.oldest(node) is None:
            yield Diagnostic(
                "W0415",
                f"no measurement is behind `{node.short}`",
                below(element.place, "max_age"),
                "limits nothing",
                help="delete it, or set it where the measurement arrives; what comes out of memory "
                "has no age",
            )
