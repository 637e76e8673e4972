"""A commanded element moves actuators; a reported one comes from joints, sensors or a camera."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.kinds import wrong_kind
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0505."""
    for bound in facts.bindings:
        complaint = wrong_kind(bound)
        if complaint:
            message, help_text = complaint
            related = (Related(bound.element.place, f"`{bound.element.type}`"),)
            yield Diagnostic("E0505", message, bound.binding.place, "", related, help_text)
