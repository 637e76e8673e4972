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
        for index, name in enumerate(bound.binding.actuators if bound.commanded else ()):
            if name in first:
                yield Diagnostic(
                    "E0508",
                    f"actuator `{name}` is driven twice",
                    below(bound.binding.place, "actuators", index),
                    related=(Related(first[name].place, "driven by this already"),),
                    help="let one element of a device command it",
                )
            first.setdefault(name, bound.binding)
