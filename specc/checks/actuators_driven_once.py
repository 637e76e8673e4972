"""An actuator of the plant obeys one element."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.model.system import Binding, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0508."""
    first: dict[str, Binding] = {}
    for bound in facts.bindings:
        for name in bound.binding.actuators if bound.commanded else ():
            earlier = first.setdefault(name, bound.binding)
            if earlier is not bound.binding or bound.binding.actuators.count(name) > 1:
                yield Diagnostic(
                    "E0508",
                    f"actuator `{name}` is driven twice",
                    below(bound.binding.place, "actuators"),
                    related=(Related(earlier.place, "driven by this as well"),)
                    if earlier is not bound.binding
                    else (),
                    help="let one element of a device command it",
                )
