"""Constants that arithmetic gives have a value."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.expr import show
from specc.facts import Facts
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0334."""
    for constant, why in facts.valueless:
        message = f"`{show(constant.value)}` has no value: {why}"
        yield Diagnostic("E0334", message, constant.place, help="write another number")
