"""The model of the plant is there and is MJCF."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.mjcf import ModelError
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0501."""
    if system.plant is not None and isinstance(facts.model, ModelError):
        why, _, way_out = str(facts.model).partition("; ")
        yield Diagnostic(
            "E0501",
            f"the model of the plant cannot be used: {why}",
            system.plant.place,
            help=way_out
            or "a model is an MJCF file; its path is relative to the file that names it",
        )
